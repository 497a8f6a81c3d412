# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Makes the library in ``shortcuts/data/obstacle2d``.

``cd test && python -m support.make_library`` runs it.

It has one shortcut: with a block in the hand, push the obstacle off the target area.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slap_ros.domains import get_domain
from slap_ros.learning.task_distribution import TRAINING_SEED
from slap_ros.planning.problem import Problem
from slap_ros.relational import Target
from slap_ros.shortcuts.normalised_vec_env import normalisation_of
from slap_ros.shortcuts.ppo import Learner
from slap_ros.shortcuts.ppo_settings import PpoSettings
from slap_ros.shortcuts.progress import Progress
from slap_ros.shortcuts.rewards import Rewards
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary, save_library
from slap_ros.shortcuts.shortcut_vec_env import ShortcutVecEnv
from slap_ros.shortcuts.signature import Change, Signature
from slap_ros.shortcuts.starts import Start

DATA = Path(__file__).parents[1] / "shortcuts" / "data" / "obstacle2d"
DOMAIN = get_domain("obstacle2d")
TASKS, STEPS, HORIZON = 200, 40_000, 30


def start(index: int) -> Start | None:
    """With block1 in the hand; None where the obstacle lies wholly in the target area."""
    state = DOMAIN.task(TRAINING_SEED, index).initial_state
    problem = Problem.of(DOMAIN, state)
    space = problem.model.space
    pick = {str(ground): (ground, option) for ground, option in problem.operators}
    ground, option = pick["Pick(robot, block1, table)"]
    holding = ground.apply(space.abstract(state))
    added = space.mask([space.atom("Clear", ["target"]), space.atom("On", ["block2", "table"])])
    deleted = space.mask([space.atom("Overlap", ["block2", "target"])])
    inside = space.mask([space.atom("On", ["block2", "target"])])
    picked = problem.model.roll_out(option, state, Target.exactly(holding))
    if not picked.reached or holding & inside:
        return None
    return Start(picked.final, space, Change(added, deleted))


def main() -> None:
    starts = [found for index in range(TASKS) if (found := start(index)) is not None]
    signature = Signature.of(starts[0].change, starts[0].space, frozenset({"Holding"}))
    rng, settings = np.random.default_rng(0), PpoSettings(total_steps=STEPS)
    env = ShortcutVecEnv(DOMAIN, signature, starts, settings.n_envs, HORIZON, Rewards(), rng)
    learner = Learner(env, normalisation_of(env, rng, 64), settings, seed=0)
    last = Progress(0, 0, 0.0, 0.0, 0.0, HORIZON)

    def report(progress: Progress) -> bool:
        nonlocal last
        last = progress
        return True

    learner.learn(report)
    record = {"steps": last.steps, "success": last.success, "length": round(last.length, 2)}
    shortcut = Shortcut(signature, learner.policy(), shortest=1, record=record)
    save_library(DATA, ShortcutLibrary(DOMAIN.name, (shortcut,), {"made_by": "make_library.py"}))
    print(len(starts), shortcut.name, record)  # noqa: T201


if __name__ == "__main__":
    main()
