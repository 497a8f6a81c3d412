# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The FF heuristic on ground PDDL tasks, whose relaxed plans follow the additive heuristic.

Relaxed plans are those of Hoffmann and Nebel, "The FF Planning System" (JAIR 14, 2001): operators
delete nothing. Each atom is supported by the operator that reaches it most cheaply by the additive
heuristic h_add (Bonet and Geffner, "Planning as heuristic search", AIJ 129, 2001), as Keyder and
Geffner propose ("Heuristics for planning with action costs revisited", ECAI 2008).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slap_ros.planning.relaxation import Costs, Indices, RelaxedTask, Truth


@dataclass(frozen=True, slots=True)
class RelaxedPlanEstimate:
    """A plan for the task in which operators delete nothing.

    Args:
        cost: Cost of the plan: an estimate of what it takes to reach the goal.
        helpful: Indices of the plan's actions that are applicable now.
    """

    cost: float
    helpful: Indices


def relaxed_plan(relaxed: RelaxedTask, truth: Truth) -> RelaxedPlanEstimate | None:
    """A plan for the relaxed task; None where there is none, hence none for the task either.

    Args:
        relaxed: Task without deletes.
        truth: State to start from.
    """
    atoms, operators = relaxed.reach(truth, np.add)
    if not np.isfinite(atoms[relaxed.goal]).all():
        return None
    chosen = np.array(sorted(_supporters(relaxed, atoms, operators)), dtype=np.intp)
    _, first = np.unique(relaxed.action[chosen], return_index=True)
    ready = operators[chosen] == relaxed.costs[chosen]  # what they need costs nothing
    # np.unique does the same and imports numpy.ma, a twentieth of what a small problem takes.
    helpful = np.array(sorted(set(relaxed.action[chosen[ready]].tolist())), dtype=np.intp)
    cost = relaxed.costs[chosen[first]].sum()  # several effects of one action cost it once
    return RelaxedPlanEstimate(float(cost), helpful[helpful >= 0])


def _supporters(relaxed: RelaxedTask, atoms: Costs, operators: Costs) -> set[int]:
    """The cheapest supporters of the goal's atoms, of what these need, and so on."""
    stack = [int(bit) for bit in relaxed.goal if atoms[bit] > 0]
    supported, chosen = set(stack), set()
    adders = relaxed.adders
    while stack:
        bit = stack.pop()
        candidates = adders.operators[adders.start[bit] : adders.end[bit]]
        number = int(candidates[operators[candidates].argmin()])
        if number in chosen:
            continue
        chosen.add(number)
        for needed in relaxed.needed[number]:
            if atoms[needed] > 0 and needed not in supported:
                supported.add(needed)
                stack.append(needed)
    return chosen
