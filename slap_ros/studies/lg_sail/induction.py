# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How many demonstrations operators take: induced from few and from many, and planned with.

Operators are induced from demonstrations of the training goal alone, and have to lead to every goal
that the domain has a name for, in as few operators as those that people wrote.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import permutations
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.acquisition.proposals.induction import (
    InducedOperator,
    hold_steps_of,
    induce_operators,
)
from slap_ros.api.command_options import CommandOption, DomainName, Jobs, Preset
from slap_ros.api.left_out import Tell
from slap_ros.core import Domain, Task
from slap_ros.drawing.palette import MUTED
from slap_ros.errors import InvalidParameterError, PlanningLimitError, UnsolvableError
from slap_ros.planning.astar import find_shortest_sequence
from slap_ros.relational import LiftedAtom, LiftedOperator, Variable, ground_operators
from slap_ros.skills.demonstrator import record_traces
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.studies.figures import LINES
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.domain_choices import with_demonstrator
from slap_ros.studies.options import FRESH_SEED, RESULTS, FreshSeed, Output
from slap_ros.studies.results import MarkdownTable, StudyReport
from slap_ros.studies.row_figures import name_rows
from slap_ros.studies.study import PreparedStudy, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED = """\
The domain's demonstrator records demonstrations of the training goal ({training}), on tasks that
neither this page nor training uses elsewhere. Operators are induced only from the atoms that hold
in each step, without names, objects or the ends of scripts. A change counts if some atoms are
added, and if atoms then stay for {hold_steps} environment steps. A* plans with these operators for
{tasks} fresh tasks of each goal. A task counts if its plan has as few operators as the shortest
plan with the hand-written operators, which has the paper's length. Tasks without a plan by the
hand-written operators are left out. *Extra preconditions* are those that the hand-written operator
with the same effects does not have."""


@dataclass(frozen=True)
class GoalPlans:
    """What operators are worth for a goal.

    Args:
        goal: Name of the goal; empty for the goal that comes with each task.
        lengths: Number of operators of a shortest plan, by task; None where there is no plan.
        shortest: Number of operators of a shortest plan with hand-written operators, by task; None
            where there is no plan.
    """

    goal: str
    lengths: tuple[int | None, ...]
    shortest: tuple[int | None, ...]

    @property
    def pairs(self) -> list[tuple[int | None, int]]:
        """Both lengths of the tasks for which hand-written operators have a plan."""
        both = zip(self.lengths, self.shortest, strict=True)
        return [(ours, best) for ours, best in both if best is not None]

    @property
    def as_short(self) -> int:
        """Number of tasks whose plan has as few operators as with hand-written ones."""
        return sum(ours == best for ours, best in self.pairs)


@dataclass(frozen=True)
class Induction:
    """Operators from so many demonstrations, and what they are worth.

    Args:
        demonstrations: Number of demonstrations.
        operators: Operators as text, with preconditions and effects.
        too_many: Preconditions that hand-written operators with the same effects lack, by operator.
        goals: Plans with the operators, by goal.
    """

    demonstrations: int
    operators: tuple[dict[str, Any], ...]
    too_many: dict[str, tuple[str, ...]]
    goals: tuple[GoalPlans, ...]

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Induction:
        """The induction that :func:`dataclasses.asdict` made such data of."""
        goals = tuple(
            GoalPlans(one["goal"], tuple(one["lengths"]), tuple(one["shortest"]))
            for one in data["goals"]
        )
        too_many = {name: tuple(atoms) for name, atoms in data["too_many"].items()}
        return cls(data["demonstrations"], tuple(data["operators"]), too_many, goals)

    @property
    def complete(self) -> bool:
        """Whether every task of every goal has a plan as short as with hand-written operators."""
        return all(goal.as_short == len(goal.pairs) for goal in self.goals)

    def as_json(self) -> dict[str, Any]:
        """Operators, plans and superfluous preconditions."""
        return {
            "demonstrations": self.demonstrations,
            "complete": self.complete,
            "operators": list(self.operators),
            "too_many": {name: list(atoms) for name, atoms in self.too_many.items()},
            "goals": [{**asdict(goal), "as_short": goal.as_short} for goal in self.goals],
        }

    def as_row(self) -> list[str]:
        """Row of a table."""
        dropped = "; ".join(f"{name}: {', '.join(a)}" for name, a in self.too_many.items())
        return [
            str(self.demonstrations),
            str(len(self.operators)),
            *(_cell(goal) for goal in self.goals),
            dropped or "none",
        ]


