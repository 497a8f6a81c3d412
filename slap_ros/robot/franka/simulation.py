# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Starts a simulated FR3 in a process of its own, which ends with this one."""

from __future__ import annotations

import json
import select
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Self

from slap_ros.errors import RobotUnreachableError
from slap_ros.robot.franka.installed import simulator_python

PROGRAM = Path(__file__).with_name("simulated_fr3.py")
START_S = 120.0  # s, for its imports on a busy machine
ANSWER_S = 10.0  # s, for one turn of its loop on a busy machine
STOP_S = 5.0


class SimulatedFr3:
    """A simulated FR3 that speaks the robot's protocol."""

    def __init__(self, joints: Sequence[float]) -> None:
        """Start it, and wait until it listens.

        Args:
            joints: Joint positions to begin with, rad.

        Raises:
            InvalidParameterError: franky-sim is not installed.
            RobotUnreachableError: It did not start.
        """
        self._process = subprocess.Popen(
            [str(simulator_python()), str(PROGRAM), json.dumps([float(q) for q in joints])],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.ip = self._address()

    def inject(self, fault: str) -> None:
        """Raise a fault, and return when it is there: see ``simulated_fr3.py``.

        Args:
            fault: Line that names the fault.

        Raises:
            RobotUnreachableError: The simulated FR3 does not answer.
        """
        assert self._process.stdin is not None
        self._process.stdin.write(f"{fault}\n")
        self._process.stdin.flush()
        if self._answer(ANSWER_S) != fault:
            raise RobotUnreachableError(f"the simulated FR3 did not take the fault {fault!r}")

    def kill(self) -> None:
        """End the process as a crash does."""
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        """End the process, and wait until it has ended."""
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()
        try:
            self._process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self.kill()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _address(self) -> str:
        """The address that it prints."""
        address = self._answer(START_S)
        if not address:
            self.kill()
            raise RobotUnreachableError("the simulated FR3 did not start: see its messages above")
        return address

    def _answer(self, patience_s: float) -> str:
        """The next line that it prints; empty if there is none in time."""
        assert self._process.stdout is not None
        ready, _, _ = select.select([self._process.stdout], [], [], patience_s)
        return self._process.stdout.readline().strip() if ready else ""
