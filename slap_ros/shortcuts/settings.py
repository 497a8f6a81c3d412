# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every hyper-parameter of shortcut learning by name; ours, and the paper's (SLAP Table 8)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from slap_ros.errors import InvalidParameterError
from slap_ros.shortcuts.ppo_settings import PpoSettings
from slap_ros.shortcuts.practice import Rewards
from slap_ros.shortcuts.shortcut import DEFAULT, PAPER, Sampling

TRAINING_SEED = 1_000_000  # added to the seed: training never sees the tasks of evaluation


@dataclass(frozen=True)
class Exploration:
    """Collecting states and pruning candidates (SLAP §4.2, B.1).

    Args:
        tasks: How many are explored.
        rollouts: Random rollouts from each recorded state (N_rollout).
        length: Environment steps of each at most (T_rollout).
        hits: A pair of abstract states reached less often is pruned (K_rollout).
        hold: Environment steps for which a random direction is held: 1 jitters on the spot.
        nodes: Abstract states explored in a task, the cheapest to reach first.
    """

    tasks: int = 4
    rollouts: int = 48
    length: int = 60
    hits: int = 1
    hold: int = 8
    nodes: int = 6


LEARN = PpoSettings(total_steps=250_000)
POLISH = PpoSettings(
    rollout_steps=128,
    batch_size=512,
    learning_rate=4e-4,
    gae_lambda=0.95,
    log_std=-1.3,
    total_steps=250_000,
)


@dataclass(frozen=True)
class TrainingSettings:
    """All of it.

    Args:
        exploration: How candidates are found.
        ppo: How they are learned.
        polish: How they are made shorter then, with less noise.
        rewards: From what.
        careful: From what, when they are made shorter: what noise still loses can then be spared.
        horizon: Environment steps of a training episode.
        starts: Initial states, each of another task.
        shortcuts: How many are trained at most, the most promising first.
        least_saving: Part of a plan's length that a candidate must promise, and keep, to stay.
        validation: Tasks on which plan length is watched.
        sampling: How shortcuts are tried out when planning.
    """

    exploration: Exploration = field(default_factory=Exploration)
    ppo: PpoSettings = LEARN
    polish: PpoSettings | None = POLISH
    rewards: Rewards = field(default_factory=Rewards)
    careful: Rewards | None = None
    horizon: int = 100
    starts: int = 300
    shortcuts: int = 4
    least_saving: float = 0.05
    validation: int = 8
    sampling: Sampling = DEFAULT

    @property
    def stages(self) -> tuple[PpoSettings, ...]:
        """What is done one after the other."""
        return (self.ppo,) if self.polish is None else (self.ppo, self.polish)

    def rewards_in(self, stage: int) -> Rewards:
        """From what is learned in a stage, with its discount."""
        rewards = self.rewards if stage == 0 or self.careful is None else self.careful
        return replace(rewards, discount=self.stages[stage].discount)

    @property
    def total_steps(self) -> int:
        """Environment steps that a shortcut is trained for."""
        return sum(stage.total_steps for stage in self.stages)

    def as_record(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)


OURS = TrainingSettings()
_PAPER_PPO = PpoSettings(
    environments=1,
    rollout_steps=100,
    batch_size=16,
    learning_rate=3e-4,
    anneal=False,
    discount=0.99,
    gae_lambda=0.95,
    entropy=0.01,
    log_std=0.0,
)
# The paper says -1 a step; its code adds 100 for success, and 0.5 and 10 in Obstacle 2D.
_PAPER = replace(
    OURS,
    exploration=Exploration(rollouts=100, length=300, hits=5, hold=1, nodes=1000),
    polish=None,
    ppo=replace(_PAPER_PPO, total_steps=300_000),
    rewards=Rewards(step=-1.0, done=100.0, lost=0.0, shaping=0.0, discount=0.99, scale=1.0),
    horizon=100,
    sampling=PAPER,
)
SETTINGS: Mapping[str, Mapping[str, TrainingSettings]] = {
    "ours": {
        "obstacle2d": replace(
            OURS,
            # Its worlds are stepped together, so that many cost little.
            exploration=Exploration(tasks=6, rollouts=6000, length=16, hold=4),
            ppo=PpoSettings(
                environments=128, rollout_steps=32, batch_size=512, total_steps=400_000
            ),
            polish=None,
            horizon=30,
            starts=300,
        ),
        "obstacle_tower": replace(
            OURS,
            ppo=replace(LEARN, environments=32, parts=2, batch_size=512, total_steps=300_000),
            polish=replace(
                POLISH, environments=32, parts=2, batch_size=1024, total_steps=1_500_000
            ),
            careful=Rewards(lost=-30.0),
            horizon=50,
            starts=4000,
            shortcuts=1,  # all that is found is the slap, from the one or the other state
        ),
        "cluttered_drawer": replace(
            OURS,
            polish=replace(POLISH, total_steps=200_000),
            horizon=50,
            starts=600,
        ),
        "cleanup_table": replace(
            OURS,
            # Nodes: everything over which the hand can be, that it can grasp, and lift.
            exploration=Exploration(tasks=3, rollouts=32, length=40, nodes=13),
            ppo=replace(LEARN, total_steps=120_000),
            polish=replace(POLISH, total_steps=200_000),
            horizon=40,
            starts=200,
            shortcuts=2,
        ),
        "": OURS,
    },
    "paper": {
        "obstacle2d": replace(
            _PAPER,
            exploration=Exploration(rollouts=1000, length=100, hits=1, hold=1, nodes=1000),
            ppo=replace(_PAPER_PPO, rollout_steps=50, total_steps=50_000),
            rewards=Rewards(step=-0.5, done=10.0, lost=0.0, shaping=0.0, discount=0.99, scale=1.0),
            horizon=50,
            sampling=replace(PAPER, horizon=50),
        ),
        "": _PAPER,
    },
}


def training_settings(name: str, domain: str) -> TrainingSettings:
    """Settings by name, for a domain.

    Raises:
        InvalidParameterError: There are none of that name.
    """
    if name not in SETTINGS:
        raise InvalidParameterError(f"unknown settings {name!r}; there are {', '.join(SETTINGS)}")
    return SETTINGS[name].get(domain, SETTINGS[name][""])