def _cell(goal: GoalPlans) -> str:
    """Share of the tasks whose plan is as short as possible, and how long the others' plans are."""
    found = [(ours, best) for ours, best in goal.pairs if ours is not None]
    parts = [f"{goal.as_short} of {len(goal.pairs)}"]
    if missing := len(goal.pairs) - len(found):
        parts.append(f"{missing} no plan")
    if longer := [(ours, best) for ours, best in found if ours != best]:
        ours, best = max(longer)
        parts.append(f"{ours} operators, not {best}")
    if beyond := len(goal.lengths) - len(goal.pairs):
        parts.append(f"{beyond} left out")
    return "; ".join(parts)


def study(
    choice: DomainChoice, counts: Sequence[int], tasks: int, seed: int, runner: JobRunner
) -> StudyReport:
    """Induce operators from so many demonstrations, and plan with them.

    Args:
        choice: Domain with its demonstrator for skills.
        counts: Numbers of demonstrations; each uses the first of them.
        tasks: Number of tasks to plan for, per goal.
        seed: Seed of the tasks to plan for.
        runner: Runner of the jobs, one per count.

    Returns:
        The report.

    Raises:
        InvalidParameterError: The domain has no demonstrator, or a count is below 1.
        UnsolvableError: The demonstrator fails too often.
    """
    if not counts or min(counts) < 1:
        raise InvalidParameterError(
            f"counts of demonstrations are at least 1, not {', '.join(map(str, counts)) or 'none'}"
        )
    jobs = {f"{count} demonstrations": (choice, count, tasks, seed) for count in sorted(counts)}
    title = f"{choice.name}: demonstrations and plans"
    found = runner.run(title, induce, Induction.from_json, jobs)
    return _report(choice, tuple(found.values()), tasks)


def induce(choice: DomainChoice, count: int, tasks: int, seed: int) -> Induction:
    """Operators from some demonstrations, and what they are worth.

    Args:
        choice: Domain with its demonstrator for skills.
        count: Number of demonstrations.
        tasks: Number of tasks to plan for, per goal.
        seed: Seed of the tasks to plan for.

    Returns:
        What came of it.

    Raises:
        UnsolvableError: The demonstrator fails too often.
    """
    domain = open_domain(choice)
    traces = record_traces(domain, count, _training_goal(domain))
    induced = induce_operators(traces, hold_steps_of(domain.execution.control_period_s))
    operators = tuple(one.operator for one in induced)
    posed = {
        goal: [domain.task(seed, index, goal or None) for index in range(tasks)]
        for goal in domain.goals or ("",)
    }
    goals = tuple(
        GoalPlans(
            goal,
            tuple(_lengths(operators, domain, own)),
            tuple(_lengths(domain.operators, domain, own)),
        )
        for goal, own in posed.items()
    )
    too_many = {
        operator.name: tuple(sorted(map(str, rest)))
        for operator in operators
        if (rest := _too_many(operator, domain.operators))
    }
    return Induction(count, tuple(map(_operator_data, induced)), too_many, goals)


def _training_goal(domain: Domain) -> str | None:
    """The goal of which there are demonstrations; None for the goals that come with tasks."""
    return next(iter(domain.goals), None)


def _too_many(operator: LiftedOperator, by_hand: Sequence[LiftedOperator]) -> frozenset[LiftedAtom]:
    """Preconditions that a hand-written operator with the same effects does not have."""
    for other in by_hand:
        for order in permutations(operator.parameters, len(other.parameters)):
            names = dict(zip(other.parameters, order, strict=True))

            def renamed(
                atoms: frozenset[LiftedAtom], names: dict[Variable, Variable] = names
            ) -> frozenset[LiftedAtom]:
                return frozenset(
                    LiftedAtom(atom.predicate, tuple(names[v] for v in atom.variables))
                    for atom in atoms
                )

            if (renamed(other.add_effects), renamed(other.delete_effects)) == (
                operator.add_effects,
                operator.delete_effects,
            ):
                return operator.preconditions - renamed(other.preconditions)
    return frozenset()


