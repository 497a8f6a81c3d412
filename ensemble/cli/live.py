# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run as it goes, on a terminal: the plan, where in it the robot is, what changed last."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Self

from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from slap_ros.evaluation.atom_names import AtomNames, atom_names, describe
from slap_ros.messages.events import PlanEventKind
from slap_ros.messages.interfaces import ATOMS, PLAN, PLAN_EVENT, STATE
from slap_ros.messages.protocols import (
    AtomsMessage,
    PlanEdgeMessage,
    PlanEventMessage,
    PlanMessage,
    StateMessage,
)
from slap_ros.planning.options import OptionKind

CHANGES = 4  # as many are shown
REFRESH_HZ = 8.0
MARKS = {  # of an edge: sign and style
    PlanEventKind.EDGE_STARTED: ("▶", "bold cyan"),
    PlanEventKind.EDGE_REACHED: ("✓", "green"),
    PlanEventKind.DIVERGED: ("✗", "yellow"),
}
TO_COME = ("·", "dim")
PHASES = {
    PlanEventKind.PLANNING_STARTED: "planning",
    PlanEventKind.PLANNED: "planned",
    PlanEventKind.IMPROVED: "improved",
    PlanEventKind.EDGE_STARTED: "executing",
    PlanEventKind.EDGE_REACHED: "executing",
    PlanEventKind.DIVERGED: "diverged",
    PlanEventKind.SOLVED: "solved",
    PlanEventKind.FAILED: "failed",
}


@dataclass(frozen=True)
class _EdgeProgress:
    """How far an edge has come."""

    kind: PlanEventKind
    start: int  # step
    end: int | None = None  # step; None: under way


@dataclass(frozen=True)
class _AtomChange:
    """Atoms that began to hold, and that ceased to."""

    step: int
    added: AtomNames
    removed: AtomNames

    def __rich__(self) -> Text:
        line = Text.assemble((f"{self.step:5d}  ", "dim"))
        for sign, style, atoms in (("+", "green", self.added), ("−", "red", self.removed)):
            for atom in sorted(atoms):
                line.append(f"{sign} {describe([atom])}  ", style)
        return line


@dataclass
class RunView:
    """What is known of a run so far. Messages of different topics may come in any order.

    It is drawn from another thread meanwhile: what is drawn is replaced, never changed.
    """

    step: int = 0
    phase: str = "waiting"
    plan: PlanMessage | None = None
    edges: dict[tuple[int, int], _EdgeProgress] = field(default_factory=dict)  # by plan and edge
    changes: tuple[_AtomChange, ...] = ()  # the newest last
    atoms: AtomNames | None = None

    def add(self, type_name: str, message: Any) -> None:
        """Take a message of the run."""
        if type_name == PLAN:
            self.plan = message
        elif type_name == PLAN_EVENT:
            self._add_event(message)
        elif type_name == STATE:
            self._add_state(message)
        elif type_name == ATOMS:
            self._add_atoms(message)

    def _add_event(self, message: PlanEventMessage) -> None:
        kind = PlanEventKind(message.kind)
        self.phase = PHASES[kind]
        key = (message.plan_number, message.edge)
        if kind == PlanEventKind.EDGE_STARTED:
            self.edges[key] = _EdgeProgress(kind, message.step)
        elif kind in MARKS and key in self.edges:
            self.edges[key] = _EdgeProgress(kind, self.edges[key].start, message.step)

    def _add_state(self, message: StateMessage) -> None:
        self.step = message.step

    def _add_atoms(self, message: AtomsMessage) -> None:
        atoms = atom_names(message.atoms)
        if self.atoms is not None and atoms != self.atoms:
            change = _AtomChange(message.step, atoms - self.atoms, self.atoms - atoms)
            self.changes = (*self.changes, change)[-CHANGES:]
        self.atoms = atoms

    def __rich__(self) -> Group:
        """As rich prints it."""
        return Group(self._headline(), self._plan_table(), *self.changes)

    def _headline(self) -> Text:
        line = Text.assemble((f"step {self.step}", "bold"), f"  {self.phase}")
        if self.plan is not None:
            again = f", plan {self.plan.number}" if self.plan.number else ""
            goal = describe(atom_names(self.plan.goal))
            line.append(f"  {self.plan.predicted_steps} steps planned{again}, to {goal}", "dim")
        return line

    def _plan_table(self) -> Table:
        table = Table(box=None, show_header=False, padding=(0, 1))
        for column in range(2):
            table.add_column(no_wrap=column == 0)
        table.add_column(justify="right", no_wrap=True)
        if self.plan is not None:
            for number, edge in enumerate(self.plan.edges):
                table.add_row(*self._row(edge, self.edges.get((self.plan.number, number))))
        return table

    def _row(
        self, edge: PlanEdgeMessage, progress: _EdgeProgress | None
    ) -> tuple[Text, Text, Text]:
        sign, style = MARKS[progress.kind] if progress is not None else TO_COME
        name = Text(f"{edge.name}({', '.join(edge.objects)})", style)
        if edge.kind == OptionKind.SHORTCUT.value:
            name.append("  shortcut", "magenta")
        taken = "" if progress is None else f"{(progress.end or self.step) - progress.start} of "
        return Text(sign, style), name, Text(f"{taken}{edge.predicted_steps} steps", style)


class Dashboard:
    """Shows a run on a terminal from its first event on; what nodes say before stays above."""

    def __init__(self, console: Console) -> None:
        self._view = RunView()
        self._live = Live(self._view, console=console, refresh_per_second=REFRESH_HZ)

    def __call__(self, type_name: str, message: Any) -> None:
        """Take a message of the run."""
        self._view.add(type_name, message)
        if type_name == PLAN_EVENT and not self._live.is_started:
            self._live.start(refresh=True)  # at once: a run can be over before the next one

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._live.stop()
