# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What skills of another library are worth to begin with: from scratch or warm (LG-SAIL Fig. 6)."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import chain
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.acquisition.curriculum.jobs import horizon_of
from slap_ros.acquisition.curriculum.solved_shares import Point
from slap_ros.api.acquisition import acquirable, known_skills, require_budget
from slap_ros.api.acquisition_request import AcquisitionRequest
from slap_ros.api.command_options import CommandOption, DomainName, Jobs, Preset
from slap_ros.api.jobs import require_torch
from slap_ros.api.learning_curves import PLAN, steps_to
from slap_ros.api.left_out import Tell
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.statistics import Interval, ratio_interval
from slap_ros.evaluation.summary import Spread, format_spread
from slap_ros.studies.figures import LINES
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.learning_curves import (
    AcquisitionSetup,
    LearningCurves,
    format_steps_to,
    learn_skills,
)
from slap_ros.studies.options import RESULTS, Output
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.study import PaperFigure, PreparedStudy, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED = """\
Skills are acquired for hand-written operators and rewards, from scratch, and again with libraries
whose skills new ones may begin with. The two trainings of a seed have the same tasks. A row says
after how many environment steps of learning a success of {level:g} was first measured: of whole
plans by their task progress, which is measured between rounds of training, and of a skill by the
judgements of its checkpoints, one every {segment:,} steps. Steps are the mean ± sample standard
deviation over seeds. Where a training never came there, its own length is counted, and the cell
has a ≥. The ratio is that of the means, with the bootstrap's 95 % interval over seeds; it has a ≤
where a training from scratch never came there, and there is none where a warm one never did. *Last*
is what was measured after all steps: of plans with the best checkpoint of each skill, of a skill
with the weights that it had by then. Episodes in which known skills are tried, and in which
checkpoints are judged, are not counted as steps. The last column has the skills that were begun
with, and their success before any training.
"""
SCRATCH, WARM = "scratch", "warm"
LEVEL = 0.8  # task progress, and success, up to which steps are counted
FROM: Mapping[str, str] = {"make_coffee": "models/skills/stow_hammer"}  # as the paper has it


@dataclass(frozen=True)
class StartComparison:
    """Trainings from scratch and warm ones, by one measure.

    Args:
        name: Name of the skill, or :data:`PLAN` for whole plans.
        scratch: Measurements of each training from scratch.
        warm: Measurements of each warm training, in the same order of seeds.
    """

    name: str
    scratch: tuple[tuple[Point, ...], ...]
    warm: tuple[tuple[Point, ...], ...]

    @property
    def ratio(self) -> tuple[float, Interval | None] | None:
        """Steps of warm trainings over steps of those from scratch.

        None where a warm training never came there, or one from scratch was there at once.
        """
        ours, theirs = (
            [steps_to(one, LEVEL)[0] for one in side] for side in (self.warm, self.scratch)
        )
        if not ours or not all(theirs) or not all(_reached(self.warm)):
            return None
        return sum(ours) / sum(theirs), ratio_interval(ours, theirs)

    @property
    def is_bound(self) -> bool:
        """Whether the ratio is at most that: a training from scratch never came there."""
        return not all(_reached(self.scratch))

    def as_json(self) -> dict[str, Any]:
        """The summary, and all measurements."""
        ratio = self.ratio
        sides = {SCRATCH: self.scratch, WARM: self.warm}
        return {
            "of": self.name,
            "steps": {name: [steps_to(one, LEVEL)[0] for one in of] for name, of in sides.items()},
            "reached": {name: _reached(of) for name, of in sides.items()},
            "last": {name: [one[-1].success for one in of] for name, of in sides.items()},
            "ratio": None if ratio is None else ratio[0],
            "ratio_is_bound": self.is_bound,
            "ratio_interval": asdict(ratio[1]) if ratio is not None and ratio[1] else None,
        }


def _reached(trainings: Sequence[Sequence[Point]]) -> list[bool]:
    """Whether each training ever came to the level."""
    return [steps_to(one, LEVEL)[1] for one in trainings]


