# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's figures, made again for this system: a module a study.

Each measures something and gives a :class:`~slap_ros.studies.results.Report`, which is written as
data, picture and page.
"""
