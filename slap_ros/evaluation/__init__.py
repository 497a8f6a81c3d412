# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measuring runs: trials, metrics, and what a recording lacks.

Trials in this process: ``experiment``, ``summary``. Runs of an ensemble, live or from a bag:
``run_log`` collects messages into ``recorded_run``, and ``measurement`` makes ``metrics`` of these;
``completeness`` says what is missing.
"""
