# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a method is: where it learns, with which settings, and by which learner."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from slap_ros.policies.mlp_policy import MlpPolicy

if TYPE_CHECKING:
    from slap_ros.baselines.training_envs import MakeEnv, TrainingEnvs


CHECKPOINT = "checkpoint.pt"  # file of a learner's state, in its work folder


@dataclass(frozen=True)
class BaselineProgress:
    """Figures of a training so far.

    Args:
        steps: Environment steps.
        episodes: Episodes that ended.
        success: Share of the last hundred episodes that reached their goal.
        cpu_s: Processor time, s.
        total_steps: Environment steps of the whole training.
        figures: Figures that only this method has, by name.
    """

    steps: int = 0
    episodes: int = 0
    success: float = 0.0
    cpu_s: float = 0.0
    total_steps: int = 0
    figures: Mapping[str, float] = field(default_factory=dict)

    def as_json(self) -> dict[str, float]:
        """The figures by name."""
        return {
            "steps": self.steps,
            "episodes": self.episodes,
            "success": self.success,
            **self.figures,
            "cpu_s": round(self.cpu_s, 1),
        }


Report = Callable[[BaselineProgress], None]


class TaskLearner(Protocol):
    """A learner of whole tasks."""

    @property
    def progress(self) -> BaselineProgress:
        """The figures so far."""
        ...

    def learn(self, report: Report) -> None:
        """Learn until the environment steps are used up.

        Args:
            report: Function that is called about a hundred times, and in the end.
        """
        ...

    def policy(self) -> MlpPolicy:
        """The policy as it is now, without torch."""
        ...

    def save(self, folder: Path) -> None:
        """Write a checkpoint into a folder; one that is there stays whole until the new one is."""
        ...

    def resume(self, folder: Path) -> None:
        """Continue from the checkpoint in a folder. Episodes begin again.

        Raises:
            InvalidParameterError: It is damaged.
        """
        ...


class MethodSettings(Protocol):
    """Settings that every method has."""

    @property
    def n_envs(self) -> int:
        """Number of environments."""
        ...

    @property
    def total_steps(self) -> int:
        """Environment steps of the whole training."""
        ...

    @property
    def validation(self) -> int:
        """Number of tasks on which it is decided whether the policy acts with its noise."""
        ...


MakeLearner = Callable[[Any, "TrainingEnvs", int], TaskLearner]
MakeEnvs = Callable[["MakeEnv", int, int], "TrainingEnvs"]  # of a seed, and how many


@dataclass(frozen=True)
class Method:
    """A way to learn whole tasks.

    Args:
        environment: Arguments of the environment that it learns on, beside domain and preset.
        settings: Settings by name: ``ours``, and ``paper`` as SLAP has them.
        make_learner: Function that makes a learner of settings, environments and a seed.
        make_envs: Function that makes the environments of a training.
        noisy: Whether its policy may also be run with its noise; else only the most likely actions
            are taken.
    """

    environment: Mapping[str, str]
    settings: Mapping[str, MethodSettings]
    make_learner: MakeLearner
    make_envs: MakeEnvs
    noisy: bool = True
