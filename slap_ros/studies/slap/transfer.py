# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans of the planner's physics, executed by a robot in another: MuJoCo, in closed loop.

Nothing is trained again, and the planner's model stays as it is.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from slap_ros.api.left_out import Tell
from slap_ros.core import Domain
from slap_ros.errors import ErrorCode
from slap_ros.evaluation.experiment import Trial
from slap_ros.evaluation.summary import Summary, format_spread
from slap_ros.relational import State
from slap_ros.robot.measured_world import MeasuredWorld
from slap_ros.robot.mujoco.installed import require_mujoco
from slap_ros.skills.domain_choice import open_domain
from slap_ros.studies.comparison import ApproachResult, Comparison, PlanningSetup, named_tasks
from slap_ros.studies.comparison_options import ChosenComparison, ComparisonOptions
from slap_ros.studies.figures import APPROACH_STYLES, label
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.robot_trials import solve_on_robot
from slap_ros.studies.study import PreparedStudy, Study, format_steps

if TYPE_CHECKING:
    from matplotlib.figure import Figure

OWN, OTHER = "planner's physics", "MuJoCo"
COLUMNS = (
    "physics",
    "approach",
    "success",
    "length [steps]",
    "relative length",
    "replans",
    "not solved",
)
DOT = 14  # area of a dot in the picture, points squared
MEASURED = """\
Pure planning and SLAP solve the same tasks twice: in the physics that the planner plans in, and
on a robot in MuJoCo, which knows nothing of it. There, a closed loop runs as behind the bridge: an
arm that lags follows each command, fingers hold by friction, and what is measured once everything
is at rest is the next state. Poses of objects are measured exactly. The planner plans in its own
physics, and again where a plan diverges. Length is the number of environment steps executed,
mean ± sample standard deviation over solved tasks. Relative length is the mean over that of pure
planning in the same physics, on tasks that both solved. Success is that the goal's atoms hold in
the measured state. A plan that begins with a held block on something begins as if the block were
lifted off it. Nothing was trained again."""


@dataclass(frozen=True)
class PhysicsResult:
    """All approaches in one physics.

    Args:
        physics: Name of the physics.
        measured: What came of the tasks, for each approach.
    """

    physics: str
    measured: tuple[ApproachResult, ...]

    def rows(self) -> list[list[str]]:
        """Rows of a table, one for each approach."""
        return [
            [
                self.physics,
                label(one.summary.approach),
                f"{one.summary.success_rate:.0%}",
                format_spread(one.summary.plan_length, 1),
                _ratio(one.summary.relative_length),
                f"{sum(trial.replans for trial in one.trials)}",
                _causes(one.trials),
            ]
            for one in self.measured
        ]


def study(comparison: Comparison) -> StudyReport:
    """Solve every task in both physics.

    Args:
        comparison: Approaches, and the tasks that they solve.

    Returns:
        The report.
    """
    results = (
        PhysicsResult(OWN, comparison.measure()),
        PhysicsResult(OTHER, measured_by(solve_in_mujoco, "in MuJoCo", comparison)),
    )
    return StudyReport(
        study="transfer",
        source="",
        title=f"Another physics: {comparison.domain.name}",
        measured=MEASURED,
        table=MarkdownTable(COLUMNS, [row for result in results for row in result.rows()]),
        found={result.physics: [one.as_json() for one in result.measured] for result in results},
        draw=lambda figure: draw(figure, results),
        size=(5.2, 3.4),
    )


def measured_by(
    solve: Callable[[PlanningSetup, int, int], Trial], what: str, comparison: Comparison
) -> tuple[ApproachResult, ...]:
    """Solve every task with every approach, in a world that is not the planner's.

    Args:
        solve: Function that solves a task of a seed and an index.
        what: Name of that, of which there is no other in the study.
        comparison: Approaches, and the tasks that they solve.

    Returns:
        What came of each approach.
    """
    jobs = named_tasks(comparison.experiment)
    found = comparison.attempt(what, solve, Trial.from_json, jobs)
    yardstick = found[comparison.approaches[0].name]
    return tuple(
        ApproachResult(Summary.of(comparison.experiment, name, trials, yardstick), trials)
        for name, trials in found.items()
    )


