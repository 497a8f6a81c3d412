# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap study``: the paper's figures, made again."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any

import typer

from slap_ros.api.jobs import require_torch
from slap_ros.api.shortcut_choice import sampling
from slap_ros.cli import acquisition_study
from slap_ros.cli.console import console, exits
from slap_ros.cli.options import DomainName, Jobs, Preset, flat_options
from slap_ros.cli.shortcuts import SAMPLES, Samples, Shortcuts, choose
from slap_ros.cli.study_report import (
    FRESH_SEED,
    RESULTS,
    FreshSeed,
    Output,
    make_report,
    provenance,
    require_report,
)
from slap_ros.core import Domain
from slap_ros.domains import get_domain, preset_names
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.approaches import Approach, approaches
from slap_ros.evaluation.experiment import Experiment
from slap_ros.files import read_text, write_whole
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.shortcuts.settings import ExplorationSettings, training_settings
from slap_ros.shortcuts.shipped import shipped_libraries, shipped_library
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies import readme
from slap_ros.studies.comparison import Comparison
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.results import Data, StudyReport, describe_library
from slap_ros.studies.slap import (
    ablation,
    dynamics,
    generalisation,
    perception,
    planning_time,
    pruning,
    table1,
)
from slap_ros.studies.slap import goals as sampled
from slap_ros.studies.slap.trainings import TrainingFolder
from slap_ros.studies.slap.variations import offered, offered_number, parse_variation

TABLES_IN = (
    "README.md",
    "docs/presets.md",
    "docs/reproducing.md",
    "docs/results/README.md",
    "docs/skills.md",
)
PAGES = [Path(page) for page in TABLES_IN]  # with tables made of results

app = typer.Typer(
    help="Make a figure of the papers again: data, a picture and a page. After an interruption, "
    "the same command goes on where the study stopped.",
    no_args_is_help=True,
)

Tasks = Annotated[int, typer.Option(min=1, help="Tasks per seed.")]
Seeds = Annotated[int, typer.Option(min=1, help="Number of task seeds.")]
FirstSeed = Annotated[int, typer.Option(min=0, help="First task seed.")]
Vary = Annotated[
    list[str] | None,
    typer.Option(
        help="Setting to vary and its values, as setting=value,value,... May be "
        "repeated. Default: the usual settings."
    ),
]
Work = Annotated[
    list[Path],
    typer.Option(
        metavar="FOLDER",
        help="Work folder of a `slap train`. May be repeated, one folder per seed.",
    ),
]


@dataclass(frozen=True)
class TaskOptions:
    """Which tasks a study samples, and where it writes."""

    tasks: Tasks = 4
    seeds: Seeds = 5
    first_seed: FirstSeed = FRESH_SEED
    preset: Preset = None
    jobs: Jobs = 1
    output: Output = RESULTS

    def __post_init__(self) -> None:
        """Refuse what cannot be, before hours are spent: see :func:`require_report`."""
        require_report(self.output)


@dataclass(frozen=True)
class ComparisonOptions(TaskOptions):
    """How a study compares pure planning with SLAP."""

    shortcuts: Shortcuts = None
    samples: Samples = SAMPLES


@dataclass(frozen=True)
class GoalOptions(ComparisonOptions):
    """The same with one task per seed, as each task has many goals."""

    tasks: Tasks = 1


@app.command("dynamics")
@exits
@flat_options
def dynamics_(domain: DomainName, work: Work, *, options: ComparisonOptions) -> None:
    """SLAP Fig. 4: learning curves from work folders, and plans with what was learned so far."""
    folders = [TrainingFolder(folder) for folder in work]
    compared = _Compared.of(domain, options, _trainings(folders), needs_library=False)
    compared.make("dynamics", lambda it: dynamics.study(folders, it), work=work)


@app.command("generalisation")
@exits
@flat_options
def generalisation_(domain: DomainName, vary: Vary = None, *, options: ComparisonOptions) -> None:
    """SLAP Fig. 5: pure planning and SLAP as obstacles, distractors, mass or friction vary."""
    compared = _Compared.of(domain, options)
    chosen = [parse_variation(text) for text in vary or ()] or offered(compared.domain)
    compared.ends().make("generalisation", lambda it: generalisation.study(it, chosen), vary=vary)


@app.command("goals")
@exits
@flat_options
def goals_(
    domain: DomainName,
    goals: Annotated[
        int, typer.Option(min=1, help="Goals per task, or all if the task has fewer.")
    ] = 15,
    *,
    options: GoalOptions,
) -> None:
    """SLAP Fig. 9: pure planning and SLAP for goals that the library was not trained for."""
    compared = _Compared.of(domain, options, {"goals": goals}).ends()
    compared.make("goals", lambda it: sampled.study(it, goals))


