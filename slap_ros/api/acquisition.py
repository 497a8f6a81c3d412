# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Acquiring a library of skills: operators and rewards are proposed, then skills are trained."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from slap_ros.acquisition.curriculum.curriculum import Curriculum
from slap_ros.acquisition.curriculum.curriculum_callback import CurriculumCallback, OngoingRound
from slap_ros.acquisition.curriculum.dead_ends import DeadEnd
from slap_ros.acquisition.curriculum.jobs import horizon_of
from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout
from slap_ros.acquisition.curriculum.task_source import TaskSource
from slap_ros.acquisition.proposals.attempt_log import AttemptLog, Entry
from slap_ros.acquisition.proposals.proposal import Proposal, read_proposal
from slap_ros.acquisition.proposals.proposal_request import ProposalRequest
from slap_ros.acquisition.training.retrieval import SkillEncoder
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.acquisition.training.skill_training import Round
from slap_ros.api.acquisition_request import AcquisitionRequest
from slap_ros.api.argument_kinds import checks_arguments
from slap_ros.api.jobs import require_torch, some_workers
from slap_ros.api.left_out import Tell, warn_caller
from slap_ros.api.proposers import Proposers
from slap_ros.api.revisions import Revisions
from slap_ros.api.setting_texts import Changes, change_texts
from slap_ros.api.training import training_folder
from slap_ros.core import Domain
from slap_ros.core.goals import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.files import parse_json, read_text, sole_use
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.policies.library_files import SKILL, require_places
from slap_ros.skills.skill_library import (
    AcquiredSkill,
    SkillLibrary,
    load_skill_library,
    read_library_record,
    save_skill_library,
)

PROPOSAL = "proposal"  # result in a work folder: operators and rewards


class UnwatchedCurriculum:
    """Receives the events of a curriculum, and does nothing with them."""

    def on_progress(self, what: str, done: int, total: int) -> None:
        """See :class:`~slap_ros.acquisition.curriculum.curriculum_callback.CurriculumCallback`."""

    def on_rollouts(self, iteration: int, rollouts: Sequence[PlanRollout]) -> None:
        """See :class:`~slap_ros.acquisition.curriculum.curriculum_callback.CurriculumCallback`."""

    def on_dead_end(self, iteration: int, dead_end: DeadEnd) -> None:
        """See :class:`~slap_ros.acquisition.curriculum.curriculum_callback.CurriculumCallback`."""

    def on_learning(self, iteration: int, rounds: Sequence[OngoingRound], steps_left: int) -> None:
        """See :class:`~slap_ros.acquisition.curriculum.curriculum_callback.CurriculumCallback`."""

    def on_judged(self, iteration: int, skill: str, outcome: Round) -> None:
        """See :class:`~slap_ros.acquisition.curriculum.curriculum_callback.CurriculumCallback`."""


@dataclass(frozen=True)
class AcquisitionWatch:
    """Functions that are called while skills are acquired.

    Args:
        on_attempt: Function that receives every answer of a model, and every verdict.
        on_proposal: Function that receives the proposal, once operators and rewards are complete.
        curriculum: Function that opens the callback for events of training, called when training
            begins.
        tell: Function that receives warnings about skills that are left out.
    """

    on_attempt: Callable[[Entry], None] = lambda _: None
    on_proposal: Callable[[Proposal], None] = lambda _: None
    curriculum: Callable[[], AbstractContextManager[CurriculumCallback]] = field(
        default=lambda: nullcontext(UnwatchedCurriculum())
    )
    tell: Tell = warn_caller


