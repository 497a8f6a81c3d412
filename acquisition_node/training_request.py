# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A training that the node is asked for, as arguments of ``slap acquire`` or ``slap grow``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from ensemble.acquisition_parameters import AcquisitionParameters
from slap_ros.acquisition.proposals.proposer_names import INDUCED, LANGUAGE, MANUAL
from slap_ros.core import Domain, Task
from slap_ros.relational import GroundAtom
from slap_ros.skills.domain_choice import DIGEST_KEY


@dataclass(frozen=True)
class TrainingRequest:
    """Which skills to acquire.

    Args:
        domain: Domain whose skills are acquired.
        goal: A name of the domain's, or atoms as PDDL.
        proposer: Name of the proposer of operators; empty for ``manual``.
        rewarder: Name of the proposer of rewards; empty for ``manual``.
        steps: Environment steps; 0: as many as the node allows.
        seed: Seed of all random numbers.
        kept: The library of the skills that the domain has; None where they are no library.
    """

    domain: Domain
    goal: str
    proposer: str
    rewarder: str
    steps: int
    seed: int
    kept: Path | None

    def arguments(self, parameters: AcquisitionParameters) -> list[str]:
        """The arguments of ``slap acquire``, the library's folder last.

        Args:
            parameters: Parameters of the node.
        """
        words = self._task_and_proposers()
        words += ["--settings", parameters.settings]
        words += ["--steps", str(self._steps_within(parameters.steps))]
        words += _each("--set", parameters.changes.split())
        words += self._sources(parameters)
        return self._placed(words, self.domain.name, parameters)

    def growth_arguments(self, parameters: AcquisitionParameters) -> list[str]:
        """The arguments of ``slap grow``, the folder of its results last.

        Args:
            parameters: Parameters of the node.
        """
        words = self._task_and_proposers()
        words += ["--skill-settings", parameters.settings]
        words += _each("--set-skills", parameters.changes.split())
        words += ["--settings", parameters.shortcut_settings]
        words += _each("--set", parameters.shortcut_changes.split())
        words += ["--steps", str(self._steps_within(parameters.growth_steps))]
        words += self._sources(parameters)
        return self._placed(words, f"{self.domain.name}-grown", parameters)

    def _task_and_proposers(self) -> list[str]:
        """What is to be done, and who proposes operators and rewards."""
        words = [self.domain.name]
        words += ["--preset", self.domain.preset, "--goal", self.goal, "--seed", str(self.seed)]
        return [*words, "--proposer", self._proposer, "--rewarder", self._rewarder]

    @property
    def _proposer(self) -> str:
        return self.proposer or MANUAL

    @property
    def _rewarder(self) -> str:
        return self.rewarder or MANUAL

    def _steps_within(self, most: int) -> int:
        """Environment steps that are asked for, within what the node allows.

        Args:
            most: Environment steps that the node allows.
        """
        return min(self.steps or most, most)

    def _sources(self, parameters: AcquisitionParameters) -> list[str]:
        """Libraries to begin with or to keep, demonstrations, and the model to ask.

        Args:
            parameters: Parameters of the node.
        """
        words = _each("--from", parameters.begin_with.split())
        if self.kept is not None:
            words += ["--keep", str(self.kept.absolute())]
        if self._proposer == INDUCED:
            words += _each("--demonstrations", parameters.demonstrations.split())
        if LANGUAGE in (self._proposer, self._rewarder):
            words += _asking(parameters)
        return words

    def _placed(
        self, words: Sequence[str], name: str, parameters: AcquisitionParameters
    ) -> list[str]:
        """The arguments with the folder of the results: the same goal goes on where it was.

        Args:
            words: Arguments, by which another goal has a folder of its own.
            name: Name of the folder, to which a digest of the arguments is added.
            parameters: Parameters of the node.
        """
        told = " ".join([*words, str(self.domain.configuration.get(DIGEST_KEY, ""))])
        folder = f"{name}-{sha256(told.strip().encode()).hexdigest()[:8]}"
        output = Path(parameters.output).absolute() / folder
        return [*words, "--jobs", str(parameters.jobs), "--output", str(output)]


def goal_in_words(domain: Domain, task: Task, goal: frozenset[GroundAtom]) -> str:
    """A goal as ``slap acquire`` takes it: by name where it has one, as it is then each task's own.

    Args:
        domain: The task's.
        task: Where the goal is to be reached.
        goal: Atoms of the goal.
    """
    for name, goal_of in domain.goals.items():
        if goal_of(task.initial_state) == goal:
            return name
    atoms = sorted(
        " ".join((atom.predicate.name, *(obj.name for obj in atom.objects))) for atom in goal
    )
    return f"(and {' '.join(f'({atom})' for atom in atoms)})"


def _each(option: str, values: Sequence[str]) -> list[str]:
    return [word for value in values for word in (option, value)]


def _asking(parameters: AcquisitionParameters) -> list[str]:
    words = ["--cassette", parameters.cassette, "--attempts", str(parameters.attempts)]
    words += ["--tokens", str(parameters.tokens), "--seconds", str(parameters.seconds)]
    for option, value in (
        ("--model", parameters.model),
        ("--base-url", parameters.base_url),
        ("--language-settings", parameters.language_settings),
    ):
        words += [option, value] if value else []
    return words
