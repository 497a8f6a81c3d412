# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap acquire``."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from slap_ros.acquisition.attempt_log import AttemptLog, Entry
from slap_ros.acquisition.curriculum import Curriculum
from slap_ros.acquisition.embedding_encoder import EmbeddingEncoder
from slap_ros.acquisition.inquiry import described
from slap_ros.acquisition.jobs import horizon_of
from slap_ros.acquisition.proposal import Proposal, read_proposal
from slap_ros.acquisition.proposal_request import ProposalRequest
from slap_ros.acquisition.proposer_names import MANUAL, REWARDERS, require_known
from slap_ros.acquisition.retrieval import MetricSignatureEncoder, SkillEncoder
from slap_ros.acquisition.settings import ACQUISITION_SETTINGS, AcquisitionSettings
from slap_ros.acquisition.skill_library import (
    AcquiredSkill,
    SkillLibrary,
    load_skill_library,
    read_library_record,
    save_skill_library,
)
from slap_ros.acquisition.task_source import TaskSource
from slap_ros.cli.acquisition_bars import AcquisitionBars
from slap_ros.cli.acquisition_events import AcquisitionEvents
from slap_ros.cli.command_line import command_line
from slap_ros.cli.console import console, print_json, styled
from slap_ros.cli.options import DomainName, Goal, Jobs, Json, Preset, Ray, TrainingSeed
from slap_ros.cli.propose import show_entry
from slap_ros.cli.proposer_options import ProposerOptions
from slap_ros.cli.train import require_torch, training_workers
from slap_ros.core import Domain
from slap_ros.core.goals import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.files import require_writable, sole_use
from slap_ros.language.settings import LOCAL_SCHEME, read_settings
from slap_ros.learning.setting_changes import changed, parse_changes
from slap_ros.learning.work_folder import WorkFolder


@dataclass(frozen=True)
class AcquireOptions:
    """What to acquire, how, and where to keep it."""

    domain: DomainName
    output: Annotated[
        Path | None, typer.Option(help="Folder of the new library. Default: runs/skills/DOMAIN.")
    ] = None
    preset: Preset = None
    goal: Goal = None
    seed: TrainingSeed = 0
    rewarder: Annotated[
        str,
        typer.Option(
            help="Source of rewards: manual (hand-written), composed (from metrics), or language "
            "(from a language model)."
        ),
    ] = MANUAL
    begin: Annotated[
        list[Path] | None,
        typer.Option(
            "--from", help="Skill library whose skills training may begin from. May be repeated."
        ),
    ] = None
    encoder: Annotated[
        str | None,
        typer.Option(
            help="With --from: embedding model at --base-url that finds similar skills. Default: "
            "no model; compare the metrics behind the operators."
        ),
    ] = None
    keep: Annotated[
        Path | None,
        typer.Option(
            help="Skill library to keep: learn the skills that it lacks, and train further those "
            "that fail."
        ),
    ] = None
    settings: Annotated[
        str, typer.Option(help=f"Networks and SAC: {', '.join(ACQUISITION_SETTINGS)}.")
    ] = "small"
    set: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Change one of the settings, such as sac.discount=0.99. May be repeated. A wrong "
            "name lists all names.",
        ),
    ] = None
    steps: Annotated[
        int | None,
        typer.Option(min=1, help="Environment steps of training, all skills together."),
    ] = None
    jobs: Jobs = 2
    ray: Ray = None
    work: Annotated[
        Path | None,
        typer.Option(
            help="Folder for checkpoints and results. With the same folder again, training goes on."
        ),
    ] = None
    events: Annotated[
        bool,
        typer.Option("--events", help="Print every event on stdout, as one line of JSON."),
    ] = False
    json: Json = False

    def __post_init__(self) -> None:
        require_known("--rewarder", self.rewarder, REWARDERS)
        if self.encoder is not None and not self.begin:
            raise InvalidParameterError("--encoder is for --from: without, nothing is retrieved")

    @property
    def library_folder(self) -> Path:
        """Where the library is saved."""
        return self.output or Path("runs/skills") / self.domain

    @property
    def work_folder(self) -> Path:
        """Where checkpoints are, by default beside the library."""
        return self.work or self.library_folder.with_name(f"{self.library_folder.name}-training")

    def skill_encoder(self, proposers: ProposerOptions) -> SkillEncoder:
        """What says which skills are alike.

        Raises:
            InvalidParameterError: Language settings cannot be read, or name no server.
            LanguageUnavailableError: There is no key, or no client.
        """
        if self.encoder is None:
            return MetricSignatureEncoder()
        settings = read_settings(proposers.language_settings, self.encoder, proposers.base_url)
        if settings.base_url.startswith(LOCAL_SCHEME):
            raise InvalidParameterError(
                f"--encoder asks a server; {settings.base_url} is not one: give another --base-url"
            )
        return EmbeddingEncoder(settings, WorkFolder(self.work_folder))

    @property
    def acquisition_settings(self) -> AcquisitionSettings:
        """Hyper-parameters of the curriculum.

        Raises:
            InvalidParameterError: There are none of that name, or they cannot be changed so.
        """
        if self.settings not in ACQUISITION_SETTINGS:
            raise InvalidParameterError(
                f"unknown settings {self.settings!r}; there are {', '.join(ACQUISITION_SETTINGS)}"
            )
        changes = parse_changes(self.set or (), AcquisitionSettings)
        if self.steps is not None and "total_steps" in changes:
            raise InvalidParameterError("--steps and --set total_steps say the same: give one")
        chosen = changed(ACQUISITION_SETTINGS[self.settings], changes)
        return chosen if self.steps is None else replace(chosen, total_steps=self.steps)

    def command(self, proposers: ProposerOptions) -> str:
        """The command that acquires the same library again."""
        return command_line(
            "acquire",
            self.domain,
            preset=self.preset,
            goal=self.goal,
            seed=self.seed,
            **proposers.given,
            rewarder=self.rewarder,
            **{"from": [_shareable(folder) for folder in self.begin or ()]},
            encoder=self.encoder,
            keep=_shareable(self.keep) if self.keep else None,
            settings=self.settings,
            steps=self.steps,
            set=self.set,
        )


