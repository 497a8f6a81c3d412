# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap study``: the paper's figures, made again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import TaskID

from slap_ros.cli import language_study
from slap_ros.cli.command_line import command_line
from slap_ros.cli.console import console, exits, progress
from slap_ros.cli.language_study import ModelOptions
from slap_ros.cli.options import MAX_SEED, DomainName, Jobs, Preset, flat_options
from slap_ros.cli.shortcuts import SAMPLES, Samples, Shortcuts, choose, sampling
from slap_ros.core import Domain
from slap_ros.domains import get_domain, preset_names
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.approaches import approaches
from slap_ros.evaluation.experiment import Experiment
from slap_ros.files import read_text, require_writable, write_whole
from slap_ros.learning.domain_choice import DEMONSTRATOR, DomainChoice, open_domain
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.shortcuts.settings import ExplorationSettings, training_settings
from slap_ros.shortcuts.shipped import shipped_libraries, shipped_library
from slap_ros.studies import (
    demonstrations,
    dynamics,
    generalisation,
    induction,
    perception,
    planning_time,
    pruning,
    readme,
    table1,
    vacuity,
)
from slap_ros.studies import goals as sampled
from slap_ros.studies.comparison import Comparison
from slap_ros.studies.figures import require_matplotlib
from slap_ros.studies.planning_ablation import SEARCH, VARIANTS
from slap_ros.studies.results import Data, Provenance, StudyReport, describe_library, write
from slap_ros.studies.study_log import JobLog
from slap_ros.studies.trainings import TrainingFolder
from slap_ros.studies.trial_log import TrialLog
from slap_ros.studies.variations import NUMBERS, offered, parse_variation

RESULTS = Path("docs/results")
FRESH_SEED = 500  # development looks at no task seed from here on

app = typer.Typer(
    help="Make a figure of the paper again: data, a picture and a page.",
    no_args_is_help=True,
)

Tasks = Annotated[int, typer.Option(min=1, help="Tasks per seed.")]
Seeds = Annotated[int, typer.Option(min=1, help="How many seeds, from 0 on.")]
FreshSeed = Annotated[int, typer.Option(min=0, max=MAX_SEED, help="Of the tasks.")]
Output = Annotated[Path, typer.Option(help="Folder for NAME_DOMAIN.json, .svg and .md.")]
Vary = Annotated[
    list[str] | None,
    typer.Option(help="setting=value,value,...: vary this instead of the usual; may be repeated."),
]
Work = Annotated[
    list[Path],
    typer.Option(help="Work folder of a `slap train`; may be repeated, one folder per seed."),
]


@dataclass(frozen=True)
class TaskOptions:
    """Which tasks a study samples, and where it writes."""

    tasks: Tasks = 4
    seeds: Seeds = 5
    preset: Preset = None
    jobs: Jobs = 1
    output: Output = RESULTS

    def __post_init__(self) -> None:
        """Check that there is where to write, before hours are spent.

        Raises:
            OSError: It is no place for files.
        """
        require_writable(self.output)


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
def dynamics_(domain: DomainName, work: Work, output: Output = RESULTS) -> None:
    """SLAP Fig. 4: success and length while shortcuts are learned, from trainings' work folders."""
    require_matplotlib()
    require_writable(output)
    get_domain(domain)
    folders = [TrainingFolder(folder) for folder in work]
    report = dynamics.study(domain, folders)
    command = command_line("study", "dynamics", domain, work=work)
    _write(output, report, Provenance(domain, command, _trainings(folders)))


@app.command("generalisation")
@exits
@flat_options
def generalisation_(domain: DomainName, vary: Vary = None, *, options: ComparisonOptions) -> None:
    """SLAP Fig. 5: pure planning and SLAP as obstacles, distractors, mass or friction vary."""
    comparison, settings = _compare(domain, options)
    chosen = [parse_variation(text) for text in vary or ()] or offered(comparison.domain)
    with _StudyBars() as bars:
        report = generalisation.study(_ends(comparison), chosen, bars)
    command = command_line(
        "study", "generalisation", domain, vary=vary, **_given(options, settings)
    )
    _write(options.output, report, Provenance(domain, command, settings))


@app.command("goals")
@exits
@flat_options
def goals_(
    domain: DomainName,
    goals: Annotated[int, typer.Option(min=1, help="Goals per task, fewer if it has fewer.")] = 15,
    *,
    options: GoalOptions,
) -> None:
    """SLAP Fig. 9: pure planning and SLAP for goals that the library was not trained for."""
    comparison, settings = _compare(domain, options)
    with _StudyBars() as bars:
        report = sampled.study(_ends(comparison), goals, bars)
    command = command_line("study", "goals", domain, goals=goals, **_given(options, settings))
    _write(options.output, report, Provenance(domain, command, {"goals": goals, **settings}))