def study(
    setup: AcquisitionSetup,
    libraries: Sequence[Path],
    seeds: int,
    segment_steps: int,
    runner: JobRunner,
    folder: Path,
) -> StudyReport:
    """Acquire skills from scratch and warm, a training each per seed.

    Args:
        setup: Domain, goal and settings of the trainings.
        libraries: Folders of libraries whose skills warm trainings may begin with.
        seeds: Number of seeds, from 0 on.
        segment_steps: Environment steps between two judgements of a skill.
        runner: Runner of the jobs.
        folder: Folder for checkpoints.

    Returns:
        The report.
    """
    known = {SCRATCH: (), WARM: tuple(map(str, libraries))}
    batch = {
        f"{start} {seed}": (setup, seed, known[start], str(folder / f"{start}-{seed}"))
        for seed in range(seeds)
        for start in known
    }
    found = runner.run("acquiring skills", learn_skills, LearningCurves.from_json, batch)
    by_start = {start: [found[f"{start} {seed}"] for seed in range(seeds)] for start in known}
    comparisons = compare(by_start[SCRATCH], by_start[WARM])
    return StudyReport(
        study="warm_start",
        source="LG-SAIL Fig. 6",
        title=f"Skills to begin with: {setup.domain}",
        measured=MEASURED.format(level=LEVEL, segment=segment_steps),
        table=MarkdownTable(
            (
                "of",
                "from scratch [steps]",
                "warm [steps]",
                "warm / scratch [95 %]",
                "last, from scratch",
                "last, warm",
                "begun with",
            ),
            [_row(one, by_start[WARM]) for one in comparisons],
        ),
        found={
            "goal": setup.goal,
            "comparisons": [one.as_json() for one in comparisons],
            "trainings": {name: curves.as_json() for name, curves in found.items()},
        },
        draw=lambda figure: draw(figure, comparisons),
        size=(7.0, 0.6 + 2.0 * len(comparisons)),
    )


def compare(
    scratch: Sequence[LearningCurves], warm: Sequence[LearningCurves]
) -> tuple[StartComparison, ...]:
    """Whole plans, then each skill that all trainings have learned.

    Args:
        scratch: Trainings from scratch, one per seed.
        warm: Warm trainings of the same seeds, in the same order.
    """
    names = dict.fromkeys(chain.from_iterable(one.curves for one in (*scratch, *warm)))
    return tuple(
        StartComparison(
            name,
            tuple(one.curves[name] for one in scratch),
            tuple(one.curves[name] for one in warm),
        )
        for name in names
        if all(name in one.curves for one in (*scratch, *warm))
    )


def _row(comparison: StartComparison, warm: Sequence[LearningCurves]) -> list[str]:
    ratio = comparison.ratio
    return [
        comparison.name,
        format_steps_to(comparison.scratch, LEVEL),
        format_steps_to(comparison.warm, LEVEL),
        "-" if ratio is None else f"{'≤ ' if comparison.is_bound else ''}{_ratio(*ratio)}",
        _last(comparison.scratch),
        _last(comparison.warm),
        _begun_with([one.began_with.get(comparison.name, {}) for one in warm]),
    ]


def _last(trainings: Sequence[Sequence[Point]]) -> str:
    return format_spread(Spread.of([one[-1].success for one in trainings]), 2)


def _ratio(value: float, interval: Interval | None) -> str:
    within = "" if interval is None else f" [{interval.low:.2f}, {interval.high:.2f}]"
    return f"{value:.2f}{within}"


def _begun_with(records: Sequence[Mapping[str, Any]]) -> str:
    """The known skill of each warm training, and how well it did before."""
    begun = [f"{one['skill']} {one['success']:.2f}" for one in records if "skill" in one]
    nothing = sum("tried" in one and "skill" not in one for one in records)
    return "; ".join([*begun, *([f"none was worth it: {nothing}"] if nothing else [])]) or "-"


def draw(figure: Figure, comparisons: Sequence[StartComparison]) -> None:
    """Draw the success of every training over environment steps, a panel per measure."""
    panels = figure.subplots(len(comparisons), 1, squeeze=False)[:, 0]
    for axes, one in zip(panels, comparisons, strict=True):
        for colour, (name, trainings) in zip(
            LINES, ((SCRATCH, one.scratch), (WARM, one.warm)), strict=False
        ):
            for number, points in enumerate(trainings):
                axes.plot(
                    [point.steps for point in points],
                    [point.success for point in points],
                    color=colour,
                    marker=".",
                    linewidth=1.0,
                    label=name if number == 0 else None,
                )
        axes.axhline(LEVEL, color="#888888", linewidth=0.6)
        axes.set_ylim(-0.03, 1.03)
        axes.set_ylabel("task progress" if one.name == PLAN else f"success of {one.name}")
        axes.set_xlabel("environment steps")
    panels[0].legend(loc="lower right")


