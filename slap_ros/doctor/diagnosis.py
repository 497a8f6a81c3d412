# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Everything that runs depend on, looked at once."""

from __future__ import annotations

from pathlib import Path

from slap_ros.doctor import dds, domains, libraries, machine, ros
from slap_ros.doctor.check import Check

RUNS = Path("runs")  # where runs are recorded by default


def diagnose(runs: Path = RUNS) -> list[Check]:
    """Look at everything that runs depend on; nothing is changed, and nothing left running.

    The checks come one after the other, so that none disturbs what another measures.

    Args:
        runs: The folder in which runs are to be recorded; it need not exist yet.
    """
    about = ros.RclpyStatus.ask()
    return [
        machine.python_version(),
        ros.installation(about),
        ros.middleware(about),
        ros.interfaces(about),
        ros.settings(about),
        dds.conversation(about),
        libraries.rosbags(),
        libraries.pybullet(),
        libraries.training(),
        libraries.figures(),
        libraries.live(),
        libraries.language(),
        libraries.local_language(),
        domains.others(),
        machine.disk_space(runs),
        machine.write_permission(runs),
        machine.open_files(),
        machine.processors_and_memory(),
    ]
