# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cluttered Drawer: predicates (SLAP, appendix). Margins in m; ``blocking`` says what they mean."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial

import numpy as np

from slap_ros.domains.classifiers import is_a, is_held, is_not_held, none_is_held, strictly
from slap_ros.domains.cluttered_drawer.blocking import (
    SIDES,
    BlockingRelations,
    FingerClearance,
    blocking_relations,
    ready_margins,
)
from slap_ros.domains.cluttered_drawer.features import BLOCK, DRAWER, SURFACE, TABLE, TARGET, THING
from slap_ros.relational import Column, Predicate, State, Type
from slap_ros.relational.predicates import Bools, Classifier, Margin, cache_latest
from slap_ros.relational.state import Array
from slap_ros.worlds.joint_space.features import ROBOT

RelationsOf = Callable[[State], BlockingRelations]


def _is_none(kind: Type) -> Classifier:
    is_one = is_a(kind)
    return lambda state, column: ~is_one(state, column)


def _gripper_empty(state: State, _: Column) -> Bools:
    return none_is_held(state, state.layout.column_of(BLOCK))


def _ready_margin(state: State, _: Column, block: Column) -> Array:
    index, ready = ready_margins(state)
    return ready.take(index.positions(block), axis=-1)


def _not_ready_margin(state: State, robot: Column, block: Column) -> Array:
    return strictly(-_ready_margin(state, robot, block))


def _hand_ready_margin(state: State, _: Column) -> Array:
    ready = ready_margins(state)[1]
    return strictly(-np.maximum.reduce(ready, axis=-1, initial=-1.0, keepdims=True))


def _on_margin(relations: RelationsOf) -> Margin:
    def margin(state: State, block: Column, surface: Column) -> Array:
        index, on, _, _ = relations(state)
        return on.take(index.positions(block, surface), axis=-1)

    return margin


def _blocking_margin(relations: RelationsOf, side: int) -> Margin:
    def margin(state: State, block: Column, blocked: Column) -> Array:
        index, _, blocking, _ = relations(state)
        return blocking[..., side, :].take(index.positions(block, blocked), axis=-1)

    return margin


def _clear_margin(relations: RelationsOf, side: int) -> Margin:
    def margin(state: State, block: Column) -> Array:
        index, _, _, clear = relations(state)
        return clear[..., side, :].take(index.target_positions(block), axis=-1)

    return margin


@lru_cache(maxsize=64)
def predicates(clearance: FingerClearance) -> tuple[Predicate, ...]:
    """All of them; blocks block where they leave less than this clearance."""
    relations = cache_latest(partial(blocking_relations, clearance))
    return (
        Predicate("IsRobot", (ROBOT,), is_a(ROBOT)),
        Predicate("IsBlock", (THING,), is_a(BLOCK)),
        Predicate("IsTable", (SURFACE,), is_a(TABLE)),
        Predicate("IsDrawer", (SURFACE,), is_a(DRAWER)),
        Predicate("IsMovable", (THING,), is_a(BLOCK)),
        Predicate("NotIsMovable", (THING,), _is_none(BLOCK)),
        Predicate("IsTargetBlock", (BLOCK,), is_a(TARGET)),
        Predicate("NotIsTargetBlock", (BLOCK,), _is_none(TARGET)),
        Predicate.threshold("ReadyPick", (ROBOT, BLOCK), _ready_margin),
        Predicate.threshold("NotReadyPick", (ROBOT, BLOCK), _not_ready_margin),
        Predicate.threshold("HandReadyPick", (ROBOT,), _hand_ready_margin),
        Predicate.threshold("On", (BLOCK, SURFACE), _on_margin(relations)),
        Predicate("Holding", (ROBOT, BLOCK), is_held),
        Predicate("NotHolding", (ROBOT, BLOCK), is_not_held),
        Predicate("GripperEmpty", (ROBOT,), _gripper_empty),
        *(
            Predicate.threshold(
                f"Blocking{name}", (BLOCK, TARGET), _blocking_margin(relations, side)
            )
            for side, name in enumerate(SIDES)
        ),
        *(
            Predicate.threshold(f"{name}Clear", (TARGET,), _clear_margin(relations, side))
            for side, name in enumerate(SIDES)
        ),
    )


# Predicates are equal by name and types: these stand for those of any clearance.
BY_NAME = {predicate.name: predicate for predicate in predicates(FingerClearance())}
ON = BY_NAME["On"]
HAND_PREDICATES = frozenset(
    BY_NAME[name] for name in ("ReadyPick", "NotReadyPick", "HandReadyPick")
)
GRASPING = frozenset(BY_NAME[name] for name in ("Holding", "NotHolding", "GripperEmpty"))