@app.command("pruning")
@exits
@flat_options
def pruning_(
    domain: DomainName,
    work: Annotated[
        list[Path] | None,
        typer.Option(help="Work folder of a `slap train` that has explored; may be repeated."),
    ] = None,
    settings: Annotated[
        str, typer.Option(help="ours, or paper: how to explore, without --work.")
    ] = "ours",
    *,
    options: TaskOptions,
) -> None:
    """SLAP Table 2: how many candidates random rollouts leave over."""
    require_matplotlib()
    chosen = get_domain(domain, options.preset)
    if work:
        folders = [TrainingFolder(folder) for folder in work]
        explored, how = pruning.explored_in(folders, domain)
        origin = Provenance(
            domain, command_line("study", "pruning", domain, work=work), _trainings(folders)
        )
    else:
        how = training_settings(settings, chosen).exploration
        explored = _explore(chosen, options, how)
        sampled_from = {
            "preset": chosen.preset,
            "tasks": options.tasks,
            "seeds": options.seeds,
            "settings": settings,
        }
        command = command_line("study", "pruning", domain, **sampled_from)
        origin = Provenance(domain, command, sampled_from)
    _write(options.output, pruning.study(domain, explored, how), origin)


@app.command("perception")
@exits
@flat_options
def perception_(
    domain: DomainName,
    max_replans: Annotated[int, typer.Option(min=0, help="Plans after the first.")] = 10,
    *,
    options: ComparisonOptions,
) -> None:
    """SLAP D.3, D.4: success, length and replans while perception errs in several ways."""
    comparison, settings = _compare(domain, options)
    with _StudyBars() as bars:
        report = perception.study(_ends(comparison), max_replans, bars)
    settings = {"max_replans": max_replans, **settings}
    command = command_line("study", "perception", domain, **_given(options, settings))
    _write(options.output, report, Provenance(domain, command, settings))


@app.command("planning_time")
@exits
@flat_options
def planning_time_(
    domain: DomainName,
    vary: Annotated[
        str | None,
        typer.Option(help="setting=value,value,...; default: the number of obstacles."),
    ] = None,
    *,
    options: ComparisonOptions,
) -> None:
    """SLAP Table 4: seconds of planning, edges rolled out, size of the graph."""
    comparison, settings = _compare(domain, options)
    chosen = parse_variation(vary) if vary else offered(comparison.domain, NUMBERS)[0]
    with _StudyBars() as bars:
        report = planning_time.study(comparison, chosen, bars)
    command = command_line("study", "planning_time", domain, vary=vary, **_given(options, settings))
    _write(options.output, report, Provenance(domain, command, settings))


@app.command("demonstrations")
@exits
def demonstrations_(
    domain: DomainName,
    goal: Annotated[
        list[str] | None,
        typer.Option(help="A goal's name; may be repeated. Default: all of the domain's."),
    ] = None,
    tasks: Annotated[int, typer.Option(min=1, help="Of the first goal.")] = 100,
    others: Annotated[int, typer.Option(min=1, help="Tasks of every other goal.")] = 50,
    seed: FreshSeed = FRESH_SEED,
    preset: Preset = None,
    jobs: Jobs = 1,
    output: Output = RESULTS,
) -> None:
    """Whether tasks can be solved: success of the domain's demonstrator, by goal.

    Whoever stops it goes on with the same command.
    """
    choice = _demonstrator(domain, preset, output)
    names = goal or list(open_domain(choice).goals) or [""]
    counts = {name: others if i else tasks for i, name in enumerate(names)}
    settings = {"preset": choice.preset, "tasks": tasks, "others": others, "seed": seed}
    command = command_line("study", "demonstrations", domain, goal=goal, **settings)
    log = JobLog(output / f".demonstrations_{domain}.jsonl", command)
    with _StudyBars() as bars:
        report = demonstrations.study(choice, counts, seed, log, jobs, bars)
    _write(output, report, Provenance(domain, command, settings))
    log.remove()


@app.command("vacuity")
@exits
def vacuity_(
    domain: DomainName,
    starts: Annotated[int, typer.Option(min=1, help="Of each operator.")] = 200,
    seed: FreshSeed = FRESH_SEED,
    preset: Preset = None,
    jobs: Jobs = 1,
    output: Output = RESULTS,
) -> None:
    """Whether there is anything to learn: policies that see nothing, from where skills begin.

    Whoever stops it goes on with the same command.
    """
    choice = _demonstrator(domain, preset, output)
    settings = {"preset": choice.preset, "starts": starts, "seed": seed}
    command = command_line("study", "vacuity", domain, **settings)
    log = JobLog(output / f".vacuity_{domain}.jsonl", command)
    with _StudyBars() as bars:
        report = vacuity.study(choice, starts, seed, log, jobs, bars)
    _write(output, report, Provenance(domain, command, settings))
    log.remove()


