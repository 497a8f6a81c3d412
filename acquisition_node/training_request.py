# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A training that the node is asked for, as arguments of ``slap acquire``."""

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
    kept: Path | None = None

    def arguments(self, parameters: AcquisitionParameters) -> list[str]:
        """The arguments of ``slap acquire``, the library's folder last."""
        proposer, rewarder = self.proposer or MANUAL, self.rewarder or MANUAL
        words = [self.domain.name]
        words += ["--preset", self.domain.preset, "--goal", self.goal, "--seed", str(self.seed)]
        words += ["--proposer", proposer, "--rewarder", rewarder]
        words += ["--settings", parameters.settings]
        words += ["--steps", str(min(self.steps or parameters.steps, parameters.steps))]
        words += _each("--set", parameters.changes.split())
        words += _each("--from", parameters.begin_with.split())
        if self.kept is not None:
            words += ["--keep", str(self.kept.absolute())]
        if proposer == INDUCED:
            words += _each("--demonstrations", parameters.demonstrations.split())
        if LANGUAGE in (proposer, rewarder):
            words += _asking(parameters)
        # The same goal goes on where it was, another one has a folder of its own.
        told = " ".join([*words, str(self.domain.configuration.get(DIGEST_KEY, ""))])
        name = f"{self.domain.name}-{sha256(told.strip().encode()).hexdigest()[:8]}"
        output = Path(parameters.output).absolute() / name
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
