# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What runs are measured by.

Trials in this process: ``experiment``, ``summary``. Runs of an ensemble, live or from a bag:
``run_log`` collects messages into ``recorded_run``, and ``measurement`` makes ``metrics`` of these;
``completeness`` says what is missing.
"""
