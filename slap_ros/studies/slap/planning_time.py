# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What shortcuts do to the time that planning takes (SLAP Table 4).

Tasks are planned and not executed. The graph grows with the number of objects.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from statistics import fmean
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.api.command_options import CommandOption
from slap_ros.api.left_out import Tell
from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.evaluation.summary import Spread, format_spread
from slap_ros.studies.comparison import Comparison, PlanningSetup, named_tasks, spread_of
from slap_ros.studies.comparison_options import ChosenComparison, ComparisonOptions
from slap_ros.studies.figures import dodged, label, legend_above, plot_spreads
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.slap.variations import Variation, offered_number, parse_variation
from slap_ros.studies.study import SLAP_DOMAINS, PaperFigure, PreparedStudy, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED = """\
Every task is planned once with the given skills alone and once with shortcuts, and is not executed.
Seconds are for the whole of planning (graph, shortcut edges, search with all rollouts in the
model), on one core of the machine that made this page. They also depend on what else that machine
did. An edge is rolled out at most once from a state; with more than one sample, a shortcut edge is
tried so often each time. Nodes are abstract states; edges are options and shortcuts between them.
Numbers are the mean ± sample standard deviation over tasks: seconds over all tasks, the others over
tasks for which a plan was found.

The paper's figures, for its machine and start states: 15.2 s with shortcuts and 18.4 s without in
Obstacle Tower."""


@dataclass(frozen=True)
class PlanningTrial:
    """What planning for one task took."""

    seed: int
    index: int
    success: bool  # whether there is a plan that reaches the goal in the model
    seconds: float
    edges_rolled_out: int  # zero without a plan, like what follows
    graph_nodes: int
    graph_edges: int
    predicted_steps: int  # environment steps of the plan
    reason: str  # why there is none, unless it is a success


@dataclass(frozen=True)
class PlanningCost:
    """What planning took an approach under one value of the setting."""

    value: str
    approach: str
    planned: tuple[PlanningTrial, ...]  # by seed and index

    @property
    def success_rate(self) -> float:
        """Part of the tasks for which a plan was found."""
        return fmean(one.success for one in self.planned)

    @property
    def seconds(self) -> Spread:
        """Seconds of planning, over all tasks."""
        return Spread.of([one.seconds for one in self.planned])

    def spread(self, quantity: str) -> Spread | None:
        """The spread of a field of :class:`PlanningTrial`, over plans found; None without any."""
        return spread_of([float(getattr(one, quantity)) for one in self.planned if one.success])

    def as_json(self) -> dict[str, Any]:
        """The summary and every trial, for the report's JSON."""
        quantities = {name: self.spread(name) for name in QUANTITIES}
        return {
            "value": self.value,
            "approach": self.approach,
            "success_rate": self.success_rate,
            "planning_seconds": asdict(self.seconds),
            **{name: asdict(spread) if spread else None for name, spread in quantities.items()},
            "tasks": [asdict(one) for one in self.planned],
        }


QUANTITIES = ("edges_rolled_out", "graph_nodes", "graph_edges", "predicted_steps")


def study(comparison: Comparison, variation: Variation) -> StudyReport:
    """Plan under every value of a setting.

    Args:
        comparison: Approaches, and the tasks that they plan for.
        variation: The setting and its values.

    Returns:
        The report.

    Raises:
        InvalidParameterError: The domain has no such setting, or it cannot have that value.
    """
    base = comparison.domain.preset
    planned = [
        (value, comparison.under(variation.preset(base, value))) for value in variation.values
    ]
    costs = [cost for value, under in planned for cost in _measure(value, under)]
    return StudyReport(
        study="planning_time",
        source="SLAP Table 4",
        title=f"Planning time: {comparison.domain.name}",
        measured=MEASURED,
        table=_table(variation, costs),
        found={"setting": variation.setting, "costs": [cost.as_json() for cost in costs]},
        draw=lambda figure: draw(figure, variation, costs),
        size=(8.6, 3.2),
    )


def _measure(value: str, comparison: Comparison) -> Iterator[PlanningCost]:
    """What planning takes under a value, an approach each."""
    jobs = named_tasks(comparison.experiment)
    found = comparison.attempt(
        comparison.domain.preset, plan_once, lambda data: PlanningTrial(**data), jobs
    )
    for approach, planned in found.items():
        yield PlanningCost(value, approach, planned)


