# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A stranger's domain: a broom, which is no gripper, sweeps pucks to the right. Lengths in m.

The skill sweeps one puck at a time. The broom can sweep two.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slap_ros.core import (
    Action,
    ActionSpace,
    Display,
    Domain,
    Execution,
    LearnerInterface,
    Learning,
    Policy,
    Task,
    VisibleBody,
)
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
from slap_ros.relational.state import Array

MAX_STEP = 0.1
FAN = 0.08  # half the width of the broom, along y
LINE = 0.9  # x from which on a puck is swept
ACTIONS = ActionSpace(
    axes=(Feature("x", "m"), Feature("y", "m")),
    low=(-MAX_STEP, -MAX_STEP),
    high=(MAX_STEP, MAX_STEP),
)
PLACE = (Feature("x", "m"), Feature("y", "m"))
BROOM, PUCK = Type("broom", PLACE), Type("puck", PLACE)


def _past(state: State, puck: Column) -> Array:
    past: Array = state.stack(puck, "x") - LINE
    return past


SWEPT = Predicate.threshold("Swept", (PUCK,), _past)
LEFT = Predicate.threshold("Left", (PUCK,), lambda state, puck: -_past(state, puck) - 1e-9)


class SweepingWorld:
    """Pucks before the broom move with it to the right."""

    def __init__(self, state: State) -> None:
        self.state = state

    def reset(self, state: State) -> None:
        self.state = state

    def step(self, action: Action) -> State:
        ACTIONS.check(action)
        (broom,) = self.state.layout.of_type(BROOM)
        before = self.state[broom]
        after = np.clip(before + action, 0.0, 1.0)
        changes = {(broom, "x"): float(after[0]), (broom, "y"): float(after[1])}
        for puck in self.state.layout.of_type(PUCK):
            x, y = self.state[puck].tolist()
            if before[0] <= x <= after[0] and abs(y - after[1]) < FAN:
                changes[(puck, "x")] = float(after[0])
        self.state = self.state.replace(changes)
        return self.state


class Waypoints:
    """Visit points."""

    def __init__(self, broom: Object, points: Sequence[tuple[float, float]]) -> None:
        self._broom, self._points = broom, list(points)

    def __call__(self, state: State) -> Action | None:
        while self._points:
            missing = np.array(self._points[0]) - state[self._broom]
            if np.abs(missing).max() > 1e-9:
                return np.clip(missing, -MAX_STEP, MAX_STEP)
            self._points.pop(0)
        return None


@dataclass(frozen=True)
class Sweep:
    """Back, beside the puck, and to the right."""

    name: str = "Sweep"
    step_limit: int = 60
    least_steps: int = 1

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        return 1

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        broom, puck = objects
        _, y = state[puck].tolist()
        others = [state[o][1] for o in state.layout.of_type(PUCK) if o != puck]
        beside = y - 0.06 if all(other > y for other in others) else y + 0.06
        _, own = state[broom].tolist()
        return Waypoints(broom, [(0.1, own), (0.1, beside), (1.0, beside)])


def all_swept(state: State) -> frozenset[GroundAtom]:
    return frozenset(SWEPT(puck) for puck in state.layout.of_type(PUCK))


def sample_task(rng: np.random.Generator) -> Task:
    ys = sorted(rng.uniform(0.3, 0.7) + np.array([0.0, 0.05]))
    features = {BROOM("broom"): {"x": 0.1, "y": 0.5}}
    features |= {PUCK(f"puck{i}"): {"x": 0.5, "y": float(y)} for i, y in enumerate(ys)}
    state = State.build(features)
    return Task(state, all_swept(state), 120)


def _broom(state: State) -> Array:
    return state.gather(state.layout.column_of(BROOM), ("x", "y"))[:, 0]


def _apart(state: State, thing: Object, column: Column) -> Array:
    way = state.gather(column, ("x", "y")) - state.gather(Column((thing,)), ("x", "y"))
    return np.hypot(way[..., 0], way[..., 1])


def bodies(state: State) -> list[VisibleBody]:
    """Flat boxes: the broom is wide."""
    shown = []
    for obj in state.layout.objects:
        x, y = state[obj].tolist()
        size = (0.02, 2 * FAN, 0.05) if obj.type == BROOM else (0.03, 0.03, 0.03)
        colour = (0.8, 0.3, 0.2, 1.0) if obj.type == BROOM else (0.2, 0.4, 0.8, 1.0)
        shown.append(VisibleBody(obj.name, (x, y, 0.0), (0.0, 0.0, 0.0, 1.0), size, colour))
    return shown


LEARNER_INTERFACE = LearnerInterface(
    hand=_broom,
    robot=lambda _, hand: hand - 0.5,
    objects=lambda state, hand, column: state.gather(column, ("x", "y")) - hand[:, None],
    distance=lambda state, hand, column: np.linalg.norm(
        state.gather(column, ("x", "y")) - hand[:, None], axis=-1
    ),
    separation=_apart,
)


def make() -> Domain:
    """The domain, which has but one preset."""
    parameters = broom, puck = Variable("?b", BROOM), Variable("?p", PUCK)
    del broom
    swept, left = (frozenset({LiftedAtom(p, (puck,))}) for p in (SWEPT, LEFT))
    return Domain(
        name="sweeping",
        preset="default",
        types=(BROOM, PUCK),
        predicates=(SWEPT, LEFT),
        operators=(LiftedOperator("Sweep", parameters, left, swept, left),),
        skills={"Sweep": Sweep()},
        action_space=ACTIONS,
        sample_task=sample_task,
        make_world=SweepingWorld,
        default_goal=all_swept,
        step_limit=120,
        robot_types=frozenset({BROOM}),
        execution=Execution(control_period_s=0.1),
        display=Display(bodies=bodies),
        learning=Learning(LEARNER_INTERFACE),
    )
