# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What tests of studies share."""

from contextlib import nullcontext

from slap_ros.learning.workers import SequentialWorkers
from slap_ros.studies import job_runner


def in_this_process(monkeypatch):
    """Let jobs of studies run here: processes take longer to start than what they would do."""
    monkeypatch.setattr(job_runner, "local_workers", lambda _: nullcontext(SequentialWorkers()))


def without_seconds(data):
    """Data without measured times."""
    if isinstance(data, dict):
        return {k: without_seconds(v) for k, v in data.items() if not k.endswith("seconds")}
    return [without_seconds(part) for part in data] if isinstance(data, list) else data
