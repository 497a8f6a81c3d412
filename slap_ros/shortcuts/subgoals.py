# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One policy for several shortcuts, told by its observation which it is (Abstract Subgoals).

SLAP §5 and Fig. 6 compare it with a policy each. Here it has as many environments and steps for
each shortcut, the same rewards and the same learner. What comes of it is a library like any other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from slap_ros.errors import InvalidParameterError
from slap_ros.learning.success_curve import SUCCESS_CURVE
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.policies.mlp_policy import MlpPolicy
from slap_ros.shortcuts.candidate_groups import CandidateGroup, other_problems
from slap_ros.shortcuts.hindsight_vec_env import HindsightEnvSpec
from slap_ros.shortcuts.learning_attempt import LearningAttempt, learn_stages
from slap_ros.shortcuts.progress import ProgressRecorder, SavableLearner
from slap_ros.shortcuts.settings import TrainingSettings
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.shortcut_env_spec import ShortcutEnvSpec
from slap_ros.shortcuts.shortcut_library import load_shortcut, save_shortcut
from slap_ros.shortcuts.shortcut_record import with_origin
from slap_ros.shortcuts.signature import Signature
from slap_ros.shortcuts.starts import StartRecord
from slap_ros.shortcuts.subgoal_vec_env import SubgoalEnvSpec
from slap_ros.shortcuts.training import Training
from slap_ros.shortcuts.work_folder import ShortcutWorkFolder


@dataclass(frozen=True)
class SubgoalAttempt:
    """The learning of one policy for several shortcuts, as data that processes can be sent.

    Args:
        distribution: Distribution of the tasks that the starts are from.
        signatures: Signature of each shortcut.
        pools: Initial states of each shortcut's episodes.
        own: All hyper-parameters of the training, with the steps of a single shortcut.
        folder: Folder of the policy, its checkpoints and its progress.
    """

    distribution: TaskDistribution
    signatures: tuple[Signature, ...]
    pools: tuple[tuple[StartRecord, ...], ...]
    own: TrainingSettings
    folder: str

    @property
    def name(self) -> str:
        """Names of all shortcuts."""
        return "+".join(signature.name for signature in self.signatures)

    @property
    def settings(self) -> TrainingSettings:
        """The hyper-parameters, with the steps of all shortcuts together."""
        return self.own.with_total_steps(len(self.signatures) * self.own.total_steps)

    @property
    def starts(self) -> tuple[StartRecord, ...]:
        """Initial states of all shortcuts."""
        return tuple(start for pool in self.pools for start in pool)

    @property
    def seed(self) -> int:
        """Seed of weights and noise."""
        return self.distribution.seed

    @property
    def work(self) -> ShortcutWorkFolder:
        """The folder, which is made where there is none."""
        return ShortcutWorkFolder(Path(self.folder))

    def shown(self) -> None:
        """None: there are no demonstrations."""

    def plan_lengths(self, learner: SavableLearner) -> None:
        """None: no rule ends learning early."""
        del learner

    def parts(self, stage: int) -> list[SubgoalEnvSpec]:
        """The parts of a stage's environments, as many for each shortcut as it would have alone."""
        each = [
            LearningAttempt(self.distribution, signature, pool, self.own, self.folder).parts(stage)
            for signature, pool in zip(self.signatures, self.pools, strict=True)
        ]
        sac = self.own.sac
        kind = HindsightEnvSpec if sac is not None and sac.hindsight else SubgoalEnvSpec
        return [kind(part) for part in zip(*each, strict=True)]


