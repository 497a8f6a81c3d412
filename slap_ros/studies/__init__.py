# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The papers' figures, made again for this system: ``slap`` and ``lg_sail`` have a file a study.

A file has all of its study: options, what they open, jobs, report, picture, summary, and figures of
the paper. Its ``STUDY`` names them for the registry. ``slap study`` and the tables of results are
loops over the registry. Each study gives a :class:`~slap_ros.studies.results.StudyReport`, which is
written as data, picture and page. Here is what they share.
"""