def _lengths(
    operators: Sequence[LiftedOperator], domain: Domain, tasks: Sequence[Task]
) -> list[int | None]:
    """Operators in a shortest plan for each task."""
    lengths: list[int | None] = []
    for task in tasks:
        space = domain.atom_space(task.initial_state)
        start = space.abstract(task.initial_state)
        grounds = ground_operators(operators, space)
        try:
            lengths.append(len(find_shortest_sequence(start, space.mask(task.goal), grounds)))
        except (UnsolvableError, PlanningLimitError):
            lengths.append(None)
    return lengths


def _operator_data(induced: InducedOperator) -> dict[str, Any]:
    operator = induced.operator
    return {
        "operator": str(operator),
        "preconditions": sorted(map(str, operator.preconditions)),
        "delete_effects": sorted(map(str, operator.delete_effects)),
        "add_effects": sorted(map(str, operator.add_effects)),
        "seen": induced.seen,
    }


def _report(choice: DomainChoice, found: Sequence[Induction], tasks: int) -> StudyReport:
    domain = open_domain(choice)
    hold_steps = hold_steps_of(domain.execution.control_period_s)
    goals = [goal.goal or "(the task's own)" for goal in found[0].goals]
    return StudyReport(
        study="induction",
        source="",
        title=f"Operators from demonstrations: {choice.name}",
        measured=MEASURED.format(
            training=_training_goal(domain) or "the tasks' own", tasks=tasks, hold_steps=hold_steps
        ),
        table=MarkdownTable(
            ["demonstrations", "operators", *goals, "extra preconditions"],
            [one.as_row() for one in found],
        ),
        found={"inductions": [one.as_json() for one in found]},
        draw=lambda figure: draw(figure, found),
        size=(7.6, 1.6 + 0.3 * len(goals)),
    )


def draw(figure: Figure, found: Sequence[Induction]) -> None:
    """Draw the share of tasks with a plan that is short enough, by goal and demonstrations."""
    axes = figure.subplots()
    goals = [goal.goal or "task's own" for goal in found[0].goals]
    for number, one in enumerate(found):
        places = [i + 0.2 * (number - (len(found) - 1) / 2) for i in range(len(goals))]
        shares = [100 * goal.as_short / max(1, len(goal.pairs)) for goal in one.goals]
        name = f"{one.demonstrations} demonstration{'s' * (one.demonstrations > 1)}"
        axes.plot(shares, places, "o", color=LINES[number % len(LINES)], label=name)
    axes.axvline(100, color=MUTED, linewidth=1)
    name_rows(axes, goals)
    axes.set_xlim(-3, 103)
    axes.set_xlabel("tasks with a plan as short as with hand-written operators [%]")
    figure.legend(loc="outside upper center", ncols=len(found))


@dataclass(frozen=True, kw_only=True)
class InductionOptions:
    """Options of this study."""

    domain: DomainName
    demonstrations: Annotated[
        list[int] | None,
        CommandOption("Number of demonstrations. May be repeated. Default: 1, 3 and 10."),
    ] = None
    tasks: Annotated[int, CommandOption("Number of tasks to plan per goal.", least=1)] = 20
    seed: FreshSeed = FRESH_SEED
    preset: Preset = None
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: InductionOptions, _: Tell) -> PreparedStudy:
    """Open the domain with its demonstrator."""
    choice = with_demonstrator(options.domain, options.preset)
    counts = options.demonstrations or [1, 3, 10]
    settings = {
        "preset": choice.preset,
        "tasks": options.tasks,
        "seed": options.seed,
        "demonstrations": counts,
    }
    return PreparedStudy(
        settings,
        lambda runner: study(choice, counts, options.tasks, options.seed, runner),
        {"demonstrations": counts},
    )


STUDY = Study(
    "induction",
    help="Operators from demonstrations: whether A* finds equally short plans for every goal.",
    example="slap study induction stow_hammer --demonstrations 3",
    options=InductionOptions,
    prepare=prepare,
)
