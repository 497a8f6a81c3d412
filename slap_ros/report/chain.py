# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A plan as a chain of abstract states: what each edge makes true and makes false."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.bags.recording import RecordedEpisode
from slap_ros.evaluation.atom_names import AtomNames, atom_names
from slap_ros.evaluation.run_trace import RunTrace
from slap_ros.messages.events import ANNOUNCING, PlanEventKind
from slap_ros.messages.protocols import PlanMessage
from slap_ros.planning.options import OptionKind
from slap_ros.report.timeline import call

ENDS = {PlanEventKind.EDGE_REACHED: "reached", PlanEventKind.DIVERGED: "diverged"}


@dataclass(frozen=True)
class ChainEdge:
    """An edge of a plan, and the abstract state to which it leads."""

    text: str  # the option with its objects
    is_shortcut: bool
    added: tuple[str, ...]  # atoms that hold after it and not before
    removed: tuple[str, ...]  # atoms that held before it
    predicted_steps: int
    outcome: str  # reached, diverged, unfinished or not begun


@dataclass(frozen=True)
class PlanChain:
    """A plan from the abstract state in which it was made."""

    number: int  # 0 for the first of a run
    step: int  # at which it was made, from the run's start
    start: tuple[str, ...]  # atoms of its first state that one of its edges changes
    edges: tuple[ChainEdge, ...]
    predicted_steps: int
    improves: bool = False  # whether it is a shorter rest of the plan before it


def chains(trace: RunTrace, episode: RecordedEpisode) -> tuple[PlanChain, ...]:
    """The plans of a run, in order."""
    return tuple(_chain(plan, trace, episode) for plan in trace.plans)


def texts(atoms: AtomNames) -> tuple[str, ...]:
    """Atoms as text, in alphabetical order."""
    return tuple(call(*atom) for atom in sorted(atoms))


def _chain(plan: PlanMessage, trace: RunTrace, episode: RecordedEpisode) -> PlanChain:
    events = [event for event in trace.events if event.plan_number == plan.number]
    announced = next((event for event in events if event.kind in ANNOUNCING), None)
    made = trace.first_step if announced is None else announced.step
    outcomes: dict[int, str] = {}
    for event in events:
        if event.kind == PlanEventKind.EDGE_STARTED:
            outcomes[event.edge] = "unfinished"
        elif event.kind in ENDS:
            outcomes[event.edge] = ENDS[PlanEventKind(event.kind)]
    # Without perceived atoms nothing is known of the first state, nor of what changes from it.
    before = episode.atoms.get(made)
    start, touched, edges = before or frozenset(), AtomNames(), []
    for number, edge in enumerate(plan.edges):
        after = atom_names(edge.expected_atoms)
        known = after if before is None else before
        if getattr(edge, "others_may_appear", False):  # not in bags of version 0.1.0
            after |= known - atom_names(edge.forbidden_atoms)
        touched |= after ^ known
        edges.append(
            ChainEdge(
                text=call(edge.name, tuple(edge.objects)),
                is_shortcut=edge.kind == OptionKind.SHORTCUT.value,
                added=texts(after - known),
                removed=texts(known - after),
                predicted_steps=edge.predicted_steps,
                outcome=outcomes.get(number, "not begun"),
            )
        )
        before = after
    return PlanChain(
        number=plan.number,
        step=made - trace.first_step,
        start=texts(start & touched),
        edges=tuple(edges),
        predicted_steps=plan.predicted_steps,
        improves=announced is not None and announced.kind == PlanEventKind.IMPROVED,
    )
