# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans: edges to be executed one after the other."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import ceil
from typing import TYPE_CHECKING

from slap_ros.core.notebook import ShownInNotebooks
from slap_ros.planning.options import Option, OptionKind
from slap_ros.relational import Target

if TYPE_CHECKING:
    from slap_ros.planning.abstract_graph import AbstractGraph
    from slap_ros.planning.planner import Planner


@dataclass(frozen=True)
class PlanEdge:
    """One edge: an option and where it shall end."""

    option: Option
    target: Target
    predicted_steps: int  # environment steps in the planner's model

    def __str__(self) -> str:
        return str(self.option)


@dataclass(frozen=True)
class Plan:
    """Edges in order of execution; empty where the goal already holds."""

    edges: tuple[PlanEdge, ...]

    @property
    def predicted_steps(self) -> int:
        """Environment steps in the planner's model."""
        return sum(edge.predicted_steps for edge in self.edges)

    def __str__(self) -> str:
        """A line per edge with its predicted steps, then their sum."""
        lines = [f"{edge.predicted_steps:5d}  {edge}{_learned(edge)}" for edge in self.edges]
        return "\n".join([*lines, f"{self.predicted_steps:5d}  steps"])


def _learned(edge: PlanEdge) -> str:
    return "  (shortcut)" if edge.option.kind is OptionKind.SHORTCUT else ""


def bound_as_text(bound: float) -> str:
    """A bound with two decimals, rounded up: ``1.00`` is what is proven to be the shortest alone.

    Args:
        bound: Bound of a plan, as :attr:`PlanningResult.bound` has it.
    """
    hundredths = round(100.0 * bound, 6)  # 1.1 is 110 of them, not 110.00000000000001
    return f"{ceil(hundredths) / 100.0:.2f}"


@dataclass(frozen=True)
class PlanOrigin:
    """What made a plan, in the words of its message.

    Args:
        planner: Name of the planner.
        library: Digest of the shortcuts that it knew; empty where there were none.
        samples: Attempts of a shortcut in its model.
    """

    planner: str = ""
    library: str = ""
    samples: int = 0


@dataclass(frozen=True, repr=False)
class PlanningResult(ShownInNotebooks):
    """A plan and the effort of finding it.

    Args:
        plan: What was found.
        graph_nodes: Abstract states in the graph.
        graph_edges: Options in the graph.
        edges_rolled_out: Options simulated in the model.
        fails: Why no plan can be executed in the model, where this one fails there as well; empty
            where it reaches the goal.
        graph: Graph that was searched; None where the planner builds none.
        seconds: Time that planning took, s; 0 where nobody measured it.
        origin: What made it.
        planner: Planner that made it, for a plan in its place where it diverges; None where that
            is not known.
        at_least: Environment steps that any plan takes, as far as is proven; 0 where nothing is.
    """

    plan: Plan
    graph_nodes: int
    graph_edges: int
    edges_rolled_out: int
    fails: str = ""
    graph: AbstractGraph | None = field(default=None, compare=False)
    seconds: float = field(default=0.0, compare=False)
    origin: PlanOrigin = field(default=PlanOrigin(), compare=False)
    planner: Planner | None = field(default=None, compare=False)
    at_least: int = field(default=0, compare=False)

    @property
    def bound(self) -> float | None:
        """How many times as long as the shortest plan it is at most; None where that is not known.

        1 means that it is proven to be the shortest, under the bounds of the skills; see
        :mod:`slap_ros.planning.search`.
        """
        if self.steps <= self.at_least:
            return 1.0
        return self.steps / self.at_least if self.at_least else None

    @property
    def is_proven(self) -> bool:
        """Whether it is proven to be the shortest."""
        return self.bound == 1.0

    @property
    def steps(self) -> int:
        """Environment steps that the plan takes in the planner's model."""
        return self.plan.predicted_steps

    def __str__(self) -> str:
        """The plan, and why it fails in the model where it does."""
        fails = f"\nthis plan fails in the model, near the goal: {self.fails}" if self.fails else ""
        return f"{self.plan}{fails}"
