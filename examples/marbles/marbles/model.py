# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Types, predicates, operators, tasks. Lengths in m."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from marbles.environment import GUTTER
from slap_ros.core import Task, VisibleBody
from slap_ros.relational import (
    Column,
    Feature,
    GroundAtom,
    LiftedAtom,
    LiftedOperator,
    Object,
    Predicate,
    State,
    Type,
    Variable,
)
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array

STEP_LIMIT = 150  # environment steps
MARBLE = 0.03  # m, for pictures
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
WOOD, GREY = (0.72, 0.6, 0.47, 1.0), (0.6, 0.6, 0.6, 1.0)
X, Y, Z = (Feature(axis, "m") for axis in ("x", "y", "z"))
ROBOT = Type("robot", (X, Y, Z))
MARBLE_TYPE = Type("marble", (X, Y, Feature("held", "1")))
TYPES = (ROBOT, MARBLE_TYPE)


def _gutter_margin(state: State, marble: Column) -> Array:
    """Distance past the edge; negative while the marble is held, in any place."""
    past: Array = state.stack(marble, "x") - GUTTER
    return np.where(state.stack(marble, "held") > 0.5, np.minimum(past, -1e-6), past)


def _tray_margin(state: State, marble: Column) -> Array:
    before: Array = GUTTER - state.stack(marble, "x") - 1e-9
    return np.where(state.stack(marble, "held") > 0.5, np.minimum(before, -1e-6), before)


def _holding(state: State, _: Column, marble: Column) -> Bools:
    held: Bools = state.stack(marble, "held") > 0.5
    return held


def _hand_empty(state: State, _: Column) -> Bools:
    held = state.stack(state.layout.column_of(MARBLE_TYPE), "held") > 0.5
    empty: Bools = ~held.any(axis=-1, keepdims=True)
    return empty


IN_GUTTER = Predicate.threshold("InGutter", (MARBLE_TYPE,), _gutter_margin)
ON_TRAY = Predicate.threshold("OnTray", (MARBLE_TYPE,), _tray_margin)
HOLDING = Predicate("Holding", (ROBOT, MARBLE_TYPE), _holding)
HAND_EMPTY = Predicate("HandEmpty", (ROBOT,), _hand_empty)
PREDICATES = (IN_GUTTER, ON_TRAY, HOLDING, HAND_EMPTY)


def _operators() -> tuple[LiftedOperator, ...]:
    robot, marble = Variable("?r", ROBOT), Variable("?m", MARBLE_TYPE)
    empty, holding = LiftedAtom(HAND_EMPTY, (robot,)), LiftedAtom(HOLDING, (robot, marble))
    on_tray, in_gutter = (LiftedAtom(p, (marble,)) for p in (ON_TRAY, IN_GUTTER))
    taken, away = frozenset({empty, on_tray}), frozenset({empty, in_gutter})
    return (
        LiftedOperator("Take", (robot, marble), taken, frozenset({holding}), taken),
        LiftedOperator("Drop", (robot, marble), frozenset({holding}), away, frozenset({holding})),
    )


OPERATORS = _operators()


def all_in_the_gutter(state: State) -> frozenset[GroundAtom]:
    """The goal: every marble is in the gutter."""
    return frozenset(IN_GUTTER(marble) for marble in state.layout.of_type(MARBLE_TYPE))


@dataclass(frozen=True)
class Tasks:
    """Marbles somewhere on a part of the tray."""

    marbles: tuple[int, int] = (3, 3)  # how many, inclusive
    x: tuple[float, float] = (0.3, 0.7)
    y: tuple[float, float] = (0.3, 0.7)

    def sample(self, rng: np.random.Generator) -> Task:
        """A task with so many marbles, anywhere within the ranges."""
        count = int(rng.integers(self.marbles[0], self.marbles[1] + 1))
        places = [(rng.uniform(*self.x), rng.uniform(*self.y)) for _ in range(count)]
        return _task(places)


@dataclass(frozen=True)
class Row:
    """Three marbles in a row, always the same."""

    def sample(self, _: np.random.Generator) -> Task:
        """The task with the row."""
        return _task([(0.5, 0.4), (0.5, 0.5), (0.5, 0.6)])


SETTINGS: Mapping[str, Tasks | Row] = {"fair": Tasks(), "paper": Row()}


def _task(places: list[tuple[float, float]]) -> Task:
    features: dict[Object, Mapping[str, float]] = {ROBOT("hand"): {"x": 0.1, "y": 0.5, "z": 0.1}}
    for number, (x, y) in enumerate(places, start=1):
        features[MARBLE_TYPE(f"marble{number}")] = {"x": x, "y": y, "held": 0.0}
    state = State.build(features)
    return Task(state, all_in_the_gutter(state), STEP_LIMIT)


def visible_bodies(state: State) -> list[VisibleBody]:
    """The hand and the marbles, as small boxes, on the tray beside the gutter."""
    shown = [
        VisibleBody("tray", (GUTTER / 2, 0.5, -0.025), UPRIGHT, (GUTTER, 1.0, 0.02), WOOD),
        VisibleBody(
            "gutter", ((GUTTER + 1.0) / 2, 0.5, -0.035), UPRIGHT, (1.0 - GUTTER, 1.0, 0.02), GREY
        ),
    ]
    for obj in state.layout.objects:
        x, y, z = state[obj].tolist()
        is_hand = obj.type == ROBOT
        colour = GREY if is_hand else (0.3, 0.45, 0.75, 1.0)
        place = (x, y, z if is_hand else 0.0)
        shown.append(VisibleBody(obj.name, place, UPRIGHT, (MARBLE,) * 3, colour))
    return shown