def plan_once(setup: PlanningSetup, seed: int, index: int) -> PlanningTrial:
    """Plan for one task.

    Args:
        setup: Choice of domain, planner and approach; they are made in the process that runs this.
        seed: Seed of the task.
        index: Index of the task among those of its seed.

    Returns:
        What planning took, whether or not it found a plan.
    """
    chosen = setup.make_domain()
    task = chosen.task(seed, index)
    state = task.initial_state
    goal = chosen.atom_space(state).mask(task.goal)
    planning = setup.make_planner(chosen, state)
    began = perf_counter()
    try:
        result = planning.plan(state, goal)
    except (UnsolvableError, PlanningLimitError) as error:
        return PlanningTrial(seed, index, False, perf_counter() - began, 0, 0, 0, 0, str(error))
    return PlanningTrial(
        seed,
        index,
        not result.fails,
        perf_counter() - began,
        result.edges_rolled_out,
        result.graph_nodes,
        result.graph_edges,
        result.plan.predicted_steps,
        result.fails,
    )


def _table(variation: Variation, costs: Sequence[PlanningCost]) -> MarkdownTable:
    return MarkdownTable(
        [
            variation.label,
            "approach",
            "planned",
            "planning [s]",
            "edges rolled out",
            "nodes",
            "edges",
        ],
        [
            [
                cost.value,
                label(cost.approach),
                f"{cost.success_rate:.0%}",
                format_spread(cost.seconds, 3),
                *(format_spread(cost.spread(name), 1) for name in QUANTITIES[:3]),
            ]
            for cost in costs
        ],
    )


def draw(figure: Figure, variation: Variation, costs: Sequence[PlanningCost]) -> None:
    """Draw seconds, edges rolled out and edges of the graph beside each other.

    Args:
        figure: Figure to draw into.
        variation: Setting on the horizontal axes, and its values.
        costs: Planning cost of each value of the setting and each approach.
    """
    panels = figure.subplots(1, 3)
    places = range(len(variation.values))
    names = list(dict.fromkeys(cost.approach for cost in costs))
    for number, name in enumerate(names):
        own = [cost for cost in costs if cost.approach == name]
        beside = dodged(places, number, len(names))
        plot_spreads(panels[0], beside, [cost.seconds for cost in own], name)
        for axes, quantity in zip(panels[1:], ("edges_rolled_out", "graph_edges"), strict=True):
            plot_spreads(axes, beside, [cost.spread(quantity) for cost in own], name)
    labels = ("planning [s]", "edges rolled out", "edges of the graph")
    for axes, quantity in zip(panels, labels, strict=True):
        axes.set_xticks(places, variation.values)
        axes.set_xlim(-0.5, len(places) - 0.5)
        axes.set_ylim(bottom=0)
        axes.set_xlabel(variation.label)
        axes.set_ylabel(quantity)
    legend_above(figure, panels[0])


def _summary(found: Data) -> str:
    most = {cost["approach"]: cost for cost in found["costs"]}
    pure, slap = (most[name]["planning_seconds"]["mean"] for name in ("pure_planning", "slap"))
    return f"{pure:.2f} → {slap:.2f} s with {most['slap']['value']} {found['setting']}"


@dataclass(frozen=True, kw_only=True)
class PlanningTimeOptions(ComparisonOptions):
    """Options of this study."""

    vary: Annotated[
        str | None,
        CommandOption(
            "Setting to vary and its values, as setting=value,value,... Default: "
            "the number of obstacles."
        ),
    ] = None


def prepare(options: PlanningTimeOptions, tell: Tell) -> PreparedStudy:
    """Open domain and library, and choose what varies."""
    compared = ChosenComparison.of(options, tell)
    given = options.vary
    variation = parse_variation(given) if given else offered_number(compared.domain)
    return compared.prepare(lambda it: study(it, variation), vary=given)


STUDY = Study(
    "planning_time",
    help="SLAP Table 4: seconds of planning, edges rolled out, size of the graph.",
    example="slap study planning_time obstacle_tower",
    options=PlanningTimeOptions,
    prepare=prepare,
    summary=_summary,
    figures=(
        PaperFigure(
            "SLAP Table 4",
            "seconds of planning",
            SLAP_DOMAINS,
            {
                "obstacle_tower": "18.4 → 15.2 s",
                "cluttered_drawer": "65 → 275 s",
                "cleanup_table": "34 → 201 s",
            },
        ),
    ),
)