@app.command("pruning")
@exits
@flat_options
def pruning_(
    domain: DomainName,
    work: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FOLDER",
            help="Work folder of a `slap train` that has explored. May be repeated.",
        ),
    ] = None,
    settings: Annotated[
        str, typer.Option(help="Settings of exploration where --work is not given: ours or paper.")
    ] = "ours",
    *,
    options: ComparisonOptions,
) -> None:
    """SLAP Table 2: candidates that random rollouts keep, and plan length without the others."""
    folders = [TrainingFolder(folder) for folder in work or ()]
    sampled_from = _trainings(folders) if folders else {"settings": settings}
    compared = _Compared.of(domain, options, sampled_from, needs_library=False)

    def make(comparison: Comparison) -> StudyReport:
        if folders:
            explored, how = pruning.explored_in(folders, domain)
        else:
            how = training_settings(settings, compared.domain).exploration
            explored = _explore(comparison, how)
        return pruning.study(explored, how, comparison)

    compared.make("pruning", make, work=work)


@app.command("perception")
@exits
@flat_options
def perception_(
    domain: DomainName,
    max_replans: Annotated[
        int, typer.Option(min=0, help="Maximum number of plans after the first.")
    ] = 10,
    *,
    options: ComparisonOptions,
) -> None:
    """SLAP D.3, D.4: success, length and replans under several errors of perception."""
    compared = _Compared.of(domain, options, {"max_replans": max_replans}).ends()
    compared.make("perception", lambda it: perception.study(it, max_replans))


@app.command("planning_time")
@exits
@flat_options
def planning_time_(
    domain: DomainName,
    vary: Annotated[
        str | None,
        typer.Option(
            help="Setting to vary and its values, as setting=value,value,... Default: "
            "the number of obstacles."
        ),
    ] = None,
    *,
    options: ComparisonOptions,
) -> None:
    """SLAP Table 4: seconds of planning, edges rolled out, size of the graph."""
    compared = _Compared.of(domain, options)
    chosen = parse_variation(vary) if vary else offered_number(compared.domain)
    compared.make("planning_time", lambda it: planning_time.study(it, chosen), vary=vary)


for name, command in acquisition_study.COMMANDS.items():
    app.command(name)(command)


@app.command("table1")
@exits
def table1_(
    domain: DomainName,
    libraries: Annotated[
        list[Path] | None,
        typer.Option(
            "--library",
            metavar="FOLDER",
            help="Folder of a library, one per training seed. May be repeated. Default: all that "
            "ship.",
        ),
    ] = None,
    tasks: Tasks = 10,
    seeds: Seeds = 5,
    first_seed: FirstSeed = FRESH_SEED,
    presets: Annotated[
        list[str] | None,
        typer.Option("--preset", help="Preset of the domain. May be repeated. Default: all."),
    ] = None,
    samples: Samples = SAMPLES,
    jobs: Jobs = 1,
    output: Output = RESULTS,
) -> None:
    """SLAP Table 1: success and plan length on fresh tasks, over several trained libraries."""
    require_report(output)
    chosen = [get_domain(domain, preset) for preset in presets or preset_names(domain)]
    folders = libraries or shipped_libraries(domain)
    trained = [
        table1.TrainedLibrary(_library_name(folder), loaded)
        for folder in folders
        if (loaded := choose(str(folder), chosen[0], "lazy")) is not None
    ]
    settings = {"tasks": tasks, "seeds": seeds, "first_seed": first_seed, "samples": samples}
    given = {"library": libraries, "preset": presets, **settings}
    described = [describe_library(one.name, one.library) for one in trained]
    origin = provenance("table1", domain, {**settings, "libraries": described}, **given)
    experiments = [Experiment(one, tasks, seeds, first_seed) for one in chosen]
    make_report(
        "table1",
        origin,
        output,
        jobs,
        lambda runner: table1.study(experiments, trained, sampling(samples), runner),
    )


