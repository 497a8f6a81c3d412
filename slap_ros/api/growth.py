# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is to grow, and what each round of growing has brought."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from slap_ros.acquisition.curriculum.jobs import horizon_of
from slap_ros.acquisition.proposals.proposer_names import MANUAL
from slap_ros.api.acquisition_request import AcquisitionRequest, shareable
from slap_ros.api.command_line import command_line
from slap_ros.api.proposers import Proposers
from slap_ros.api.training import chosen_settings
from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.grown_libraries import GrownLibraries
from slap_ros.shortcuts.exploration_steps import usual_steps
from slap_ros.shortcuts.named_settings import NEAR
from slap_ros.shortcuts.settings import TrainingSettings

STEPS = 1_000_000
USUAL_SHARE = 0.5  # of the steps of a learned skill until it has failed, that it usually takes


@dataclass(frozen=True)
class TriedShortcut:
    """A shortcut that was learned in a round, and tried on validation tasks.

    Args:
        name: Name of the shortcut.
        before: Mean plan length without the shortcut, environment steps.
        after: Mean plan length with the shortcut, environment steps; None where a task was not
            solved.
        kept: Whether the shortcut became part of the library.
        approaches: Number of demonstrations that begin with each approach, by its name; nothing
            for a shortcut that was not cloned from any, or not kept.
    """

    name: str
    before: float
    after: float | None
    kept: bool
    approaches: Mapping[str, int] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """A JSON object, without approaches where there are none."""
        data = asdict(self)
        return data if self.approaches else {k: v for k, v in data.items() if k != "approaches"}


@dataclass(frozen=True)
class GrowthRound:
    """What a round has brought.

    Args:
        skills: Names of the skills.
        skills_digest: Digest of the library of skills.
        progress: Task progress of the skills on tasks that training never saw.
        ended: Reason why the acquisition of skills was over, in words.
        length_alone: Mean plan length with skills alone, environment steps.
        length: Mean plan length with shortcuts, environment steps.
        tried: Shortcuts that were learned, in order.
        skill_steps: Environment steps that learning skills took.
        shortcut_steps: Environment steps that exploring took, and learning all shortcuts that were
            tried.
        unsolved: Number of validation tasks without a plan, over which lengths are no means.
    """

    skills: tuple[str, ...]
    skills_digest: str
    progress: float
    ended: str
    length_alone: float
    length: float
    tried: tuple[TriedShortcut, ...]
    skill_steps: int
    shortcut_steps: int
    unsolved: int = 0

    @property
    def rank(self) -> tuple[int, float]:
        """Less for a better round: tasks that have a plan come first, then short plans.

        Skills that solve one more task may well have longer plans in the mean.
        """
        return self.unsolved, self.length

    @property
    def steps(self) -> int:
        """Environment steps of the round."""
        return self.skill_steps + self.shortcut_steps

    def as_json(self) -> dict[str, Any]:
        """A JSON object."""
        return {**asdict(self), "tried": [one.as_json() for one in self.tried]}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> GrowthRound:
        """The round of :meth:`as_json`.

        Raises:
            LookupError, TypeError: The data is no round.
        """
        tried = tuple(TriedShortcut(**one) for one in data["tried"])
        return cls(**{**data, "skills": tuple(data["skills"]), "tried": tried})


