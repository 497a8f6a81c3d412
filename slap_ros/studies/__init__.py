# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The papers' figures, made again for this system: ``slap`` and ``lg_sail`` have a module a study.

Each measures something and gives a :class:`~slap_ros.studies.results.StudyReport`, which is
written as data, picture and page. Here is what they share.
"""
