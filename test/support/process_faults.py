# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Processes of a run that are killed, stopped, paused or started again, at any moment."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from random import Random

import psutil

NODES = ("sim_node", "perception_node", "skill_server", "planner_node", "recorder_node")
RUNNER = "slap run"  # what started them
FAULTS = ("kill", "stop", "pause")
GIVE_UP = 12.0  # s, after which a run is told to give up
LIMIT = 120.0  # s, far more than the 30 s that a case may take: a loaded machine takes its time
PAUSES = (0.3, 8.0)  # s, about the middle of which nodes lose sight of each other
BAG_SIZES = (4_000, 90_000)  # bytes, from the first messages of a run to nearly all of them
START_TIMES = (0.0, 3.0)  # s, while the nodes come up


@dataclass(frozen=True)
class Case:
    """What is done to whom, and when; all of it from a seed."""

    fault: str
    victim: str
    seed: int
    bag_size: int  # once so much is recorded
    start_s: float | None  # rather so soon after the start
    pause_s: float

    @classmethod
    def sampled(cls, number):
        """Consecutive numbers take turns at the faults."""
        rng = Random(number)
        fault = FAULTS[number % len(FAULTS)]
        victim = rng.choice(NODES if fault == "stop" else (*NODES, RUNNER))
        start_s = rng.uniform(*START_TIMES) if rng.random() < 0.25 else None
        return cls(fault, victim, number, rng.randint(*BAG_SIZES), start_s, rng.uniform(*PAUSES))

    @classmethod
    def sampled_restart(cls, number):
        """Consecutive numbers take turns at the nodes."""
        rng = Random(number)
        victim = NODES[number % len(NODES)]
        return cls("restart", victim, number, rng.randint(*BAG_SIZES), None, 0.0)

    def __str__(self):
        when = f"{self.start_s:.1f}s" if self.start_s is not None else f"{self.bag_size}B"
        return f"{self.seed}-{self.fault}-{self.victim.replace(' ', '_')}-{when}"


class Run:
    """A ``slap run`` that is recorded, with its processes."""

    def __init__(self, case, bag):
        self.case, self.bag = case, bag
        self._seen = set()  # every process that there was
        self.process = subprocess.Popen(
            [sys.executable, "-m", "ensemble.cli", "run", "obstacle2d", "--shortcuts", "none",
             "--seed", str(case.seed % 50), "--pace", "20", "--timeout", str(GIVE_UP),
             "--record", str(bag)],
            stderr=subprocess.PIPE,
            text=True,
        )  # fmt: skip

    def strike(self):
        """Wait for the moment, then do it. Does nothing where the run was over before."""
        started = time.monotonic()
        while self.process.poll() is None:
            pid = self._pid_of_victim()
            if self.case.start_s is None:
                due = recorded(self.bag) >= self.case.bag_size
            else:
                due = time.monotonic() - started >= self.case.start_s
            if due and pid is not None:
                return self._inject(pid)
            time.sleep(0.005)
        return None

    def _inject(self, pid):
        try:
            os.kill(pid, signal.SIGKILL if self.case.fault == "kill" else signal.SIGSTOP)
            if self.case.fault == "pause":
                time.sleep(self.case.pause_s)
                os.kill(pid, signal.SIGCONT)
        except ProcessLookupError:
            pass  # it was just over

    def ended(self):
        """Exit code and what was said on stderr."""
        _, said = self.process.communicate(timeout=LIMIT)
        return self.process.returncode, said

    def orphans(self):
        """Processes of the run that outlive it."""
        _, alive = psutil.wait_procs(self._seen, timeout=LIMIT / 4)
        return alive

    def clean_up(self):
        """Leave nothing, however the test ended."""
        self.process.kill()
        for process in self._seen:
            if process.is_running():
                process.kill()

    def _pid_of_victim(self):
        try:
            runner = psutil.Process(self.process.pid)
            children = runner.children(recursive=True)
            self._seen |= set(children)
            if self.case.victim == RUNNER:
                return runner.pid if len(children) >= len(NODES) else None
            named = [child.pid for child in children if child.name() == self.case.victim]
        except psutil.Error:
            return None
        return named[0] if named else None


def recorded(bag):
    """Bytes of messages so far."""
    return sum(file.stat().st_size for file in bag.glob("*.mcap")) if bag.exists() else 0
