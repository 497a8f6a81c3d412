# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The library that a curriculum ends with: skills that were learned, and known ones that stay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from slap_ros.acquisition.curriculum.curriculum_state import CurriculumState
from slap_ros.acquisition.curriculum.curriculum_steps import CurriculumSteps
from slap_ros.acquisition.curriculum.initiation_states import InitiationStates
from slap_ros.acquisition.curriculum.jobs import horizon_of
from slap_ros.acquisition.curriculum.known_or_learned import KnownOrLearned
from slap_ros.acquisition.curriculum.library_record import library_record, skill_record
from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout
from slap_ros.acquisition.curriculum.skills_at_hand import SkillsAtHand
from slap_ros.acquisition.curriculum.task_source import VALIDATION
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.acquisition.training.warm_start import WarmStart
from slap_ros.skills.skill_library import AcquiredSkill, SkillLibrary, load_skill, save_skill


@dataclass(frozen=True)
class FinalLibrary:
    """Judges the skills of a curriculum in the end, and puts them together.

    Args:
        steps: Steps of the curriculum.
        settings: All hyper-parameters of the curriculum.
        at_hand: Folders of the skills.
        kept: Skills that were there before, by operator name.
        begun: Known skills that others began with, by the operator name of these.
        going_on: Names of the operators of kept skills whose earlier trainings go on.
    """

    steps: CurriculumSteps
    settings: AcquisitionSettings
    at_hand: SkillsAtHand
    kept: Mapping[str, AcquiredSkill]
    begun: Mapping[str, WarmStart]
    going_on: frozenset[str]

    def make(
        self, ended: str, iteration: int, state: CurriculumState, settings: Mapping[str, Any]
    ) -> SkillLibrary:
        """Make the library.

        Args:
            ended: Reason why the curriculum is over, in words.
            iteration: Number of the last iteration, from 0.
            state: State of the curriculum in the end.
            settings: All hyper-parameters, as the record of the library has them.

        Returns:
            The library of the skills that were learned, and of those that were kept.
        """
        source, roll_out = self.steps.source, self.steps.roll_out
        unseen = VALIDATION.batch(iteration, self.settings.validation)
        folders = self.at_hand.folders(state)
        fresh = roll_out(iteration, "final", unseen, folders)
        compared = self._compare(fresh, state)
        if known := [name for name, one in compared.items() if one.known_stays]:
            folders |= {name: str(self._known_folder(name)) for name in known}
            fresh = roll_out(iteration, "final_known", unseen, folders)
        learned = [name for name in state.learned if name not in known or name not in self.kept]
        vacuity = self._vacuity(learned, fresh)
        skills = [skill for name, skill in self.kept.items() if name not in learned]
        domain = source.make_domain()
        for name in learned:
            skill = load_skill(Path(folders[name]), domain)
            progress, both = state.skills[name], compared.get(name)
            record = skill_record(progress, vacuity[name], source.seed, both)
            skills.append(replace(skill, record=record))
        ordered = sorted(skills, key=lambda skill: skill.folder_name)
        record = library_record(source, settings, state, ended, fresh)
        return SkillLibrary(source.domain.name, tuple(ordered), record)

    def _compare(
        self, fresh: Sequence[PlanRollout], state: CurriculumState
    ) -> dict[str, KnownOrLearned]:
        """Try known skills and what was learned from them, by operator name.

        Where a skill had to be learned from scratch after a dead end, what counts is not its own
        success.

        Args:
            fresh: Plans on tasks that training never saw, with what was learned.
            state: State of the curriculum in the end.
        """
        names = [n for n in state.learned if n in self.begun and not state.skills[n].attempt]
        if not names:
            return {}
        found = self.steps.compare(
            [
                (
                    self.begun[name],
                    self.at_hand.learned(name, state),
                    InitiationStates.of(name, fresh).all,
                )
                for name in names
            ]
        )
        return dict(zip(names, found, strict=True))

    def _known_folder(self, name: str) -> Path:
        """The folder of a known skill that stays; that of another library is written down."""
        if name in self.at_hand.kept:
            return Path(self.at_hand.kept[name])
        source = self.steps.source
        operator, template = self.at_hand.operators[name], source.rewards()[name]
        policy, horizon = self.begun[name].policy, horizon_of(source.make_domain())
        folder = self.steps.results.known_skill(operator)
        save_skill(folder, AcquiredSkill(operator, template, policy, horizon))
        return folder

    def _vacuity(self, names: Sequence[str], fresh: Sequence[PlanRollout]) -> dict[str, Any]:
        """What policies that see nothing are worth in each skill's place; None where untried.

        That is the operator's, and known already where a training goes on.
        """
        known = {name: self.kept[name].record.get("vacuity") for name in self.going_on}
        starts = {name: InitiationStates.of(name, fresh).all for name in names}
        begun = [name for name in names if starts[name] and name not in known]
        found = self.steps.vacuity([(name, starts[name]) for name in begun], self.settings.judged)
        return dict.fromkeys(names) | known | dict(zip(begun, found, strict=True))
