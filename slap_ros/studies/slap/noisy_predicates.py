# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pure planning and SLAP with predicates whose threshold is another in each step (SLAP Table 5)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from math import nan
from statistics import fmean
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from slap_ros.api.command_options import CommandOption
from slap_ros.api.left_out import Tell
from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.statistics import SuccessRate
from slap_ros.evaluation.summary import Spread, format_spread
from slap_ros.skills.domain_choice import open_domain
from slap_ros.studies.comparison import Comparison, PlanningSetup, named_tasks
from slap_ros.studies.comparison_options import ChosenComparison, ComparisonOptions
from slap_ros.studies.figures import dodged, label, legend_above, plot_apart
from slap_ros.studies.replanned_trials import ReplannedTrials
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.slap.variations import Variation
from slap_ros.studies.slap.varying_thresholds import VaryingExecutor
from slap_ros.studies.study import PaperFigure, PreparedStudy, Study, format_steps

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Settings of a domain's presets that are thresholds of its predicates, and nothing else.
THRESHOLDS: Mapping[str, tuple[str, ...]] = {"cluttered_drawer": ("reach", "half_width")}
MEASURED = """\
Pure planning and SLAP solve the same tasks while one threshold is another in each environment step:
the clearance that a finger needs at a side of the target block, so that no other block blocks it.
Its nominal lengths, ahead and to each side, are both multiplied by a number that is drawn for the
step, uniform in the range given below. Monitoring and planning use it alike, and both ways to plan
get the same draws.

In each step, the plan in hand is judged with the threshold of that step. It stays where each of its
edges still ends in the abstract state that the planner foresaw, and not before. Otherwise the
planner plans again, with that threshold. Where it finds no plan, the robot holds still for a step;
the next threshold is another. (A plan that is made afresh in each step, whatever the last one says,
never gets through a skill: halfway through, a skill is in no abstract state from which operators
lead on.) A task is solved if the last plan was carried out to its end and the goal holds in the
world.

Success has Wilson's 95 % interval. Length is the number of environment steps, mean ± sample
standard deviation over solved tasks. Replans are plans that were looked for after the first, and
waits are steps without a plan, both as the mean over all tasks. The paper's figures are from its
own simulator, with its own predicates; what its threshold w is, in metres, we do not know."""


@dataclass(frozen=True)
class ThresholdRange:
    """A range of factors of the nominal threshold, and what the paper found there.

    Args:
        low: Lowest factor.
        high: Highest factor.
        papers: Success of approaches in the paper, by name.
    """

    low: float
    high: float
    papers: Mapping[str, float]

    def __str__(self) -> str:
        """The range as the paper writes it, w being the nominal threshold."""
        if self.low == self.high:
            return "w"
        return f"[{_times_w(self.low)}, {_times_w(self.high)}]"


def _times_w(factor: float) -> str:
    return "w" if factor == 1.0 else f"{factor:g}w"


def _papers(pure_planning: float, slap: float) -> Mapping[str, float]:
    return {"pure_planning": pure_planning, "slap": slap}


RANGES = (
    ThresholdRange(1.0, 1.0, {}),
    ThresholdRange(0.75, 1.0, _papers(1.0, 1.0)),
    ThresholdRange(0.5, 1.0, _papers(0.54, 0.92)),
    ThresholdRange(1.0, 1.5, _papers(1.0, 0.98)),
    ThresholdRange(1.0, 2.0, _papers(0.63, 0.0)),
)


@dataclass(frozen=True)
class ThresholdTrial:
    """What came of one task."""

    seed: int
    index: int
    success: bool  # the plan was carried out, and the goal holds in the world
    plan_length: int  # environment steps executed
    replans: int
    waits: int
    planning_seconds: float
    reason: str