def _summary(found: Data) -> str:
    of = f"{found['goal']}: " if found["goal"] else ""
    return of + ", ".join(map(_compared, found["comparisons"]))


def _compared(one: Data) -> str:
    """A comparison in a few words: success after all steps, and steps where they compare."""
    last = " → ".join(f"{fmean(one['last'][name]):.2f}" for name in (SCRATCH, WARM))
    bound = "≤ " if one["ratio_is_bound"] else ""
    steps = "" if one["ratio"] is None else f", {bound}{one['ratio']:.2f} of the steps"
    return f"{one['of']} {last}{steps}"


@dataclass(frozen=True, kw_only=True)
class WarmStartOptions:
    """Options of this study."""

    domain: DomainName
    begin: Annotated[
        list[Path] | None,
        CommandOption(
            "Skill library whose skills warm trainings may begin from. May be repeated. Default: "
            "Stow Hammer's, for make_coffee.",
            metavar="FOLDER",
            name="--from",
        ),
    ] = None
    goal: Annotated[
        str | None,
        CommandOption(
            "Name of a goal, or atoms in PDDL. A goal of one skill takes minutes. Default: the "
            "domain's first."
        ),
    ] = None
    seeds: Annotated[int, CommandOption("Number of seeds, from 0 on.", least=1)] = 5
    steps: Annotated[
        int | None, CommandOption("Environment steps of a training at most.", least=1)
    ] = None
    set: Annotated[
        list[str] | None,
        CommandOption("Setting to change, as sac.gamma=0.99. May be repeated."),
    ] = None
    preset: Preset = None
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: WarmStartOptions, tell: Tell) -> PreparedStudy:
    """Open the domain and the libraries. Checkpoints are kept until the study is done.

    Raises:
        InvalidParameterError: No library is given, or none is known for the domain.
    """
    require_torch()
    domain = acquirable(options.domain, options.preset)
    libraries = options.begin or [Path(FROM[name]) for name in (domain.name,) if name in FROM]
    if not libraries:
        raise InvalidParameterError(
            f"give a library to begin with, which need not be of {domain.name}: --from FOLDER"
        )
    if not known_skills(libraries, tell):
        raise InvalidParameterError(f"{', '.join(map(str, libraries))}: no skill can be read")
    request = AcquisitionRequest(
        domain, options.output, options.output, goal=options.goal, changes=options.set or (),
        steps=options.steps,
    )  # fmt: skip
    settings = request.chosen_settings()
    segment_steps = settings.segment_steps(horizon_of(domain))
    require_budget(settings, segment_steps)
    setup = AcquisitionSetup(domain.name, domain.preset, request.goal_or_first, settings)
    named = {
        "goal": request.goal_or_first,
        "trainings": 2 * options.seeds,
        "began_with": [library.name for library in libraries],
    }

    def make(runner: JobRunner) -> StudyReport:
        folder = runner.checkpoints(options.output, f"warm_start_{domain.name}")
        report = study(setup, libraries, options.seeds, segment_steps, runner, folder)
        shutil.rmtree(folder, ignore_errors=True)  # the log has every result
        return report

    given = {
        "from": [library.as_posix() for library in libraries] if options.begin else None,
        "goal": options.goal,
        "seeds": options.seeds,
        "steps": options.steps,
        "set": options.set,
        "preset": domain.preset,
        "trainings": None,
        "began_with": None,
    }
    return PreparedStudy({**named, "preset": domain.preset}, make, given)


STUDY = Study(
    "warm_start",
    help="LG-SAIL Fig. 6: environment steps to learn skills, from scratch and from other skills.",
    example="slap study warm_start make_coffee --goal '(IsCabinetOpen cabinet)' --steps 8000",
    options=WarmStartOptions,
    prepare=prepare,
    summary=_summary,
    figures=(
        PaperFigure(
            "LG-SAIL Fig. 6",
            "skills of another domain to begin with",
            ("make_coffee",),
            {"": "curves"},
        ),
    ),
    costs="learning",
)
