# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Acquires the skills of `points` twice: once undisturbed, once killed again and again.

Run as a program, with a folder, so that processes can be forked in which torch is imported and has
not computed yet. The kernel kills a process once it has used a drawn amount of processor time, in
whatever it is doing then: SIGPROF, which nobody handles. So the load of the machine plays no part.
"""

import os
import signal
import sys
from pathlib import Path

import numpy as np
import torch._dynamo  # noqa: F401, which the first optimiser imports, in a second

from slap_ros.acquisition.curriculum.curriculum import Curriculum
from slap_ros.acquisition.curriculum.task_source import TaskSource
from slap_ros.acquisition.training import sac  # noqa: F401, imported once for all processes
from slap_ros.acquisition.training.sac_settings import SacSettings
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.learning.workers import SequentialWorkers
from slap_ros.skills.skill_library import save_skill_library
from support.points import POINTS, REWARDS

KILLS = 5
SHARE = 1 / 4  # of an undisturbed training's processor time: a process has half of it, on average
SETTINGS = AcquisitionSettings(
    SacSettings(
        net_arch=(32, 32),
        batch_size=64,
        learning_rate=2e-3,
        gamma=0.9,
        tau=0.02,
        learning_starts=192,
    ),
    rollouts=3,
    validation=3,
    segment_episodes=2,
    skill_steps=1_200,
    total_steps=3_600,
)


class Nobody:
    """Is told of everything, and does nothing."""

    def __getattr__(self, _):
        return lambda *_: None


def acquire(folder):
    source = TaskSource.of(POINTS, "train", 1, POINTS.acquisition.operators, REWARDS)
    curriculum = Curriculum(source, SETTINGS, folder / "work", SequentialWorkers(), Nobody())
    save_skill_library(folder / "library", curriculum.run())


def in_a_process(folder, limit_s=0.0):
    """Acquire in a process that is killed after so much processor time, if there is a limit.

    Returns:
        Whether it came to its end, and the processor time that it took, s.
    """
    process = os.fork()
    if not process:
        signal.setitimer(signal.ITIMER_PROF, limit_s)
        acquire(folder)
        os._exit(0)
    _, status, used = os.wait4(process, 0)
    if os.WIFEXITED(status) and os.WEXITSTATUS(status):
        raise SystemExit(f"failed with status {os.WEXITSTATUS(status)}")
    return os.WIFEXITED(status), used.ru_utime + used.ru_stime


def main(folder):
    _, whole_s = in_a_process(folder / "undisturbed")
    rng, number = np.random.default_rng(3), 0
    for _ in range(KILLS):
        while in_a_process(folder / f"killed{number}", rng.uniform(0.0, SHARE * whole_s))[0]:
            number += 1  # through before the last kill: another training
        with (folder / "kills").open("a") as kills:
            kills.write(f"{sorted(p.stem for p in (folder / f'killed{number}').rglob('*.pt'))}\n")
    in_a_process(folder / f"killed{number}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