@app.command("induction")
@exits
def induction_(
    domain: DomainName,
    demonstrations: Annotated[
        list[int] | None, typer.Option(help="How many; may be repeated. Default: 1, 3 and 10.")
    ] = None,
    tasks: Annotated[int, typer.Option(min=1, help="To plan for, of each goal.")] = 20,
    seed: FreshSeed = FRESH_SEED,
    preset: Preset = None,
    output: Output = RESULTS,
) -> None:
    """Operators from so many demonstrations: whether A* finds plans as short for every goal."""
    choice = _demonstrator(domain, preset, output)
    counts = demonstrations or [1, 3, 10]
    settings = {"preset": choice.preset, "tasks": tasks, "seed": seed}
    command = command_line("study", "induction", domain, demonstrations=counts, **settings)
    with _StudyBars() as bars:
        report = induction.study(choice, counts, tasks, seed, bars)
    settings["demonstrations"] = counts
    _write(output, report, Provenance(domain, command, settings))


def _demonstrator(domain: str, preset: str | None, output: Path) -> DomainChoice:
    """The domain with its demonstrator for skills, once it is known that there is one."""
    require_matplotlib()
    require_writable(output)
    choice = DomainChoice(domain, preset or "", DEMONSTRATOR)
    return replace(choice, preset=open_domain(choice).preset)


@app.command("planning_ablation")
@exits
@flat_options
def planning_ablation_(
    domain: DomainName,
    variants: Annotated[
        str, typer.Option(help="language+search, language, one_shot; separated by commas.")
    ] = ",".join(VARIANTS),
    plans: Annotated[int, typer.Option(min=1, help="Tasks to plan for.")] = 25,
    attempts: Annotated[int, typer.Option(min=1, help="At operators, for one plan.")] = 10,
    output: Output = RESULTS,
    *,
    options: ModelOptions,
) -> None:
    """LG-SAIL Table 2: operators of a language model, planned with by A* or by the model."""
    require_matplotlib()
    require_writable(output)
    with _StudyBars() as bars:
        report, settings = language_study.planning(domain, variants, plans, attempts, options, bars)
    command = command_line("study", "planning_ablation", domain, **settings)
    _write(output, report, Provenance(domain, command, settings))


@app.command("models")
@exits
@flat_options
def models_(
    domain: DomainName,
    plans: Annotated[int, typer.Option(min=1, help="Tasks to plan for.")] = 100,
    attempts: Annotated[int, typer.Option(min=1, help="At operators, for one plan.")] = 10,
    output: Output = RESULTS,
    *,
    options: ModelOptions,
) -> None:
    """LG-SAIL Tables 5 and 6: operators of several language models, planned with by A*."""
    require_matplotlib()
    require_writable(output)
    with _StudyBars() as bars:
        report, settings = language_study.planning(domain, SEARCH, plans, attempts, options, bars)
    command = command_line("study", "models", domain, **settings)
    _write(output, replace(report, study="models"), Provenance(domain, command, settings))


@app.command("reward_ablation")
@exits
@flat_options
def reward_ablation_(
    domain: DomainName,
    metrics: Annotated[
        str, typer.Option(help="full, headers: what the model sees of them; by commas.")
    ] = "full,headers",
    trials: Annotated[int, typer.Option(min=1, help="Of each.")] = 25,
    output: Output = RESULTS,
    *,
    options: ModelOptions,
) -> None:
    """LG-SAIL Table 3, Fig. 7: rewards of a language model, and what is wrong with them."""
    require_matplotlib()
    require_writable(output)
    with _StudyBars() as bars:
        report, settings = language_study.rewards(domain, metrics, trials, options, bars)
    command = command_line("study", "reward_ablation", domain, **settings)
    _write(output, report, Provenance(domain, command, settings))