@dataclass(frozen=True)
class ThresholdRow:
    """What came of an approach with thresholds of one range."""

    within: ThresholdRange
    approach: str
    trials: tuple[ThresholdTrial, ...]  # by seed and index

    @property
    def figures(self) -> ReplannedTrials:
        """Success, length and replans of the trials."""
        return ReplannedTrials(self.trials)

    def as_json(self) -> dict[str, Any]:
        """The range, the summary and every trial, for the report's JSON."""
        return {
            "low": self.within.low,
            "high": self.within.high,
            "approach": self.approach,
            **self.figures.as_json(),
            "papers_success_rate": self.within.papers.get(self.approach),
            "attempts": [asdict(one) for one in self.trials],
        }

    def as_cells(self) -> list[str]:
        """Row of the page's table."""
        papers = self.within.papers.get(self.approach)
        figures = self.figures
        return [
            str(self.within),
            label(self.approach),
            str(figures.solved),
            format_spread(figures.length, 1),
            format_spread(figures.replans, 1),
            f"{fmean(one.waits for one in self.trials):.1f}",
            "-" if papers is None else f"{papers:.0%}",
        ]


@dataclass(frozen=True)
class DrawnThresholds:
    """Domains that differ in their thresholds alone.

    Args:
        setup: Choice of the domain, and way to plan.
        within: Range of the factors.
        random: Source of random numbers for the factors.
    """

    setup: PlanningSetup
    within: ThresholdRange
    random: np.random.Generator

    def draw(self) -> Domain:
        """The domain with every threshold multiplied by the next factor."""
        factor = self.random.uniform(self.within.low, self.within.high)
        preset = self.setup.choice.preset
        for setting, nominal in self._nominal.items():
            preset = Variation(setting, ()).preset(preset, repr(factor * nominal))
        return open_domain(replace(self.setup.choice, preset=preset))

    @cached_property
    def _nominal(self) -> dict[str, float]:
        """Nominal value of every threshold, by the name of its setting."""
        nominal = self.setup.make_domain().configuration
        return {name: float(nominal[name]) for name in THRESHOLDS[self.setup.choice.name]}


def study(comparison: Comparison, max_replans: int) -> StudyReport:
    """Measure with thresholds of every range.

    Args:
        comparison: Approaches, and the tasks that they solve.
        max_replans: Plans that are looked for in a task after the first, at most.

    Returns:
        The report.
    """
    rows = [row for within in RANGES for row in _measure(comparison, within, max_replans)]
    columns = ("threshold", "approach", "success [95 %]", "length [steps]", "replans", "waits")
    return StudyReport(
        study="noisy_predicates",
        source="SLAP Table 5",
        title=f"Predicates with a threshold that varies: {comparison.domain.name}",
        measured=MEASURED,
        table=MarkdownTable((*columns, "the paper's success"), [row.as_cells() for row in rows]),
        found={"rows": [row.as_json() for row in rows]},
        draw=lambda figure: draw(figure, rows),
        size=(6.4, 5.0),
    )


def _measure(
    comparison: Comparison, within: ThresholdRange, max_replans: int
) -> list[ThresholdRow]:
    """What came of each approach with thresholds of one range."""
    tasks = named_tasks(comparison.experiment)
    jobs = {name: (within, max_replans, *task) for name, task in tasks.items()}
    found = comparison.attempt(
        f"threshold in {within}", solve_task, lambda data: ThresholdTrial(**data), jobs
    )
    return [ThresholdRow(within, approach, trials) for approach, trials in found.items()]


def solve_task(
    setup: PlanningSetup, within: ThresholdRange, max_replans: int, seed: int, index: int
) -> ThresholdTrial:
    """Solve one task while thresholds vary.

    Args:
        setup: Choice of domain, planner and approach; they are made in the process that runs this.
        within: Range of the factors.
        max_replans: Plans that are looked for after the first, at most.
        seed: Seed of the task; seed and ``index`` together are the seed of the factors.
        index: Index of the task among those of its seed.

    Returns:
        What came of it.
    """
    domain = setup.make_domain()
    task = domain.task(seed, index)
    thresholds = DrawnThresholds(setup, within, np.random.default_rng([seed, index]))
    executor = VaryingExecutor(thresholds.draw, setup.make_planner, max_replans)
    episode, final = executor.run(domain, task)
    reason = episode.failure
    if not reason and not all(atom.holds(final) for atom in task.goal):
        reason = "the plan was carried out, and the goal does not hold"
    return ThresholdTrial(
        seed,
        index,
        not reason,
        episode.steps,
        max(0, episode.replans),
        episode.waits,
        episode.planning_seconds,
        reason,
    )


