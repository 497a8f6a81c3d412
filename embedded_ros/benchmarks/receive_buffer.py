# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Resident memory of an idle process beside another, by the size of CycloneDDS's receive buffer.

CycloneDDS alone, no code of embedded_ros. Participants announce themselves 500 times a second
instead of every few seconds, so that half a minute shows what otherwise takes hours.

    python benchmarks/receive_buffer.py
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

from cyclonedds.domain import Domain, DomainParticipant

DOMAIN_ID = 149
SIZES = ("1 MiB", "256 KiB")  # CycloneDDS's default, and ours
SECONDS = 20
CONFIGURATION = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><SPDPInterval>2 ms</SPDPInterval>"
    '<Peers><Peer address="localhost"/></Peers></Discovery>'
    "<Sizing><ReceiveBufferSize>{size}</ReceiveBufferSize></Sizing></Domain></CycloneDDS>"
)


def resident_kib() -> int:
    """Of this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4


def idle(size: str) -> None:
    """Join the network, do nothing, and print by how much this process has grown meanwhile."""
    _kept = Domain(DOMAIN_ID, CONFIGURATION.format(size=size)), DomainParticipant(DOMAIN_ID)
    time.sleep(1.0)  # until the other is there
    start, growth = resident_kib(), []
    for _ in range(SECONDS):
        time.sleep(1.0)
        growth.append(resident_kib() - start)
    print(f"{size}, growth in KiB after each second:", *growth)


def main() -> None:
    """For each size start two processes, of which the first tells."""
    if sys.argv[1:]:
        idle(sys.argv[1])
        return
    for size in SIZES:
        command = [sys.executable, __file__, size]
        with subprocess.Popen(command), subprocess.Popen(command, stdout=subprocess.DEVNULL):
            pass


if __name__ == "__main__":
    main()