@checks_arguments
def acquire(
    domain: Domain,
    folder: Path | str,
    *,
    goal: str | None = None,
    seed: int = 0,
    proposer: str | Proposers = "manual",
    rewarder: str = "manual",
    settings: str = "small",
    changes: Changes = (),
    steps: int | None = None,
    begin_with: Path | str | Sequence[Path | str] = (),
    work: Path | str | None = None,
    jobs: int | None = None,
    watch: AcquisitionWatch = AcquisitionWatch(),
) -> SkillLibrary:
    """Acquire skills: carry out plans, train what fails from where it fails, and again.

    Interrupted, it continues where it was when it is called with the same arguments.

    Args:
        domain: Domain to acquire skills in, as :func:`make` makes it.
        folder: Folder that the library is saved to; :func:`make` takes it as ``skills``.
        goal: Name of a goal, or atoms in PDDL; None for the domain's first.
        seed: Seed of all random numbers.
        proposer: Name of the proposer of operators, as for :func:`propose`.
        rewarder: Name of the rewarder: manual, composed or language.
        settings: Name of the hyper-parameters of networks and SAC.
        changes: Settings to change, by dotted name; or texts as on the command line.
        steps: Environment steps for all skills together; None for those of the settings.
        begin_with: Folder of a skill library that new skills may begin with, or several.
        work: Folder for checkpoints; None for one beside the library's folder.
        jobs: Number of processes; None for this one. A script that uses processes needs
            ``if __name__ == "__main__"``.
        watch: Functions that are called while skills are acquired.

    Returns:
        The library; its record says how far plans get with it.

    Raises:
        InvalidParameterError: The domain does not say what skills are acquired with, torch is not
            installed, something cannot be what it is to be, or the folder has something that is
            no library.
        ProposalRejectedError: No operators passed the checks.
        BusyError: Another process trains in the same folder.
    """
    request = AcquisitionRequest(
        domain=acquirable(domain.name, domain.preset),
        library_folder=Path(folder),
        work_folder=training_folder(folder, work),
        proposers=Proposers.of(proposer),
        goal=goal,
        seed=seed,
        rewarder=rewarder,
        settings=settings,
        changes=change_texts(changes),
        steps=steps,
        begin_with=_folders(begin_with),
    )
    return carry_out(request, jobs, watch=watch)


def _folders(given: Path | str | Sequence[Path | str]) -> list[Path]:
    return [Path(given)] if isinstance(given, Path | str) else [Path(path) for path in given]


def acquirable(name: str, preset: str | None) -> Domain:
    """The domain in which skills are acquired.

    Raises:
        InvalidParameterError: It says nothing of acquisition.
    """
    domain = get_domain(name, preset)
    if domain.acquisition is None:
        raise InvalidParameterError(
            f"domain {domain.name} does not say what skills are acquired with; those that do have "
            "goals in the table of `slap domains`"
        )
    return domain


def carry_out(
    request: AcquisitionRequest,
    jobs: int | None = None,
    ray: str | None = None,
    watch: AcquisitionWatch = AcquisitionWatch(),
) -> SkillLibrary:
    """Acquire what is requested, and save it; see :func:`acquire`.

    Args:
        request: Request: what to acquire, and how.
        jobs: Number of processes; None for this one.
        ray: Address of a Ray cluster to run on instead.
        watch: Functions that are called while skills are acquired.

    Returns:
        The library.
    """
    settings = request.chosen_settings()
    least = settings.segment_steps(horizon_of(request.domain))
    require_budget(settings, least)
    encoder = request.skill_encoder()
    known = known_skills(request.begin_with, watch.tell)
    there = _library_to_keep(request.keep, request.domain)
    shortcuts = request.shortcuts_over_kept()
    require_places(request.library_folder, request.work_folder, SKILL)
    require_torch()
    with sole_use(request.work_folder):
        proposed = _proposed(request, watch)
        proposal = proposed.proposal
        watch.on_proposal(proposal)
        kept = _kept(request.keep, there, proposal, watch.tell)
        with some_workers(jobs, ray) as workers, watch.curriculum() as callback:

            def learn(
                proposal: Proposal,
                folder: Path,
                settings: AcquisitionSettings,
                kept: Mapping[str, AcquiredSkill],
            ) -> SkillLibrary:
                return Curriculum(
                    _source(request, proposal),
                    settings,
                    folder,
                    workers,
                    callback,
                    known,
                    encoder,
                    dict(kept),
                    shortcuts,
                    request.continued,
                ).run()

            library = learn(proposal, request.work_folder, settings, kept)
            if request.revise:
                revisions = Revisions(request, settings, least, learn, watch.on_attempt, watch.tell)
                library = revisions.carry_out(proposal, library)
    library = replace(library, record={**_made_by(request, proposed, encoder), **library.record})
    save_skill_library(request.library_folder, library)
    return library


def _source(request: AcquisitionRequest, proposal: Proposal) -> TaskSource:
    """The tasks to learn from, and what to learn in them."""
    return TaskSource.of(
        request.domain,
        request.goal_or_first,
        request.seed,
        proposal.operators,
        proposal.rewards,
    )


@dataclass(frozen=True)
class _Proposed:
    """A proposal, and who answered where a model was to be asked."""

    proposal: Proposal
    answered_by: dict[str, Any]

    def as_record(self) -> dict[str, Any]:
        """What a library says of it."""
        made = self.proposal.provenance
        record = {
            "proposer": made.proposer,
            "rewarder": made.rewarder,
            "provenance": asdict(made),
            "remarks": list(self.proposal.remarks),
        }
        return {**record, "answered_by": self.answered_by} if self.answered_by else record