def _shareable(folder: Path) -> str:
    """A folder as it was given, or its name alone: no path of this machine goes into a library."""
    return folder.name if folder.is_absolute() else folder.as_posix()


def acquire(options: AcquireOptions, proposers: ProposerOptions) -> int:
    """Acquire skills: execute plans, train each skill that fails from where it fails, repeat.

    After an interruption, the same command goes on where it stopped.
    """
    domain = _acquirable(options)
    options = replace(options, preset=domain.preset)
    settings = options.acquisition_settings
    segment_steps = settings.segment_steps(horizon_of(domain))
    _require_budget(settings, segment_steps)
    encoder = options.skill_encoder(proposers)
    known, there = _known(options.begin or ()), _library_to_keep(options.keep, domain)
    for folder in (options.library_folder, options.work_folder):
        require_writable(folder)
    require_torch()
    goal = options.goal if options.goal is not None else next(iter(domain.goals), "")
    events = AcquisitionEvents(segment_steps if options.events else None)
    with sole_use(options.work_folder):
        proposed = _proposed(domain, options, proposers, goal, events)
        proposal = proposed.proposal
        events.proposed(proposal)
        source = TaskSource.of(domain, goal, options.seed, proposal.operators, proposal.rewards)
        kept = _kept(options.keep, there, proposal)
        with (
            training_workers(options.jobs, options.ray) as workers,
            AcquisitionBars(events) as bars,
        ):
            curriculum = Curriculum(
                source, settings, options.work_folder, workers, bars, known, encoder, kept
            )
            library = curriculum.run()
    made_by = {
        "command": options.command(proposers),
        **proposed.as_record(),
        "began_with": [path.name for path in options.begin or ()],
        **({"encoder": encoder.name} if options.encoder else {}),
        **({"kept": options.keep.name} if options.keep else {}),
    }
    library = replace(library, record={**made_by, **library.record})
    save_skill_library(options.library_folder, library)
    events.acquired(options.library_folder, library)
    _report(options, library)
    return 0


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


def _proposed(
    domain: Domain,
    options: AcquireOptions,
    proposers: ProposerOptions,
    goal: str,
    events: AcquisitionEvents,
) -> _Proposed:
    """Operators and rewards, checked; those of the work folder where it has some already.

    A model would give others when it is asked again.

    Args:
        domain: In which skills are acquired.
        options: Of the command.
        proposers: Who proposes.
        goal: A name, or atoms.
        events: Are told of every answer.

    Raises:
        InvalidParameterError: The work folder has another training, or is damaged.
        ProposalRejectedError: The operators make no plan.
    """
    work, command = WorkFolder(options.work_folder), options.command(proposers)

    def propose() -> dict[str, Any]:
        task = task_with_goal(domain, options.seed, 0, goal)
        shown = proposers.demonstrations_in(domain)
        request = ProposalRequest.of_task(domain, task, proposers.proposer, options.rewarder, shown)

        def show(entry: Entry) -> None:
            show_entry(entry)
            events.attempted(entry)

        path = options.work_folder / "attempts.jsonl" if request.asks_model else None
        inquiry = proposers.inquiry(request, AttemptLog(path, show))
        proposal = request.propose(inquiry)
        return {
            "command": command,
            "proposal": proposal.to_data(),
            "answered_by": inquiry.answered_by if inquiry is not None else {},
        }

    def read(data: Any) -> tuple[str, _Proposed]:
        proposal = read_proposal(data["proposal"], domain)
        return data["command"], _Proposed(proposal, dict(data["answered_by"]))

    made_by, proposed = work.cached("proposal", propose, read)
    if made_by != command:
        raise InvalidParameterError(
            f"{options.work_folder} has another training, of `{made_by}`; give another folder, or "
            "remove this one"
        )
    return proposed