def solve_in_mujoco(setup: PlanningSetup, seed: int, index: int) -> Trial:
    """Plan for a task, and execute the plan on a robot in MuJoCo.

    Args:
        setup: Choice of domain, planner and approach; they are made in the process that runs this.
        seed: Seed of the task.
        index: Index of the task among those of its seed.

    Returns:
        What came of it; a robot that holds after a fault has not solved its task.
    """
    from slap_ros.robot.mujoco.closed_loop import ClosedLoopWorld  # needs an extra

    return solve_measured(setup, seed, index, ClosedLoopWorld)


def solve_measured(
    setup: PlanningSetup, seed: int, index: int, make: Callable[[Domain, State], MeasuredWorld]
) -> Trial:
    """Plan for what is measured on a robot, and execute the plan there.

    Args:
        setup: Choice of domain, planner and approach.
        seed: Seed of the task.
        index: Index of the task among those of its seed.
        make: Makes the robot's world, of a domain and the state that it begins in.

    Returns:
        What came of it.
    """
    domain = open_domain(replace(setup.choice, measured=True))
    return solve_on_robot(domain, domain.task(seed, index), setup.make_planner, make)


def _ratio(relative: float | None) -> str:
    return "-" if relative is None else f"{relative:.2f}"


def _causes(trials: Sequence[Trial]) -> str:
    """Error codes of the tasks that were not solved, the most frequent first."""
    counted = Counter(ErrorCode(t.error_code).name for t in trials if not t.success)
    return ", ".join(f"{count} {name}" for name, count in counted.most_common()) or "-"


def draw(figure: Figure, results: Sequence[PhysicsResult]) -> None:
    """Length of each solved task by physics and approach, and success above.

    Args:
        figure: Figure to draw into.
        results: All approaches in each physics.
    """
    axes = figure.subplots()
    places: dict[float, str] = {}
    for result in results:
        for one in result.measured:
            x = float(len(places))
            rate = one.summary.success_rate
            places[x] = f"{label(one.summary.approach)}\n{result.physics}\n{rate:.0%} solved"
            lengths = [trial.plan_length for trial in one.trials if trial.success]
            colour = APPROACH_STYLES[one.summary.approach].colour
            axes.scatter([x] * len(lengths), lengths, DOT, color=colour, alpha=0.6, linewidths=0)
    axes.set_xticks(list(places), list(places.values()))
    axes.set_xlim(-0.5, len(places) - 0.5)
    axes.set_ylim(bottom=0)
    axes.set_ylabel("length of solved tasks [steps]")


def _summary(found: Data) -> str:
    return "; ".join(f"{physics}: {words(found[physics])}" for physics in (OWN, OTHER))


def words(approaches: Sequence[Mapping[str, Data]]) -> str:
    """Success and length of pure planning and of SLAP, in a few words.

    Args:
        approaches: What the report's JSON has of each approach.
    """
    pure, slap = approaches[0], approaches[-1]
    steps = f"{format_steps(pure['plan_length'])} → {format_steps(slap['plan_length'])} steps"
    return f"{pure['success_rate']:.0%} → {slap['success_rate']:.0%}, {steps}"


@dataclass(frozen=True, kw_only=True)
class TransferOptions(ComparisonOptions):
    """Options of this study."""


def prepare(options: TransferOptions, tell: Tell) -> PreparedStudy:
    """Open domain and library.

    Raises:
        InvalidParameterError: MuJoCo is not installed, or the domain has no such robot.
        OpenLoopOnlyError: The domain's robot is a hand that acts by forces.
    """
    require_mujoco()
    # Not above: the registry of studies is imported where there is no physics.
    from slap_ros.robot.usable_domains import require_robot

    compared = ChosenComparison.of(options, tell).ends()
    require_robot(compared.domain, compared.domain.task(0).initial_state)
    return compared.prepare(study)


STUDY = Study(
    "transfer",
    help="Plans executed in another physics than the planner's: a robot in MuJoCo, in closed loop.",
    example="slap study transfer obstacle_tower",
    options=TransferOptions,
    prepare=prepare,
    summary=_summary,
    costs="planning and simulation",
)
