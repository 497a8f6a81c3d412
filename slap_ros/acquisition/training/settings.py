# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every hyper-parameter of acquiring skills, by name. Budgets are environment steps, never time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from slap_ros.acquisition.training.sac_settings import SAC_PRESETS, SacSettings
from slap_ros.acquisition.training.warm_start_settings import WarmStartSettings
from slap_ros.errors import InvalidParameterError


@dataclass(frozen=True)
class AcquisitionSettings:
    """All hyper-parameters of a curriculum.

    Args:
        sac: Settings of SAC, with which skills are learned.
        dense_share: Factor of the weighted metrics in the reward. The paper's weights pay .8 or .9
            for being near and 1 for success: so small a margin is learned late, if at all.
        rollouts: Number of tasks that the plan is carried out in, new ones in each iteration.
        validation: Number of tasks that an iteration judges skills on, others in each; training
            never sees them.
        judged: Number of states at most, from these tasks, that a checkpoint is judged from.
        segment_episodes: Number of episodes in each environment between two judgements.
        skill_steps: Environment steps that a skill learns for in one iteration.
        total_steps: Environment steps that all skills together learn for, at most.
        enough: Success rate from which on a checkpoint is good, as two in a row are to be.
        progress: Task progress from which on a curriculum is over, as two in a row are to be.
        solved: Share of solved tasks from which on a curriculum is over, as three judgements in a
            row are to be. A skill then learns until three judgements in a row are as good as that
            needs. With 1, a curriculum goes on until nothing fails.
        patience: Number of rounds without progress after which a skill is left for others.
        rehearsal: Share of the states learned from that are states in which the skill succeeded
            before.
        least_similarity: Least similarity of a known skill to a new one that begins with its
            weights.
        warm_start: Settings of how a new skill makes use of a known one.
    """

    sac: SacSettings = field(default_factory=SacSettings)
    dense_share: float = 0.3
    rollouts: int = 40
    validation: int = 40
    judged: int = 40
    segment_episodes: int = 5
    skill_steps: int = 24_000
    total_steps: int = 150_000
    enough: float = 0.95
    progress: float = 0.95
    solved: float = 1.0
    patience: int = 2
    rehearsal: float = 0.25
    least_similarity: float = 0.3
    warm_start: WarmStartSettings = field(default_factory=WarmStartSettings)

    def __post_init__(self) -> None:
        for name in ("rollouts", "validation", "judged", "segment_episodes", "patience"):
            if getattr(self, name) < 1:
                raise InvalidParameterError(f"{name} is {getattr(self, name)}; give 1 at least")
        if not 0.0 <= self.dense_share <= 1.0:
            raise InvalidParameterError(
                f"dense_share is {self.dense_share}; give a share from 0 to 1"
            )
        if not 0.0 <= self.rehearsal < 1.0:
            raise InvalidParameterError(f"rehearsal is {self.rehearsal}; give a share below 1")

    def segments(self, horizon: int) -> int:
        """Segments that a skill learns for in one iteration, one at least."""
        return max(1, self.skill_steps // self.segment_steps(horizon))

    def segment_steps(self, horizon: int) -> int:
        """The number of environment steps of a segment."""
        return self.segment_episodes * self.sac.n_envs * horizon

    def require_room(self, horizon: int) -> None:
        """Refuse a replay buffer without room for a segment, whose episodes are added at once.

        Args:
            horizon: Environment steps of an episode.

        Raises:
            InvalidParameterError: It has none.
        """
        steps = self.segment_steps(horizon)
        if self.sac.buffer_size < steps:
            raise InvalidParameterError(
                f"sac.buffer_size is {self.sac.buffer_size}, and a segment has {steps} environment "
                "steps; give as many at least, or fewer segment_episodes"
            )


ACQUISITION_SETTINGS: Mapping[str, AcquisitionSettings] = {
    name: replace(AcquisitionSettings(), sac=sac) for name, sac in SAC_PRESETS.items()
}