def _acquirable(options: AcquireOptions) -> Domain:
    """The domain in which skills are acquired.

    Raises:
        InvalidParameterError: It says nothing of acquisition.
    """
    domain = get_domain(options.domain, options.preset)
    if domain.acquisition is None:
        raise InvalidParameterError(
            f"domain {domain.name} does not say what skills are acquired with; those that do have "
            "goals in the table of `slap domains`"
        )
    return domain


def _require_budget(settings: AcquisitionSettings, least: int) -> None:
    """Refuse a budget in which no skill can be judged even once.

    Args:
        settings: With the budget.
        least: Environment steps until a skill is judged first.

    Raises:
        InvalidParameterError: It says how many steps it takes.
    """
    if settings.total_steps < least:
        raise InvalidParameterError(
            f"{settings.total_steps} environment steps are too few to learn anything: a skill is "
            f"judged after {least}; give more --steps"
        )


def _known(paths: list[Path] | tuple[()]) -> dict[str, AcquiredSkill]:
    """The skills of libraries, each in the words of its own domain, by folder.

    Raises:
        InvalidLibraryError: One of them cannot be read.
    """
    known: dict[str, AcquiredSkill] = {}
    for path in paths:
        about = read_library_record(path)
        library = load_skill_library(path, get_domain(about["domain"], about.get("preset")))
        for reason in library.refused:
            console.print(styled("warning", "yellow", f" a skill is left out: {reason}"))
        known |= {str(path / skill.folder_name): skill for skill in library.skills}
    return known


def _library_to_keep(path: Path | None, domain: Domain) -> SkillLibrary:
    """The library whose skills are there already; an empty one where none is given.

    Raises:
        InvalidLibraryError: It cannot be read, or is of another domain.
    """
    return SkillLibrary(domain.name) if path is None else load_skill_library(path, domain)


def _kept(path: Path | None, library: SkillLibrary, proposal: Proposal) -> dict[str, AcquiredSkill]:
    """The skills of a library that are for the operators proposed, by folder.

    Args:
        path: The library's folder; None for none.
        library: Read from there.
        proposal: Says what is to be acquired.
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
        console.print(styled("warning", "yellow", f" a skill is not kept: {reason}"))
    return kept


def _report(options: AcquireOptions, library: SkillLibrary) -> None:
    record = library.record
    if options.json:
        print_json({"library": str(options.library_folder), "digest": library.digest, **record})
    if not library.skills:
        console.print(f"nothing was learned: {record['ended']}")
    for name, found in record["left"].items():
        console.print(f"{name} was not learned well enough: {why_left(found)}")
    if record["left"]:
        last = options.work_folder / f"iteration{len(record['progress']) - 1}" / "rollouts.json"
        console.print(f"{last} has the states")
    if record.get("answered_by"):
        console.print(f"operators or rewards are {described(record['answered_by'])}")
    console.print(
        f"{len(library.skills)} skills in {options.library_folder}: {record['ended']}; "
        f"task progress {record['progress_on_fresh_tasks']:.2f} on tasks that training never saw, "
        f"{record['steps']} environment steps; `slap skills {options.library_folder}` shows them",
    )


def why_left(found: dict[str, Any]) -> str:
    """Why a skill was given up, in words: from how many states, and what its failures share.

    Args:
        found: As the curriculum records it.
    """
    if "states" not in found:
        return str(found["why"])
    ends = ", ".join(f"{end} ({count} times)" for end, count in found["ends"].items())
    atoms = ", ".join(f"{atom} ({count} times)" for atom, count in found["atoms"].items())
    wrong = f"; most often not as it should be: {atoms}" if atoms else ""
    return f"{found['why']} from {found['states']} states: {ends}{wrong}"