def draw(figure: Figure, rows: Sequence[ThresholdRow]) -> None:
    """Draw success, length and replans over the ranges; the paper's success as diamonds.

    Args:
        figure: Figure to draw into.
        rows: What was measured, in the order of the ranges.
    """
    success, length, replans = figure.subplots(3, 1, sharex=True, height_ratios=(1.3, 1, 1))
    names = list(dict.fromkeys(one.approach for one in rows))
    ranges = list(dict.fromkeys(str(one.within) for one in rows))
    for number, name in enumerate(names):
        own = [one for one in rows if one.approach == name]
        beside = dodged(range(len(own)), number, len(names))
        _plot_shares(success, beside, [one.figures.solved for one in own], name)
        for place, one in zip(beside, own, strict=True):
            if name in one.within.papers:
                papers = 100.0 * one.within.papers[name]
                success.plot([place], [papers], "D", color="none", markeredgecolor="black")
        _plot_means(length, beside, [one.figures.length for one in own], name)
        _plot_means(replans, beside, [one.figures.replans for one in own], name)
    success.set_ylim(-8, 108)
    success.set_ylabel("success [%];\ndiamonds: the paper's")
    length.set_ylabel("length of solved\ntasks [steps]")
    length.set_ylim(bottom=0)
    replans.set_ylabel("replans")
    replans.set_ylim(bottom=0)
    replans.set_xticks(range(len(ranges)), ranges)
    replans.set_xlabel("range of the threshold in each step; w: nominal")
    legend_above(figure, length)


def _plot_shares(
    axes: Axes, places: Sequence[float], rates: Sequence[SuccessRate], approach: str
) -> None:
    """Draw shares in percent, each with its interval."""
    shares = [100.0 * one.share for one in rates]
    below = [100.0 * max(0.0, one.share - one.interval.low) for one in rates]
    above = [100.0 * max(0.0, one.interval.high - one.share) for one in rates]
    plot_apart(axes, places, shares, (below, above), approach)


def _plot_means(
    axes: Axes, places: Sequence[float], spreads: Sequence[Spread | None], approach: str
) -> None:
    """Draw means, each with a bar of one standard deviation; nothing where there is none."""
    means = [nan if one is None else one.mean for one in spreads]
    bars = [nan if one is None else one.sd for one in spreads]
    plot_apart(axes, places, means, (bars, bars), approach)


def summary(found: Data) -> str:
    """Success and steps of every way to plan in each range, in a few words."""
    figures: dict[str, list[str]] = {}
    for row in found["rows"]:
        within = str(ThresholdRange(row["low"], row["high"], {}))
        steps = format_steps(row["plan_length"])
        figures.setdefault(within, []).append(f"{row['success_rate']:.0%} in {steps}")
    return "; ".join(f"{within}: {' → '.join(both)} steps" for within, both in figures.items())


@dataclass(frozen=True, kw_only=True)
class NoisyPredicatesOptions(ComparisonOptions):
    """Options of this study."""

    max_replans: Annotated[
        int, CommandOption("Maximum number of plans after the first.", least=0)
    ] = 100


def prepare(options: NoisyPredicatesOptions, tell: Tell) -> PreparedStudy:
    """Open domain and library.

    Raises:
        InvalidParameterError: No setting of the domain is a threshold.
    """
    if options.domain not in THRESHOLDS:
        raise InvalidParameterError(
            f"no setting of {options.domain} is a threshold of its predicates; this study is of "
            f"{', '.join(THRESHOLDS)}"
        )
    limit = options.max_replans
    compared = ChosenComparison.of(options, tell, {"max_replans": limit}).ends()
    return compared.prepare(lambda it: study(it, limit))


STUDY = Study(
    "noisy_predicates",
    help="SLAP Table 5: success, length and replans while a threshold varies from step to step.",
    example="slap study noisy_predicates cluttered_drawer",
    options=NoisyPredicatesOptions,
    prepare=prepare,
    summary=summary,
    figures=(
        PaperFigure(
            "SLAP Table 5",
            "a threshold that varies",
            tuple(THRESHOLDS),
            {
                "": "[.75w, w]: 100 → 100%; [.5w, w]: 54 → 92%; [w, 1.5w]: 100 → 98%; "
                "[w, 2w]: 63 → 0%"
            },
        ),
    ),
)
