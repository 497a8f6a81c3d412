# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What noise in perception does to success, length and replanning (SLAP D.3, D.4).

Poses, thresholds and sightings are disturbed in each step independently. Plans begin from what is
perceived and are monitored by it; whether a task is solved is decided in the world.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from slap_ros.api.command_options import CommandOption
from slap_ros.api.left_out import Tell
from slap_ros.evaluation.summary import format_spread
from slap_ros.perception import NoisyPerceiver, Quality
from slap_ros.planning.execution import EpisodeResult, Executor
from slap_ros.planning.partial import PartialPlanner
from slap_ros.studies.comparison import Comparison, PlanningSetup, named_tasks
from slap_ros.studies.comparison_options import ChosenComparison, ComparisonOptions
from slap_ros.studies.figures import dodged, label, legend_above, plot_spreads, plot_values
from slap_ros.studies.replanned_trials import ReplannedTrials
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.study import SLAP_DOMAINS, PaperFigure, PreparedStudy, Study

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

EXACT = "exact"
TURN_FOR_POSITION = 5.0  # rad/m: a detector that is 2 mm off is 10 mrad off
MEASURED = """\
Pure planning and SLAP solve the same tasks while perception has errors. Noise is normal, with the
given standard deviation, and new in each step. Each mm of position noise comes with 5 mrad of
rotation noise, where things can turn. Threshold noise moves the threshold of each predicate of each
atom. A lost sighting leaves an object where it was last seen. A debounced atom changes once
perception has seen the change so many times in a row; a skill then holds at its end for as long.
Where poses have errors, objects at rest are put where physics would have them before planning. The
planner plans again after each divergence, and where it finds no plan for what it sees, up to the
limit given below.

A task is solved if the planner says so and its goal holds in the world. Length is the number of
environment steps executed, mean ± sample standard deviation over solved tasks. Replans are the mean
over all tasks."""


@dataclass(frozen=True)
class NoiseKind:
    """One way in which perception errs, at several levels."""

    name: str  # for an axis, with the unit
    levels: tuple[tuple[str, Quality], ...]


def _position(mm: float) -> Quality:
    return Quality(position_noise_m=mm / 1e3, turn_noise_rad=TURN_FOR_POSITION * mm / 1e3)


NOISE_KINDS = (
    NoiseKind("position noise [mm]", tuple((f"{mm:g}", _position(mm)) for mm in (1.0, 2.0, 5.0))),
    NoiseKind(
        "threshold noise [mm]",
        tuple((f"{mm:g}", Quality(threshold_noise=mm / 1e3)) for mm in (1.0, 2.0, 5.0)),
    ),
    NoiseKind(
        "debounced at 2 mm\nposition noise [times]",
        tuple((str(n), replace(_position(2.0), debounce=n)) for n in (2, 3)),
    ),
    NoiseKind(
        "sightings lost", tuple((f"{share:.0%}", Quality(dropout=share)) for share in (0.3, 0.8))
    ),
)


@dataclass(frozen=True)
class NoisyTrial:
    """What came of one task under noisy perception."""

    seed: int
    index: int
    success: bool  # as the planner said, and in the world
    believed: bool  # as the planner said
    plan_length: int  # environment steps executed
    replans: int
    error: str  # name of the code
    reason: str


@dataclass(frozen=True)
class NoiseLevel:
    """What came of an approach at one level of one kind of noise."""

    kind: str
    value: str
    quality: Quality
    approach: str
    trials: tuple[NoisyTrial, ...]  # by seed and index

    @property
    def figures(self) -> ReplannedTrials:
        """Success, length and replans of the trials."""
        return ReplannedTrials(self.trials)

    def as_json(self) -> dict[str, Any]:
        """The noise, the summary and every trial, for the report's JSON."""
        return {
            "kind": self.kind,
            "value": self.value,
            "quality": {**asdict(self.quality), "hidden": sorted(self.quality.hidden)},
            "approach": self.approach,
            **self.figures.as_json(),
            "attempts": [asdict(one) for one in self.trials],
        }

    def as_row(self) -> list[str]:
        """Row of a table."""
        figures = self.figures
        where = self.kind if self.kind == EXACT else f"{self.kind}: {self.value}"
        return [
            " ".join(where.split()),
            label(self.approach),
            f"{figures.solved.share:.0%}",
            format_spread(figures.length, 1),
            format_spread(figures.replans, 1),
        ]


def study(comparison: Comparison, max_replans: int) -> StudyReport:
    """Measure at every level of every kind of noise.

    Args:
        comparison: Approaches, and the tasks that they solve.
        max_replans: Plans that a task may take after the first.

    Returns:
        The report.
    """
    planned = [(EXACT, EXACT, Quality())]
    planned += [
        (kind.name, value, quality) for kind in NOISE_KINDS for value, quality in kind.levels
    ]
    levels = [level for one in planned for level in _measure(comparison, *one, max_replans)]
    return StudyReport(
        study="perception",
        source="SLAP D.3 and D.4",
        title=f"Noise in perception: {comparison.domain.name}",
        measured=MEASURED,
        table=MarkdownTable(
            ["perception", "approach", "success", "length [steps]", "replans"],
            [level.as_row() for level in levels],
        ),
        found={"levels": [level.as_json() for level in levels]},
        draw=lambda figure: draw(figure, levels),
        size=(1.2 + 2.3 * len(NOISE_KINDS), 5.2),
    )


