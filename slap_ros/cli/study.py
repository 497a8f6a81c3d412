# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap study``: the paper's figures, made again."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.progress import TaskID

from slap_ros.cli.console import Preset, console, exits, progress
from slap_ros.cli.shortcuts import SAMPLES, Samples, Shortcuts, choose, sampling
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.approaches import Approach, approaches
from slap_ros.shortcuts.settings import training_settings
from slap_ros.shortcuts.shipped import shipped_library
from slap_ros.studies import dynamics, generalisation, perception, planning_time, pruning
from slap_ros.studies import goals as sampled
from slap_ros.studies.comparison import Comparison
from slap_ros.studies.figures import require_matplotlib
from slap_ros.studies.results import Data, Provenance, StudyReport, describe_library, write
from slap_ros.studies.trainings import TrainingFolder
from slap_ros.studies.variations import NUMBERS, offered, parse_variation

RESULTS = Path("docs/results")

app = typer.Typer(
    help="Make a figure of the paper again: data, a picture and a page.",
    no_args_is_help=True,
)

Domain = Annotated[str, typer.Argument(help="One of `slap domains`.")]
Tasks = Annotated[int, typer.Option(min=1, help="Tasks a seed.")]
Seeds = Annotated[int, typer.Option(min=1, help="How many seeds, from 0 on.")]
Jobs = Annotated[int, typer.Option(min=1, help="Processes; the results are the same.")]
Output = Annotated[Path, typer.Option(help="Folder for NAME_DOMAIN.json, .svg and .md.")]
Vary = Annotated[
    list[str] | None,
    typer.Option(help="setting=value,value,...: vary this instead of the usual; may be repeated."),
]
Work = Annotated[
    list[Path],
    typer.Option(help="Work folder of a `slap train`; may be repeated, a folder a seed."),
]


@app.command("dynamics")
@exits
def dynamics_(domain: Domain, work: Work, output: Output = RESULTS) -> None:
    """SLAP Fig. 4: success and length while shortcuts are learned, from trainings' work folders."""
    require_matplotlib()
    get_domain(domain)
    folders = [TrainingFolder(folder) for folder in work]
    report = dynamics.study(domain, folders)
    command = _command("dynamics", domain, work=work)
    _write(output, report, Provenance(domain, command, _trainings(folders)))


@app.command("generalisation")
@exits
def generalisation_(
    domain: Domain,
    vary: Vary = None,
    tasks: Tasks = 4,
    seeds: Seeds = 5,
    preset: Preset = "fair",
    shortcuts: Shortcuts = None,
    samples: Samples = SAMPLES,
    jobs: Jobs = 1,
    output: Output = RESULTS,
) -> None:
    """SLAP Fig. 5: pure planning and SLAP as obstacles, distractors, mass or friction vary."""
    comparison, settings = _compare(domain, preset, shortcuts, samples, tasks, seeds, jobs)
    chosen = [parse_variation(text) for text in vary or ()] or offered(comparison.domain)
    ends = replace(comparison, approaches=_first_and_last(comparison.approaches))
    with _StudyBars() as show:
        report = generalisation.study(ends, chosen, show)
    command = _command("generalisation", domain, vary=vary, shortcuts=shortcuts, **settings)
    _write(output, report, Provenance(domain, command, settings))


@app.command("goals")
@exits
def goals_(
    domain: Domain,
    goals: Annotated[int, typer.Option(min=1, help="Goals a task, fewer if it has fewer.")] = 15,
    tasks: Tasks = 1,
    seeds: Seeds = 5,
    preset: Preset = "fair",
    shortcuts: Shortcuts = None,
    samples: Samples = SAMPLES,
    jobs: Jobs = 1,
    output: Output = RESULTS,
) -> None:
    """SLAP Fig. 9: pure planning and SLAP for goals that the library was not trained for."""
    comparison, settings = _compare(domain, preset, shortcuts, samples, tasks, seeds, jobs)
    ends = replace(comparison, approaches=_first_and_last(comparison.approaches))
    with _StudyBars() as show:
        report = sampled.study(ends, goals, show)
    command = _command("goals", domain, goals=goals, shortcuts=shortcuts, **settings)
    _write(output, report, Provenance(domain, command, {"goals": goals, **settings}))


