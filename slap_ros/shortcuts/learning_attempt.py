# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An attempt to learn a shortcut, and the jobs of a training that learn, stage after stage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from slap_ros.learning.subproc_vec_env import VecEnvSpec, make_vec_env
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.policies.mlp_policy import ObservationNormalisation
from slap_ros.shortcuts.demonstrations import (
    NOT_REPEATED,
    Demonstrated,
    NoisyRepetitions,
    ShortcutDemonstration,
    demonstrated,
)
from slap_ros.shortcuts.jobs import any_goal, mean_length, plan_length
from slap_ros.shortcuts.progress import (
    Progress,
    ProgressRecorder,
    SavableLearner,
    SnapshotRecorder,
    latest,
)
from slap_ros.shortcuts.settings import TrainingSettings
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.shortcut_env_spec import ShortcutEnvSpec
from slap_ros.shortcuts.shortcut_library import load_shortcut, save_shortcut
from slap_ros.shortcuts.signature import Signature
from slap_ros.shortcuts.starts import StartRecord
from slap_ros.shortcuts.stopping import PlanLengths, validation_record
from slap_ros.shortcuts.work_folder import ShortcutWorkFolder

if TYPE_CHECKING:
    from slap_ros.shortcuts.stage_learner import StageLearner

WARM_UP = 64  # random steps in each environment, from which observations are normalised


class StagedAttempt(Protocol):
    """What is learned from, stage after stage."""

    @property
    def name(self) -> str:
        """What is learned."""
        ...

    @property
    def settings(self) -> TrainingSettings:
        """All hyper-parameters of the training."""
        ...

    @property
    def starts(self) -> Sequence[StartRecord]:
        """Initial states of episodes."""
        ...

    @property
    def seed(self) -> int:
        """Seed of weights and noise."""
        ...

    @property
    def folder(self) -> str:
        """Folder of checkpoints and progress."""
        ...

    @property
    def work(self) -> ShortcutWorkFolder:
        """The folder, which is made where there is none."""
        ...

    def parts(self, stage: int) -> Sequence[VecEnvSpec]:
        """The parts of a stage's environments."""
        ...

    def shown(self) -> Demonstrated | None:
        """Steps of demonstrations to learn from; None where there are none."""
        ...

    def plan_lengths(self, learner: SavableLearner) -> PlanLengths | None:
        """The validations while it is learned; None where no rule asks for them."""
        ...


@dataclass(frozen=True)
class LearningAttempt:
    """One attempt to learn a shortcut, as data that other processes can be sent.

    Args:
        distribution: Distribution of the tasks that the starts are from.
        signature: Signature of the shortcut.
        starts: Initial states of episodes.
        settings: All hyper-parameters of the training.
        folder: Folder of the shortcut, its checkpoints and its progress.
        number: Number of the attempt, counted from 0; each has other initial weights and noise.
        validation: Indices of the validation tasks that have a plan.
        learned: Shortcuts that were learned before, and are used beside this one.
        demonstrations: Demonstrations of the shortcut.
    """

    distribution: TaskDistribution
    signature: Signature
    starts: tuple[StartRecord, ...]
    settings: TrainingSettings
    folder: str
    number: int = 0
    validation: tuple[int, ...] = ()
    learned: tuple[Shortcut, ...] = ()
    demonstrations: tuple[ShortcutDemonstration, ...] = ()

    @property
    def work(self) -> ShortcutWorkFolder:
        """The folder of the attempt, which is made where there is none."""
        return ShortcutWorkFolder(Path(self.folder))

    @property
    def seed(self) -> int:
        """Seed of weights and noise; the first attempt has that of the training."""
        seed = self.distribution.seed
        if not self.number:
            return seed
        return int(np.random.SeedSequence([seed, self.number]).generate_state(1)[0])

    @property
    def name(self) -> str:
        """The name of the shortcut."""
        return self.signature.name

    def recorder(self) -> ProgressRecorder:
        """The recorder of the attempt's progress."""
        return SnapshotRecorder(self.work, self.signature, self.settings.total_steps)

    def shown(self) -> Demonstrated | None:
        """Steps of the demonstrations to learn from; None where there are none."""
        if not self.demonstrations:
            return None
        cloning = self.settings.cloning
        repetitions = NOT_REPEATED
        if cloning is not None and cloning.disturbed:
            repetitions = NoisyRepetitions(cloning.disturbed, cloning.disturbance, self.seed)
        domain = self.distribution.make_domain()
        return demonstrated(domain, self.signature, self.demonstrations, repetitions)

    def plan_lengths(self, learner: SavableLearner) -> PlanLengths | None:
        """The validations while the shortcut is learned; None where no rule asks for them.

        Args:
            learner: Learner, which has the shortcut's policy as it is now.
        """
        settings = self.settings
        if settings.stopping is None:
            return None
        tasks = any_goal(self.distribution, settings.random_goals)

        def plan() -> float:
            now = Shortcut(self.signature, learner.policy(), learner.shortest)
            used = (*self.learned, now)
            return mean_length(
                [plan_length(tasks, i, used, settings.sampling) for i in self.validation]
            )

        return PlanLengths(self.work.plan_lengths, settings.stopping, plan)

    def parts(self, stage: int) -> list[ShortcutEnvSpec]:
        """The parts of a stage's environments, each with a seed of its own."""
        ppo = self.settings.stages[stage]
        again = (self.number,) if self.number else ()
        return [
            ShortcutEnvSpec(
                self.distribution.domain,
                self.signature,
                self.starts,
                ppo.n_envs // ppo.parts,
                self.settings.horizon,
                self.settings.rewards_in(stage),
                (self.distribution.seed, len(self.starts), stage, part, *again),
            )
            for part in range(ppo.parts)
        ]