def learn_together(attempt: SubgoalAttempt, processes: int) -> list[Shortcut]:
    """Train one policy, stage after stage, and take a policy for each shortcut out of it.

    Begun before, it continues from the last checkpoint; finished before, it is read.

    Args:
        attempt: Learning of the policy.
        processes: Number of processes that may step environments.

    Returns:
        The shortcuts, in the order of the attempt.

    Raises:
        ChildProcessError: A process that stepped environments has ended.
        InvalidLibraryError: What was finished before is damaged.
        InvalidParameterError: A checkpoint or the progress is damaged.
    """
    work = attempt.work
    folders = [work.path / signature.name for signature in attempt.signatures]
    if work.finished.exists():
        return [load_shortcut(folder) for folder in folders]
    recorder = ProgressRecorder(work)
    shared = learn_stages(attempt, len(attempt.settings.stages), recorder, processes).policy()
    (first, *_) = attempt.parts(0)
    observation, axes = first.observation(), first.action_map
    record = recorder.record()
    shortcuts = []
    for part, folder in zip(first.parts, folders, strict=True):
        policy = observation.policy_of(part.signature, shared, axes.places_of(part.action_map))
        shortcuts.append(_tried(part, policy, record, len(folders)))
        save_shortcut(folder, shortcuts[-1])
    work.finished.touch()
    return shortcuts


def _tried(
    part: ShortcutEnvSpec, policy: MlpPolicy, whole: Mapping[str, Any], count: int
) -> Shortcut:
    """A shortcut with the figures of some episodes; of the learning it has an equal share.

    Args:
        part: Environments of the shortcut.
        policy: Policy of the shortcut.
        whole: Record of the learning of all shortcuts.
        count: Number of all shortcuts.
    """
    env, rng = part.make(), np.random.default_rng(part.seed)
    observations, lengths, episodes = env.observations, list[int](), 0
    for _ in range(part.horizon):
        step = env.step(policy.sample(observations, rng).astype(np.float64))
        observations = step.observations
        lengths += [int(length) for length in step.lengths[step.success]]
        episodes += int(step.dones.sum())
    record = {
        "environment_steps": int(whole["environment_steps"]) // count,
        "episodes": episodes,
        "success": len(lengths) / max(episodes, 1),
        "length": float(np.mean(lengths)) if lengths else -1.0,
        "cpu_s": float(whole["cpu_s"]) / count,
        "together": count,
        SUCCESS_CURVE: whole[SUCCESS_CURVE],  # of all of them, over the steps of all of them
    }
    return Shortcut(part.signature, policy, min(lengths, default=part.horizon), record)


class SubgoalTraining(Training):
    """A training in which one policy learns several shortcuts at once."""

    def _require_same_settings(self) -> None:
        """Refuse settings that are about a policy each, and a folder with another training.

        Raises:
            InvalidParameterError: The first stage is to be learned several times, or a rule is to
                end learning; or see :class:`~slap_ros.shortcuts.training.Training`.
        """
        if self.settings.attempts > 1 or self.settings.stopping is not None:
            raise InvalidParameterError(
                "one policy for several shortcuts is learned once, with all of its steps: give "
                "attempts=1 and stopping=none, or together=1 for a policy each"
            )
        super()._require_same_settings()

    def _learn_from(
        self, ranked: Sequence[CandidateGroup], operator_steps: Mapping[str, float], length: float
    ) -> float:
        """Learn the most promising groups together, and keep each that shortens plans."""
        chosen: dict[CandidateGroup, tuple[StartRecord, ...]] = {}
        while len(chosen) < min(self.settings.together, self.settings.shortcuts):
            if not self._affords(len(chosen) + 1):
                break
            group = self._most_promising(ranked, list(chosen))
            if group is None:
                break
            ranked = other_problems(ranked, group)
            if starts := self._steps.starts(group, operator_steps):
                chosen[group] = starts
        if not chosen:
            return length
        attempt = SubgoalAttempt(
            self.distribution,
            tuple(group.signature for group in chosen),
            tuple(chosen.values()),
            self.settings,
            str(self.folder / "together"),
        )
        learned = self._run_attempt(learn_together, attempt)
        self._spent += sum(int(one.record["environment_steps"]) for one in learned)
        for group, shortcut in zip(chosen, learned, strict=True):
            length = self._judge(with_origin(shortcut, group), length)
        return length