@app.command("ablation")
@exits
def ablation_(
    domain: DomainName,
    term: Annotated[
        list[str] | None,
        typer.Option(
            help="Term to leave out. May be repeated. Default: each term, and all together."
        ),
    ] = None,
    trainings: Annotated[
        int, typer.Option(min=1, help="Number of trainings per term, with seeds from 0 on.")
    ] = 3,
    steps: Annotated[
        int | None,
        typer.Option(
            min=1, help="Environment steps of a training. Default: as in the domain's settings."
        ),
    ] = None,
    tasks: Annotated[
        int, typer.Option(min=1, help="Number of tasks to plan with what was learned.")
    ] = 20,
    seed: FreshSeed = FRESH_SEED,
    samples: Samples = SAMPLES,
    preset: Preset = None,
    jobs: Jobs = 1,
    output: Output = RESULTS,
) -> None:
    """What a domain's hand-made terms are worth: learn without each, and without all."""
    require_report(output)
    require_torch()
    preset = get_domain(domain, preset).preset
    setup = ablation.AblationSetup(domain, preset, steps, tasks, seed, sampling(samples))
    settings = {
        "preset": preset,
        "trainings": trainings,
        "steps": steps,
        "tasks": tasks,
        "seed": seed,
        "samples": samples,
    }
    origin = provenance("ablation", domain, settings, term=term)
    # Checkpoints of another command would be of other trainings.
    folder = output / f".ablation_{domain}-{sha256(origin.command.encode()).hexdigest()[:8]}"
    make_report(
        "ablation",
        origin,
        output,
        jobs,
        lambda run: ablation.study(setup, term or setup.terms(), trainings, run, folder),
    )
    shutil.rmtree(folder, ignore_errors=True)


@app.command("readme")
@exits
def readme_(
    pages: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="PAGE", help="Markdown pages to update. Default: all pages with tables."
        ),
    ] = None,
    results: Annotated[Path, typer.Option(help="Folder of the studies' data.")] = RESULTS,
) -> None:
    """Update the tables of pages from the data of studies."""
    for page in pages or PAGES:
        text = read_text(page)
        written = readme.with_tables(text, results)
        if written != text:
            write_whole(page, written)
        console.print(f"{page}: {'changed' if written != text else 'as it was'}")


def _library_name(folder: Path) -> str:
    """As people tell libraries of a domain apart: by the folder, and the training's seed."""
    return "/".join(folder.resolve().parts[-2:])


@dataclass(frozen=True)
class _Compared:
    """Pure planning and SLAP, and for which tasks."""

    domain: Domain
    approaches: tuple[Approach, ...]
    settings: Data  # that a report names
    options: ComparisonOptions

    @classmethod
    def of(
        cls,
        domain: str,
        options: ComparisonOptions,
        settings: Data | None = None,
        needs_library: bool = True,
    ) -> _Compared:
        """What the command line asks for.

        Args:
            domain: Name of the domain.
            options: The command's.
            settings: The study's own that a report names.
            needs_library: Whether there is nothing to study without shortcuts.

        Raises:
            InvalidParameterError: There are none, and they are needed.
        """
        chosen = get_domain(domain, options.preset)
        library = choose(options.shortcuts, chosen, "lazy")
        folder = Path(options.shortcuts) if options.shortcuts else shipped_library(domain)
        if library is None and needs_library:
            raise InvalidParameterError(
                f"there is nothing to compare with pure planning in {domain}: give a shortcut "
                "library with --shortcuts"
            )
        named = {
            **(settings or {}),
            "preset": chosen.preset,
            "tasks": options.tasks,
            "seeds": options.seeds,
            "first_seed": options.first_seed,
            "samples": options.samples,
        }
        if library is not None and folder is not None:
            named["library"] = describe_library(folder.name, library)
        return cls(chosen, approaches(library, sampling(options.samples)), named, options)

    def ends(self) -> _Compared:
        """The same for pure planning and SLAP alone, without the approaches between them."""
        return replace(self, approaches=(self.approaches[0], self.approaches[-1]))

    def make(self, study: str, make: Callable[[Comparison], StudyReport], **given: Any) -> None:
        """Make and write the report of a study.

        Args:
            study: Name of the study, as in ``slap study``.
            make: Makes the report.
            given: What its command has besides.
        """
        options = self.options
        given["shortcuts"] = options.shortcuts
        origin = provenance(study, self.domain.name, self.settings, **given)

        def compare(runner: JobRunner) -> StudyReport:
            return make(
                Comparison(
                    domain=self.domain,
                    approaches=self.approaches,
                    tasks=options.tasks,
                    seeds=options.seeds,
                    first_seed=options.first_seed,
                    runner=runner,
                )
            )

        make_report(study, origin, options.output, options.jobs, compare)


def _explore(
    comparison: Comparison, how: ExplorationSettings
) -> tuple[pruning.PrunedCandidates, ...]:
    """Explore as many tasks as are planned for, each seed's as a training with that seed does."""
    choice = DomainChoice.of(comparison.domain)
    trainings = [TaskDistribution(choice, seed) for seed in range(comparison.seeds)]
    return pruning.explore(trainings, comparison.tasks, how, comparison.runner)


def _trainings(folders: Sequence[TrainingFolder]) -> Data:
    """Whose work folders they are."""
    return {"trainings": [folder.distribution() for folder in folders]}