@app.command("table1")
@exits
def table1_(
    domain: DomainName,
    libraries: Annotated[
        list[Path] | None,
        typer.Option(
            "--library",
            help="A library's folder, one per training seed; may be repeated. Default: what ships.",
        ),
    ] = None,
    tasks: Tasks = 10,
    seeds: Seeds = 5,
    first_seed: Annotated[int, typer.Option(min=0, help="The first task seed.")] = FRESH_SEED,
    presets: Annotated[
        list[str] | None, typer.Option("--preset", help="May be repeated. Default: all.")
    ] = None,
    samples: Samples = SAMPLES,
    jobs: Jobs = 1,
    output: Output = RESULTS,
) -> None:
    """SLAP Table 1: success and plan length on fresh tasks, over several trained libraries.

    Whoever stops it goes on with the same command.
    """
    require_matplotlib()
    require_writable(output)
    chosen = [get_domain(domain, preset) for preset in presets or preset_names(domain)]
    folders = libraries or shipped_libraries(domain)
    trained = [
        table1.TrainedLibrary(_library_name(folder), loaded)
        for folder in folders
        if (loaded := choose(str(folder), chosen[0], "lazy")) is not None
    ]
    settings = {"tasks": tasks, "seeds": seeds, "first_seed": first_seed, "samples": samples}
    given = {"library": list(map(str, libraries or ())), "preset": list(presets or ())}
    command = command_line("study", "table1", domain, **given, **settings)
    log = TrialLog(output / f".table1_{domain}.jsonl", command)
    experiments = [Experiment(one, tasks, seeds, first_seed) for one in chosen]
    with _StudyBars() as bars:
        report = table1.study(experiments, trained, sampling(samples), jobs, log, bars)
    described = [describe_library(one.name, one.library) for one in trained]
    _write(output, report, Provenance(domain, command, {**settings, "libraries": described}))
    log.remove()


@app.command("readme")
@exits
def readme_(
    pages: Annotated[
        list[Path] | None, typer.Argument(help="Markdown pages. Default: README.md.")
    ] = None,
    results: Annotated[Path, typer.Option(help="Folder of the studies' data.")] = RESULTS,
) -> None:
    """Write the tables of pages again from the data of studies."""
    for page in pages or [Path("README.md")]:
        text = read_text(page)
        written = readme.with_tables(text, results)
        if written != text:
            write_whole(page, written)
        console.print(f"{page}: {'changed' if written != text else 'as it was'}")


def _library_name(folder: Path) -> str:
    """As people tell libraries of a domain apart: by the folder, and the training's seed."""
    return "/".join(folder.resolve().parts[-2:])


def _compare(domain: str, options: ComparisonOptions) -> tuple[Comparison, Data]:
    """What to compare, and the settings that a report names."""
    require_matplotlib()
    chosen = get_domain(domain, options.preset)
    library = choose(options.shortcuts, chosen, "lazy")
    folder = Path(options.shortcuts) if options.shortcuts else shipped_library(domain)
    if library is None or folder is None:
        raise InvalidParameterError(
            f"there is nothing to compare with pure planning in {domain}: give a shortcut library "
            "with --shortcuts"
        )
    compared = approaches(library, sampling(options.samples))
    settings = {
        "preset": chosen.preset,
        "tasks": options.tasks,
        "seeds": options.seeds,
        "samples": options.samples,
        "library": describe_library(folder.name, library),
    }
    comparison = Comparison(chosen, compared, options.tasks, options.seeds, options.jobs)
    return comparison, settings


def _ends(comparison: Comparison) -> Comparison:
    """The same for pure planning and SLAP alone, without the approaches between them."""
    return replace(comparison, approaches=(comparison.approaches[0], comparison.approaches[-1]))


def _given(options: ComparisonOptions, settings: Data) -> Data:
    """The options that make a report again, with the library as it was given."""
    return {"shortcuts": options.shortcuts, **settings}


def _explore(
    domain: Domain, options: TaskOptions, how: ExplorationSettings
) -> tuple[pruning.PrunedCandidates, ...]:
    trainings = [
        TaskDistribution(domain.name, domain.preset, seed) for seed in range(options.seeds)
    ]
    with _StudyBars() as bars:
        return pruning.explore(trainings, options.tasks, how, options.jobs, bars)


def _trainings(folders: Sequence[TrainingFolder]) -> Data:
    """Whose work folders they are."""
    return {"trainings": [folder.distribution() for folder in folders]}


def _write(output: Path, report: StudyReport, origin: Provenance) -> None:
    paths = write(output, report, origin)
    console.print(f"{report.title}: {', '.join(map(str, paths))}")


class _StudyBars:
    """Progress on the terminal, one bar per kind of jobs."""

    def __init__(self) -> None:
        self._bars = progress()
        self._bar: TaskID | None = None

    def __enter__(self) -> _StudyBars:
        self._bars.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bars.stop()

    def begin(self, what: str, total: int) -> None:
        """So many jobs of a kind follow."""
        if self._bar is not None:
            self._bars.remove_task(self._bar)
        self._bar = self._bars.add_task(what, total=total)

    def advance(self) -> None:
        """One of them has ended."""
        if self._bar is not None:
            self._bars.advance(self._bar)

    def report_failure(self, complaint: str) -> None:
        """A task was not solved, and why."""
        console.print(complaint)