@dataclass(frozen=True)
class GrowthRequest:
    """What is to grow, how, and where it is kept.

    Args:
        domain: Domain to acquire skills and shortcuts in.
        folder: Folder of all results.
        proposers: Proposer of the operators, with its sources, model and budget.
        goal: Name of a goal, or atoms; None for the domain's first goal.
        seed: Seed of all random numbers.
        rewarder: Name of the rewarder: manual, composed or language.
        begin_with: Libraries whose skills new ones may begin with.
        keep: Library of skills that are there in the first round.
        skill_settings: Name of the hyper-parameters of skills.
        skill_changes: Settings of skills to change, as texts.
        shortcut_settings: Name of the hyper-parameters of shortcuts.
        shortcut_changes: Settings of shortcuts to change, as texts.
        steps: Environment steps of learning skills, of exploring and of learning shortcuts, all
            rounds together.

    Raises:
        InvalidParameterError: They do not fit together, or the steps are too few for a round.
    """

    domain: Domain
    folder: Path
    proposers: Proposers = field(default_factory=Proposers)
    goal: str | None = None
    seed: int = 0
    rewarder: str = MANUAL
    begin_with: Sequence[Path] = ()
    keep: Path | None = None
    skill_settings: str = "small"
    skill_changes: Sequence[str] = ()
    shortcut_settings: str = NEAR
    shortcut_changes: Sequence[str] = ()
    steps: int = STEPS

    def __post_init__(self) -> None:
        if self.steps < self.least_steps:
            training = self.training
            cloned = training.cloning is not None
            raise InvalidParameterError(
                f"{self.steps} environment steps are too few for a round: skills take at least "
                f"{self.least_skill_steps}, rollouts of exploration usually take "
                f"{self.exploration_steps}, and a shortcut {'usually ' if cloned else ''}takes "
                f"{training.steps_per_shortcut}; give --steps {self.least_steps} or more"
            )

    @property
    def training(self) -> TrainingSettings:
        """Hyper-parameters of shortcuts."""
        return chosen_settings(self.domain, self.shortcut_settings, self.shortcut_changes, None)

    @property
    def least_skill_steps(self) -> int:
        """Environment steps until a skill is judged first."""
        settings = self.acquisition(0, self.steps).chosen_settings()
        return settings.segment_steps(horizon_of(self.domain))

    @property
    def least_steps(self) -> int:
        """Environment steps of a round at least: a skill is judged, and a shortcut is learned."""
        return self.least_skill_steps + self.least_shortcut_steps

    @property
    def least_shortcut_steps(self) -> int:
        """Environment steps until a shortcut is learned, exploration included."""
        return self.exploration_steps + self.training.steps_per_shortcut

    @property
    def exploration_steps(self) -> int:
        """Environment steps that are kept for exploration, which may take no more if need be."""
        skill_steps = round(USUAL_SHARE * horizon_of(self.domain))
        return usual_steps(self.domain, self.training.exploration, skill_steps)

    def most_skill_steps(self, left: int) -> int:
        """Environment steps that skills may take in a round, which leave some for a shortcut.

        Args:
            left: Environment steps that are left.
        """
        of_settings = replace(self.acquisition(0, self.steps), steps=None).chosen_settings()
        return min(of_settings.total_steps, left - self.least_shortcut_steps)

    def affordable_changes(self, left: int) -> list[str]:
        """The changes of settings of shortcuts, so that no more are learned than can be paid.

        And no more is explored than leaves enough for a shortcut.

        Args:
            left: Environment steps that are left.
        """
        training, budgets = self.training, ("budget=", "exploration.budget=")
        most = _no_more(left, training.budget)
        exploration = training.exploration
        spare = most - training.steps_per_shortcut
        each = _no_more(spare // exploration.tasks, exploration.budget)
        others = [text for text in self.shortcut_changes if not text.startswith(budgets)]
        return [*others, f"budget={most}", f"exploration.budget={each}"]

    def round_folder(self, number: int) -> Path:
        """The folder of a round.

        Args:
            number: Number of the round, from 0.
        """
        return self.folder / f"round{number + 1}"

    def acquisition(self, number: int, steps: int) -> AcquisitionRequest:
        """What skills are acquired in a round: those that fail after shortcuts, from the second on.

        Args:
            number: Number of the round, from 0.
            steps: Environment steps for skills at most.
        """
        here = self.round_folder(number)
        first = AcquisitionRequest(
            domain=self.domain,
            library_folder=GrownLibraries(here).skills,
            work_folder=here / "skills-training",
            proposers=self.proposers,
            goal=self.goal,
            seed=self.seed,
            rewarder=self.rewarder,
            settings=self.skill_settings,
            changes=self.skill_changes,
            steps=steps,
            begin_with=self.begin_with,
            keep=self.keep,
        )
        if not number:
            return first
        before = GrownLibraries(self.round_folder(number - 1))
        return replace(
            first,
            begin_with=(),
            keep=before.skills,
            shortcuts=before.shortcuts,
            proposal_of=self.round_folder(0) / "skills-training",
        )

    @property
    def command(self) -> str:
        """The command that grows the same again."""
        return command_line(
            "grow",
            self.domain.name,
            preset=self.domain.preset,
            goal=self.goal,
            seed=self.seed,
            **self.proposers.given,
            rewarder=self.rewarder,
            **{"from": [shareable(folder) for folder in self.begin_with]},
            keep=shareable(self.keep) if self.keep else None,
            skill_settings=self.skill_settings,
            set_skills=list(self.skill_changes) or None,
            settings=self.shortcut_settings,
            set=list(self.shortcut_changes) or None,
            steps=self.steps,
        )

    def why_over(self, rounds: Sequence[GrowthRound]) -> str:
        """Why nothing grows any more, in words; empty where there is another round.

        Args:
            rounds: Rounds so far.
        """
        if not rounds:
            return ""
        *before, last = rounds
        if before and last.skills_digest == before[-1].skills_digest:
            return "no skill learns from where shortcuts have led"
        if before and last.rank >= before[-1].rank:
            return "plans get no shorter"
        if self.steps - sum(one.steps for one in rounds) < self.least_steps:
            return "the budget is spent"
        if not any(one.kept for one in last.tried):
            return "no shortcut makes plans shorter"
        return ""


def _no_more(left: int, given: int) -> int:
    """A budget of what is left, or what was given if that is less; 0 would be no limit.

    Args:
        left: Environment steps that are left.
        given: Environment steps that were given; 0 for no limit.
    """
    return max(1, min(left, given) if given else left)
