# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""SAC of whole tasks that begin near their end at first, LG-SAIL's curriculum. Needs torch.

The learner, its settings, observations and reward are those of ``sac.py``; only where episodes
begin differs (LG-SAIL §5, Fig. 4): see ``reverse_curriculum.py``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from slap_ros.baselines import sac
from slap_ros.baselines.method import Method
from slap_ros.baselines.reverse_curriculum import (
    CurriculumTasks,
    ReverseCurriculum,
    demonstrated_tasks,
)
from slap_ros.baselines.sac import StagedSacLearner, StagedSacSettings
from slap_ros.baselines.training_envs import MakeEnv, TrainingEnvs, stepped_apart
from slap_ros.baselines.training_tasks import TrainingTally


def curriculum_envs(make_env: MakeEnv, seed: int, count: int) -> TrainingEnvs:
    """Environments whose tasks begin where one curriculum lets them.

    Args:
        make_env: Function that makes an environment.
        seed: Seed of the training tasks.
        count: Number of environments.

    Returns:
        The environments, whose episodes have not begun.

    Raises:
        UnsolvableError: Too few tasks could be demonstrated.
    """
    envs, tally = [make_env() for _ in range(count)], TrainingTally()
    curriculum = ReverseCurriculum(demonstrated_tasks(envs[0], seed, count), tally)
    streams = [CurriculumTasks(env, seed, number, curriculum) for number, env in enumerate(envs)]
    return stepped_apart(envs, streams, tally)


class CurriculumSacLearner(StagedSacLearner):
    """SAC of whole tasks, which goes on from where starts had moved to."""

    def __init__(self, settings: StagedSacSettings, envs: TrainingEnvs, seed: int) -> None:
        """Begin with random weights, no transitions, and episodes near the end of tasks.

        Args:
            settings: Hyper-parameters.
            envs: Environments that :func:`curriculum_envs` made.
            seed: Seed of weights and noise.
        """
        first = envs.streams[0]
        assert isinstance(first, CurriculumTasks)
        self._curriculum = first.curriculum
        super().__init__(settings, envs, seed)

    def figures(self) -> Mapping[str, float]:
        """Share of the way from which episodes begin; above 1 once they are whole tasks."""
        return {"reach": self._curriculum.reach}

    def state(self) -> dict[str, Any]:
        """See :class:`~slap_ros.baselines.budgeted_learner.BudgetedLearner`."""
        return super().state() | {"reach": self._curriculum.reach}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """See :class:`~slap_ros.baselines.budgeted_learner.BudgetedLearner`."""
        self._curriculum.reach = float(saved["reach"])
        super().restore(saved)


METHOD = Method(
    sac.METHOD.environment,
    sac.METHOD.settings,
    CurriculumSacLearner,
    curriculum_envs,
    noisy=False,
)
