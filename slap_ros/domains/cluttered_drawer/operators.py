# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cluttered Drawer: operators (SLAP, appendix).

The paper names the predicates and operators, but says little of what they mean. We want operators
whose effects are exactly what their skills bring about, without conditional effects:

- A block *blocks* a side where it is in the way of a finger there. That is so only while the
  target block stands in the drawer: else taking it out would change atoms about blocks that the
  operator cannot name. For the same reason nothing is said of the sides of other blocks.
- A block that was just lifted off still blocks; it does no longer once it is put down elsewhere.
  So it is Place{Front,Back,Left,Right}Block that clears the side.
- Who takes the target block out from between two blockers frees it of both: they are parameters
  of GraspFrontBack and GraspLeftRight. GraspFullClear needs none.
- Blockers go elsewhere in the drawer. A shortcut that only pushes them aside so reaches the same
  abstract state as skills do.
- The hand is ready to pick a block when it is over it, and HandReadyPick when it is over none: then
  it may be sent to any. Grasping a block ends that it is over it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from types import MappingProxyType

from slap_ros.domains.cluttered_drawer.blocking import SIDES
from slap_ros.domains.cluttered_drawer.features import BLOCK, DRAWER, TABLE, TARGET
from slap_ros.domains.cluttered_drawer.predicates import BY_NAME
from slap_ros.relational import LiftedAtom, LiftedOperator, Variable
from slap_ros.worlds.joint_space.features import ROBOT

AtomPattern = tuple[str, *tuple[Variable, ...]]  # a predicate's name, and variables

R, B, T = Variable("?r", ROBOT), Variable("?b", BLOCK), Variable("?t", TARGET)
S, D = Variable("?s", TABLE), Variable("?d", DRAWER)
B1, B2 = Variable("?b1", BLOCK), Variable("?b2", BLOCK)

EMPTY: AtomPattern = ("GripperEmpty", R)
FREE: AtomPattern = ("HandReadyPick", R)


def _operator(
    name: str,
    parameters: tuple[Variable, ...],
    needs: Sequence[AtomPattern],
    adds: Sequence[AtomPattern],
    deletes: Sequence[AtomPattern],
) -> LiftedOperator:
    """An operator that also needs its parameters to be of their kinds."""
    kinds: list[AtomPattern] = []
    for parameter in parameters:
        if parameter.type.is_a(BLOCK):
            label = "IsTargetBlock" if parameter == T else "NotIsTargetBlock"
            kinds += [("IsBlock", parameter), ("IsMovable", parameter), (label, parameter)]
        else:
            kinds.append((f"Is{parameter.type.name.capitalize()}", parameter))

    def atoms(patterns: Sequence[AtomPattern]) -> frozenset[LiftedAtom]:
        return frozenset(LiftedAtom(BY_NAME[n], tuple(objects)) for n, *objects in patterns)

    return LiftedOperator(name, parameters, atoms([*kinds, *needs]), atoms(adds), atoms(deletes))


def _reach() -> LiftedOperator:
    """Send the hand over any block."""
    reach = _operator(
        "Reach",
        (R, B),
        [EMPTY, FREE, ("NotReadyPick", R, B)],
        [("ReadyPick", R, B)],
        [FREE, ("NotReadyPick", R, B)],
    )
    either = LiftedAtom(BY_NAME["NotIsTargetBlock"], (B,))
    return replace(reach, preconditions=reach.preconditions - {either})


def _grasp(
    name: str,
    block: Variable,
    clear: Sequence[str] = (),
    blocked: Mapping[str, Variable] = MappingProxyType({}),
) -> LiftedOperator:
    """Take a block out from between those that block its other sides."""
    ready: AtomPattern = ("ReadyPick", R, block)
    on: AtomPattern = ("On", block, D)
    free: AtomPattern = ("NotHolding", R, block)
    blocking: list[AtomPattern] = [(f"Blocking{side}", b, block) for side, b in blocked.items()]
    operator = _operator(
        name,
        (R, block, *blocked.values(), D),
        [EMPTY, ready, on, free, *blocking, *((f"{side}Clear", block) for side in clear)],
        [
            ("Holding", R, block),
            ("NotReadyPick", R, block),
            FREE,
            *((f"{side}Clear", block) for side in blocked),
        ],
        [EMPTY, ready, on, free, *blocking],
    )
    # One block can block two sides; then the other skills take it out.
    return replace(operator, inequalities=tuple(combinations(blocked.values(), 2)))


def _place_blocker(side: str) -> LiftedOperator:
    """Put a block that blocked a side elsewhere in the drawer."""
    holding: AtomPattern = ("Holding", R, B)
    blocking: AtomPattern = (f"Blocking{side}", B, T)
    return _operator(
        f"Place{side}Block",
        (R, B, T, D),
        [holding, blocking],
        [EMPTY, ("NotHolding", R, B), ("On", B, D), (f"{side}Clear", T)],
        [holding, blocking],
    )


def _place_target() -> LiftedOperator:
    """Put the target block on the table."""
    holding: AtomPattern = ("Holding", R, T)
    return _operator(
        "PlaceTarget",
        (R, T, S),
        [holding],
        [EMPTY, ("NotHolding", R, T), ("On", T, S)],
        [holding],
    )


OPERATORS = (
    _reach(),
    _grasp("GraspFrontBack", T, ("Front", "Back"), {"Left": B1, "Right": B2}),
    _grasp("GraspLeftRight", T, ("Left", "Right"), {"Front": B1, "Back": B2}),
    _grasp("GraspFullClear", T, SIDES),
    _grasp("GraspNonTarget", B),
    _place_target(),
    *(_place_blocker(side) for side in SIDES),
)