def _measure(
    comparison: Comparison, kind: str, value: str, quality: Quality, max_replans: int
) -> Iterator[NoiseLevel]:
    """A noise level, with what came of each approach."""
    jobs = {
        name: (quality, max_replans, *task)
        for name, task in named_tasks(comparison.experiment).items()
    }
    what = " ".join(f"{kind} {value}".split())
    found = comparison.attempt(what, solve_perceived, lambda data: NoisyTrial(**data), jobs)
    for approach, trials in found.items():
        yield NoiseLevel(kind, value, quality, approach, trials)


def solve_perceived(
    setup: PlanningSetup, quality: Quality, max_replans: int, seed: int, index: int
) -> NoisyTrial:
    """Solve one task as it is perceived.

    Args:
        setup: Choice of domain, planner and approach; they are made in the process that runs this.
        quality: Quality of the perception.
        max_replans: Largest number of plans after the first.
        seed: Seed of the task; seed and ``index`` together are the seed of the noise.
        index: Index of the task among those of its seed.

    Returns:
        What came of it, in the world and in the planner's belief.
    """
    chosen = setup.make_domain()
    task = chosen.task(seed, index)
    initial = task.initial_state
    space, world = chosen.atom_space(initial), chosen.make_world(initial)
    goal = space.mask(task.goal)
    rng = np.random.default_rng([seed, index])
    planner = PartialPlanner(space, chosen.atom_space, partial(setup.make_planner, chosen))
    planner.prepare(initial)
    episode = Executor(
        chosen,
        planner,
        world,
        space,
        goal,
        task.step_limit,
        max_replans,
        NoisyPerceiver.of(chosen, space, initial, quality, rng),
        quality.debounce_delay_steps,
    ).run()
    return _trial(seed, index, episode, space.abstract(world.state) & goal == goal)


def _trial(seed: int, index: int, episode: EpisodeResult, holds: bool) -> NoisyTrial:
    """What came of an episode, at whose end the goal holds in the world or does not."""
    reason = episode.error.reason or ("" if holds else "solved, as far as was seen, and is not")
    return NoisyTrial(
        seed,
        index,
        episode.success and holds,
        episode.success,
        episode.plan_length,
        episode.replans,
        episode.error.code.name,
        reason,
    )


def draw(figure: Figure, levels: Sequence[NoiseLevel]) -> None:
    """Draw one column per kind of noise: success, length, replans; at its left exact perception."""
    exact = [one for one in levels if one.kind == EXACT]
    grid = figure.subplots(
        3, len(NOISE_KINDS), squeeze=False, sharex="col", sharey="row", height_ratios=(1, 1.6, 1.2)
    )
    for column, kind in zip(grid.T, NOISE_KINDS, strict=True):
        own = [one for one in levels if one.kind == kind.name]
        _plot(column, exact, [EXACT])
        _plot(column, own, [value for value, _ in kind.levels])
        for axes in column:
            axes.axvspan(-0.5, 0.5, color="#f1f3f5", zorder=0)
        ticks = [EXACT, *(value for value, _ in kind.levels)]
        column[-1].set_xticks(range(len(ticks)), ticks)
        column[-1].set_xlim(-0.5, len(kind.levels) + 0.5)
        column[-1].set_xlabel(kind.name)
    for axes, quantity in zip(
        grid[:, 0], ("success [%]", "length of solved\ntasks [steps]", "replans"), strict=True
    ):
        axes.set_ylabel(quantity)
    grid[0, 0].set_ylim(-8, 108)
    grid[1, 0].set_ylim(bottom=0)
    grid[2, 0].set_ylim(bottom=0)
    legend_above(figure, grid[1, 0])


def _plot(column: Sequence[Axes], levels: Sequence[NoiseLevel], values: Sequence[str]) -> None:
    """Draw approaches beside each other; exact perception at 0, the others from 1 on."""
    names = list(dict.fromkeys(one.approach for one in levels))
    places = range(len(values)) if values == [EXACT] else range(1, len(values) + 1)
    for number, name in enumerate(names):
        own = [one for one in levels if one.approach == name]
        beside = dodged(places, number, len(names))
        plot_values(column[0], beside, [100.0 * one.figures.solved.share for one in own], name)
        plot_spreads(column[1], beside, [one.figures.length for one in own], name)
        plot_spreads(column[2], beside, [one.figures.replans for one in own], name)


def _summary(found: Data) -> str:
    least = {}
    for name in ("pure_planning", "slap"):
        rates = [one["success_rate"] for one in found["levels"] if one["approach"] == name]
        least[name] = f"{min(rates):.0%}"
    return f"success at worst {least['pure_planning']} → {least['slap']}"


@dataclass(frozen=True, kw_only=True)
class PerceptionOptions(ComparisonOptions):
    """Options of this study."""

    max_replans: Annotated[
        int, CommandOption("Maximum number of plans after the first.", least=0)
    ] = 10


def prepare(options: PerceptionOptions, tell: Tell) -> PreparedStudy:
    """Open domain and library."""
    limit = options.max_replans
    compared = ChosenComparison.of(options, tell, {"max_replans": limit}).ends()
    return compared.prepare(lambda it: study(it, limit))


STUDY = Study(
    "perception",
    help="SLAP D.3, D.4: success, length and replans under several errors of perception.",
    example="slap study perception cluttered_drawer",
    options=PerceptionOptions,
    prepare=prepare,
    summary=_summary,
    figures=(
        PaperFigure(
            "SLAP Table 5, D.3, D.4",
            "predicates and perception that err",
            SLAP_DOMAINS,
        ),
    ),
)
