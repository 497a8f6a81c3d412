# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Acquiring skills again whose operators or rewards a model has changed after they failed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from slap_ros.acquisition.proposals.attempt_log import AttemptLog, Entry
from slap_ros.acquisition.proposals.proposal import Proposal, read_proposal
from slap_ros.acquisition.proposals.proposal_request import ProposalRequest
from slap_ros.acquisition.proposals.revision import Reviser
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.api.acquisition_request import AcquisitionRequest
from slap_ros.api.left_out import Tell
from slap_ros.core.goals import task_with_goal
from slap_ros.errors import ProposalRejectedError
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.skills.skill_library import AcquiredSkill, SkillLibrary, save_skill_library

MAX_REVISIONS = 3

# Learns the skills of a proposal in a folder, given settings and the skills that are there.
Learn = Callable[[Proposal, Path, AcquisitionSettings, Mapping[str, AcquiredSkill]], SkillLibrary]


@dataclass(frozen=True)
class Revisions:
    """Rounds of asking and learning again, until nothing is given up or no budget is left.

    Args:
        request: Request: what to acquire, and how.
        settings: All hyper-parameters of the curriculum.
        least: Environment steps until a skill is judged first.
        learn: Function that learns skills.
        on_attempt: Function that receives every answer of a model.
        tell: Function that receives what went wrong with a revision.
    """

    request: AcquisitionRequest
    settings: AcquisitionSettings
    least: int
    learn: Learn
    on_attempt: Callable[[Entry], None]
    tell: Tell

    def carry_out(self, proposal: Proposal, library: SkillLibrary) -> SkillLibrary:
        """Revise what was given up, at most :data:`MAX_REVISIONS` times.

        Args:
            proposal: Proposal that the library was learned from.
            library: Library with a record of what was given up.

        Returns:
            The library that gets furthest, whose record has all revisions.
        """
        steps, told = library.record["steps"], []
        for number in range(1, MAX_REVISIONS + 1):
            left = self.settings.total_steps - steps
            if not library.record["left"] or left < self.least:
                break
            try:
                changed = self._asked(number, proposal, library.record["left"])
            except ProposalRejectedError as error:
                self.tell(f"nothing more is revised: {error}")
                break
            found = self._learn(number, changed, library, left)
            steps += found.record["steps"]
            told.append(_told(library, proposal, changed, found))
            if _progress(found) >= _progress(library):
                proposal, library = changed, found
        return replace(library, record={**library.record, "steps": steps, "revisions": told})

    def _asked(self, number: int, proposal: Proposal, failures: Mapping[str, Any]) -> Proposal:
        """The proposal that a model has changed; that of the work folder where there is one."""
        request, domain = self.request, self.request.domain

        def revise() -> dict[str, Any]:
            task = task_with_goal(domain, request.seed, 0, request.goal_or_first)
            asked = ProposalRequest.of_task(
                domain, task, request.proposers.proposer, request.rewarder
            )
            path = request.work_folder / f"revision-{number}.jsonl"
            proposers = replace(
                request.proposers, cassette=_numbered(request.proposers.cassette, number)
            )
            inquiry = proposers.inquiry(asked, AttemptLog(path, self.on_attempt))
            assert inquiry is not None  # as the request says
            return Reviser(asked, inquiry).revise(proposal, failures).to_data()

        folder = WorkFolder(request.work_folder)
        return folder.cached(f"revision-{number}", revise, lambda data: read_proposal(data, domain))

    def _learn(
        self, number: int, proposal: Proposal, library: SkillLibrary, steps: int
    ) -> SkillLibrary:
        """Learn what was given up; the other skills are there."""
        folder = self.request.work_folder / f"revision-{number}"
        left = library.record["left"]
        good = tuple(skill for skill in library.skills if skill.operator.name not in left)
        save_skill_library(folder / "kept", replace(library, skills=good))
        kept = {str(folder / "kept" / skill.folder_name): skill for skill in good}
        return self.learn(proposal, folder, replace(self.settings, total_steps=steps), kept)


def _told(
    library: SkillLibrary, before: Proposal, after: Proposal, found: SkillLibrary
) -> dict[str, Any]:
    """What a record says of a revision."""
    operators = {operator.name: operator for operator in before.operators}
    return {
        "left": library.record["left"],
        "operators": [op.name for op in after.operators if op != operators[op.name]],
        "rewards": {
            name: [str(before.rewards[name]), str(after.rewards[name])]
            for name in library.record["left"]
        },
        "steps": found.record["steps"],
        "progress_on_fresh_tasks": _progress(found),
    }


def _progress(library: SkillLibrary) -> float:
    return float(library.record["progress_on_fresh_tasks"])


def _numbered(cassette: str, number: int) -> str:
    """The cassette of a revision: recordings are never added to, so each has one of its own."""
    mode, separator, name = cassette.partition(":")
    if not separator:
        return cassette
    path = Path(name)
    return f"{mode}:{path.with_stem(f'{path.stem}-revision-{number}')}"