@app.command("pruning")
@exits
def pruning_(
    domain: Domain,
    work: Annotated[
        list[Path] | None,
        typer.Option(help="Work folder of a `slap train` that has explored; may be repeated."),
    ] = None,
    tasks: Tasks = 4,
    seeds: Seeds = 5,
    preset: Preset = "fair",
    settings: Annotated[
        str, typer.Option(help="ours, or paper: how to explore, without --work.")
    ] = "ours",
    jobs: Jobs = 1,
    output: Output = RESULTS,
) -> None:
    """SLAP Table 2: how many candidates random rollouts leave over."""
    require_matplotlib()
    get_domain(domain, preset)
    if work:
        folders = [TrainingFolder(folder) for folder in work]
        explored, how = pruning.explored_in(folders, domain)
        origin = Provenance(domain, _command("pruning", domain, work=work), _trainings(folders))
    else:
        how = training_settings(settings, domain).exploration
        with _StudyBars() as show:
            explored = pruning.explore(domain, preset, seeds, tasks, how, jobs, show)
        options = {"preset": preset, "tasks": tasks, "seeds": seeds, "settings": settings}
        origin = Provenance(domain, _command("pruning", domain, **options), options)
    _write(output, pruning.study(domain, explored, how), origin)


@app.command("perception")
@exits
def perception_(
    domain: Domain,
    max_replans: Annotated[int, typer.Option(min=0, help="Plans after the first.")] = 10,
    tasks: Tasks = 4,
    seeds: Seeds = 5,
    preset: Preset = "fair",
    shortcuts: Shortcuts = None,
    samples: Samples = SAMPLES,
    jobs: Jobs = 1,
    output: Output = RESULTS,
) -> None:
    """SLAP D.3, D.4: success, length and replans while perception errs in several ways."""
    comparison, settings = _compare(domain, preset, shortcuts, samples, tasks, seeds, jobs)
    ends = replace(comparison, approaches=_first_and_last(comparison.approaches))
    with _StudyBars() as show:
        report = perception.study(ends, max_replans, show)
    settings = {"max_replans": max_replans, **settings}
    options = {name.replace("_", "-"): value for name, value in settings.items()}
    command = _command("perception", domain, shortcuts=shortcuts, **options)
    _write(output, report, Provenance(domain, command, settings))


@app.command("planning_time")
@exits
def planning_time_(
    domain: Domain,
    vary: Annotated[
        str | None,
        typer.Option(help="setting=value,value,...; default: the number of obstacles."),
    ] = None,
    tasks: Tasks = 4,
    seeds: Seeds = 5,
    preset: Preset = "fair",
    shortcuts: Shortcuts = None,
    samples: Samples = SAMPLES,
    jobs: Jobs = 1,
    output: Output = RESULTS,
) -> None:
    """SLAP Table 4: seconds of planning, edges rolled out, size of the graph."""
    comparison, settings = _compare(domain, preset, shortcuts, samples, tasks, seeds, jobs)
    chosen = parse_variation(vary) if vary else offered(comparison.domain, NUMBERS)[0]
    with _StudyBars() as show:
        report = planning_time.study(comparison, chosen, show)
    command = _command("planning_time", domain, vary=vary, shortcuts=shortcuts, **settings)
    _write(output, report, Provenance(domain, command, settings))


def _compare(
    domain: str,
    preset: str,
    shortcuts: str | None,
    samples: int,
    tasks: int,
    seeds: int,
    jobs: int,
) -> tuple[Comparison, Data]:
    """What to compare, and the settings to tell of."""
    require_matplotlib()
    chosen = get_domain(domain, preset)
    library = choose(shortcuts, chosen, "lazy")
    folder = Path(shortcuts) if shortcuts else shipped_library(domain)
    if library is None or folder is None:
        raise InvalidParameterError(
            f"there is nothing to compare with pure planning in {domain}: give a shortcut library "
            "with --shortcuts"
        )
    compared = approaches(library, sampling(samples))
    settings = {
        "preset": preset,
        "tasks": tasks,
        "seeds": seeds,
        "samples": samples,
        "library": describe_library(folder, library),
    }
    return Comparison(chosen, compared, tasks, seeds, jobs), settings


def _trainings(folders: Sequence[TrainingFolder]) -> Data:
    """Whose work folders they are."""
    return {"trainings": [folder.place() for folder in folders]}


def _first_and_last(compared: tuple[Approach, ...]) -> tuple[Approach, ...]:
    """Pure planning and SLAP, without what lies between."""
    return compared[0], compared[-1]


def _command(study: str, domain: str, **options: Any) -> str:
    """What makes a report again; options that say nothing are left out."""
    parts = ["slap", "study", study, domain]
    for name, value in options.items():
        values = value if isinstance(value, list) else [value]
        if not isinstance(value, Mapping) and value is not None:
            parts += [part for one in values for part in (f"--{name}", str(one))]
    return shlex.join(parts)


def _write(output: Path, report: StudyReport, origin: Provenance) -> None:
    paths = write(output, report, origin)
    console.print(f"{report.title}: {', '.join(map(str, paths))}", highlight=False, markup=False)


class _StudyBars:
    """Progress on the terminal, a bar a kind of jobs."""

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
        console.print(complaint, highlight=False, markup=False)