def _made_by(
    request: AcquisitionRequest, proposed: _Proposed, encoder: SkillEncoder
) -> dict[str, Any]:
    """How a library was made, as its record says it."""
    return {
        "command": request.command,
        **proposed.as_record(),
        "began_with": [path.name for path in request.begin_with],
        **({"encoder": encoder.name} if request.encoder else {}),
        **({"kept": request.keep.name} if request.keep else {}),
        **({"shortcuts": request.shortcuts.name} if request.shortcuts else {}),
    }


def _proposed(request: AcquisitionRequest, watch: AcquisitionWatch) -> _Proposed:
    """Operators and rewards, checked; those of the work folder where it has some already.

    A model would give others when it is asked again.

    Args:
        request: Request: what to acquire.
        watch: Functions that are called; one of them receives every answer.

    Raises:
        InvalidParameterError: The work folder has another training, or is damaged.
        ProposalRejectedError: The operators make no plan.
    """
    work, domain = WorkFolder(request.work_folder), request.domain

    def propose() -> dict[str, Any]:
        if request.proposal_of is not None:
            earlier = parse_json(read_text(request.proposal_of / f"{PROPOSAL}.json"))
            return {**earlier, "command": request.command}
        proposers = request.proposers
        task = task_with_goal(domain, request.seed, 0, request.goal_or_first)
        shown = proposers.demonstrations_in(domain)
        asked = ProposalRequest.of_task(domain, task, proposers.proposer, request.rewarder, shown)
        path = request.work_folder / "attempts.jsonl" if asked.asks_model else None
        inquiry = proposers.inquiry(asked, AttemptLog(path, watch.on_attempt))
        proposal = asked.propose(inquiry)
        return {
            "command": request.command,
            "proposal": proposal.to_data(),
            "answered_by": inquiry.answered_by if inquiry is not None else {},
        }

    def read(data: Any) -> tuple[str, _Proposed]:
        proposal = read_proposal(data["proposal"], domain)
        return data["command"], _Proposed(proposal, dict(data["answered_by"]))

    made_by, proposed = work.cached(PROPOSAL, propose, read)
    if made_by != request.command:
        raise InvalidParameterError(
            f"{request.work_folder} has another training, of `{made_by}`; give another folder, or "
            "remove this one"
        )
    return proposed


def require_budget(settings: AcquisitionSettings, least: int) -> None:
    """Refuse a budget in which no skill can be judged even once.

    Args:
        settings: Settings with the budget of environment steps.
        least: Environment steps until a skill is judged first.

    Raises:
        InvalidParameterError: It says how many steps it takes.
    """
    if settings.total_steps < least:
        raise InvalidParameterError(
            f"{settings.total_steps} environment steps are too few to learn anything: a skill is "
            f"judged after {least}; give more --steps"
        )


def known_skills(paths: Sequence[Path], tell: Tell) -> dict[str, AcquiredSkill]:
    """The skills of libraries, each in the words of its own domain, by folder.

    Args:
        paths: Folders of the libraries.
        tell: Function that receives warnings about skills that are left out.

    Raises:
        InvalidLibraryError: One of them cannot be read.
    """
    known: dict[str, AcquiredSkill] = {}
    for path in paths:
        about = read_library_record(path)
        library = load_skill_library(path, get_domain(about["domain"], about.get("preset")))
        for reason in library.refused:
            tell(f"a skill is left out: {reason}")
        known |= {str(path / skill.folder_name): skill for skill in library.skills}
    return known


def _library_to_keep(path: Path | None, domain: Domain) -> SkillLibrary:
    """The library whose skills are there already; an empty one where none is given.

    Raises:
        InvalidLibraryError: It cannot be read, or is of another domain.
    """
    return SkillLibrary(domain.name) if path is None else load_skill_library(path, domain)


def _kept(
    path: Path | None, library: SkillLibrary, proposal: Proposal, tell: Tell
) -> dict[str, AcquiredSkill]:
    """The skills of a library that are for the operators proposed, by folder.

    Args:
        path: Folder of the library; None for none.
        library: Library that was read from the folder.
        proposal: Proposal, which says which skills are to be acquired.
        tell: Function that receives warnings about skills that are not kept.
    """
    if path is None:
        return {}
    kept, reasons = {}, list(map(str, library.refused))
    for skill in library.skills:
        if skill.operator in proposal.operators:
            kept[str(path / skill.folder_name)] = skill
        else:
            reasons.append(f"no operator that is proposed is that of {skill.folder_name}")
    for reason in reasons:
        tell(f"a skill is not kept: {reason}")
    return kept