def learn_first_stage(attempt: LearningAttempt, processes: int) -> Progress:
    """Train a shortcut in the first stage alone; :func:`learn` continues from there.

    Args:
        attempt: Attempt to learn the shortcut.
        processes: Number of processes that may step environments.

    Returns:
        The last figures of the stage.

    Raises:
        ChildProcessError: A process that stepped environments has ended.
        InvalidParameterError: A checkpoint or the progress is damaged.
    """
    learn_stages(attempt, 1, attempt.recorder(), processes)
    return latest(attempt.work)[0]


def learn(attempt: LearningAttempt, processes: int) -> Shortcut:
    """Train a shortcut, stage after stage.

    Begun before, it continues from the last checkpoint; finished before, it is read. The number
    of processes makes no difference to what is learned.

    Args:
        attempt: Attempt to learn the shortcut.
        processes: Number of processes that may step environments.

    Returns:
        The shortcut.

    Raises:
        ChildProcessError: A process that stepped environments has ended.
        InvalidLibraryError: What was finished before is damaged.
        InvalidParameterError: A checkpoint or the progress is damaged.
    """
    work = attempt.work
    if work.finished.exists():
        return load_shortcut(work.shortcut)
    recorder = attempt.recorder()
    learner = learn_stages(attempt, len(attempt.settings.stages), recorder, processes)
    record = recorder.record() | validation_record(work.plan_lengths)
    cloning = attempt.settings.cloning
    horizon = 1 if cloning is None else cloning.horizon
    shortcut = Shortcut(attempt.signature, learner.policy(), learner.shortest, record, horizon)
    save_shortcut(work.shortcut, shortcut)
    work.finished.touch()
    return shortcut


def learn_stages(
    attempt: StagedAttempt, stages: int, recorder: ProgressRecorder, processes: int
) -> StageLearner:
    """Learn some stages, each beginning with the weights of the one before it.

    Args:
        attempt: What is learned from.
        stages: Number of stages.
        recorder: Recorder of the progress.
        processes: Number of processes that may step environments.

    Returns:
        The learner of the last of these stages.
    """
    from slap_ros.shortcuts.normalised_vec_env import normalisation_of  # torch, here alone
    from slap_ros.shortcuts.ppo import Learner
    from slap_ros.shortcuts.stage_learner import make_learner

    work = attempt.work
    rng = np.random.default_rng([attempt.seed, len(attempt.starts)])
    shown = attempt.shown()
    if shown is None:
        normalisation = normalisation_of(attempt.parts(0)[0].make(), rng, WARM_UP)
    else:  # random actions lead elsewhere
        normalisation = ObservationNormalisation.of(shown.observations)
    learner: StageLearner | None = None
    for stage, settings in enumerate(attempt.settings.stages[:stages]):
        with make_vec_env(attempt.parts(stage), processes) as env:
            earlier = learner
            learner = make_learner(env, normalisation, settings, attempt.seed, shown)
            if isinstance(earlier, Learner) and isinstance(learner, Learner):
                learner.initialise_from(earlier)
            if work.checkpoint(stage).exists():
                learner.resume(work.checkpoint(stage))
            _learn_stage(attempt, stage, learner, recorder)
            learner.save(work.checkpoint(stage))
    assert learner is not None  # there is one stage at least
    return learner


def _learn_stage(
    attempt: StagedAttempt, stage: int, learner: StageLearner, recorder: ProgressRecorder
) -> None:
    """Learn until the stage's environment steps are used up, or its rule says that it is over."""
    report = recorder.of(stage, learner)
    lengths = attempt.plan_lengths(learner)
    if lengths is None:
        learner.learn(report, attempt.work.path / "tensorboard")
    elif lengths.go_on(stage, steps=0):  # else an earlier run has ended it

        def validate(progress: Progress) -> bool:
            return report(progress) and lengths.go_on(stage, progress.steps)

        learner.learn(validate, attempt.work.path / "tensorboard")
