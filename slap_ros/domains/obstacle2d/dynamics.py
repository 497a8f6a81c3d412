# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle 2D: the world. Quasi-static, the same arithmetic for one world and for many.

The gripper is a square of a block's size. It grasps a block from above and carries it rigidly.
What is lower of the two (the carried block, or else the gripper) pushes the blocks that stand
in its way along the table, and they push each other, up to the walls. Nothing can be stacked:
a carried block is let go only over free table, and then stands there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Action, ActionSpace, GripperAxis
from slap_ros.domains.obstacle2d.model import BLOCK, BLOCK_SIZE, ROBOT, X, Y
from slap_ros.errors import InvalidStateError
from slap_ros.relational import Feature, Layout, State
from slap_ros.relational.state import Array
from slap_ros.tiered_function import TieredFunction

MAX_STEP = 0.1  # m, displacement along each axis in one step
ACTION_SPACE = ActionSpace(
    axes=(X, Y, Feature("gripper", "1")),
    low=(-MAX_STEP, -MAX_STEP, -1.0),
    high=(MAX_STEP, MAX_STEP, 1.0),
    gripper=GripperAxis("gripper"),
)
CONTROL_PERIOD = 0.1  # s, nominal: the world has no dynamics
CLOSE, OPEN = 0.5, -0.5  # gripper commands beyond which it closes or opens
ROUNDING = 1e-9  # m, overlap that does not push
CONTACT = 1e-6  # m, overlap below which bodies only touch


@dataclass(frozen=True)
class GraspTolerance:
    """How far from a block the gripper still grasps it, m.

    Args:
        reach: Sideways, between their middles.
        gap: Height of the gripper over the block.
    """

    reach: float = 0.05
    gap: float = 0.02


GRASP_TOLERANCE = GraspTolerance()


@dataclass(frozen=True)
class _Columns:
    """Where the moving features lie in the state array."""

    robot: NDArray[np.intp]  # (2,): x, y
    x: NDArray[np.intp]  # (blocks,)
    y: NDArray[np.intp]
    held: NDArray[np.intp]


@lru_cache(maxsize=1024)
def _columns(layout: Layout) -> _Columns:
    (robot,) = layout.of_type(ROBOT)
    blocks = layout.of_type(BLOCK)
    return _Columns(
        np.array([layout.column(robot, "x"), layout.column(robot, "y")]),
        *(layout.columns(blocks, feature) for feature in ("x", "y", "held")),
    )


def step(
    layout: Layout, data: Array, actions: Array, tolerance: GraspTolerance = GRASP_TOLERANCE
) -> Array:
    """Step many worlds of the same objects once: the gripper acts, then the robot moves.

    Args:
        layout: The worlds' objects.
        data: States, shape (worlds, layout.size). Not changed.
        actions: Action of each world, shape (worlds, 3), within the action space.
        tolerance: How far from a block the gripper still grasps it, m.

    Returns:
        The next states, shape (worlds, layout.size).
    """
    columns = _columns(layout)
    robot = data[:, columns.robot]
    x, y, held = data[:, columns.x], data[:, columns.y], data[:, columns.held] > 0.5

    graspable = _graspable(robot, x, y, tolerance)
    y, held = _grip(graspable, x, y, held, actions[:, 2])
    robot, x, y = _move(robot, x, y, held, actions[:, :2])

    after = data.copy()
    after[:, columns.robot] = robot
    after[:, columns.x], after[:, columns.y], after[:, columns.held] = x, y, held
    return after


def _graspable(robot: Array, x: Array, y: Array, tolerance: GraspTolerance) -> NDArray[np.bool_]:
    """The block that the gripper is over, if there is one: the nearest of those within reach."""
    sideways = np.abs(x - robot[:, :1])
    gap = robot[:, 1:] - y - BLOCK_SIZE
    within = (sideways <= tolerance.reach) & (gap >= -CONTACT) & (gap <= tolerance.gap)
    nearest = np.argmin(np.where(within, sideways, 9.0), axis=1)[:, None]
    graspable: NDArray[np.bool_] = within & (np.arange(x.shape[1]) == nearest)
    return graspable


def _grip(
    graspable: NDArray[np.bool_], x: Array, y: Array, held: NDArray[np.bool_], command: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """Grasp the block below the gripper, or let the carried one down onto free table."""
    holding = held.any(axis=1)
    grasped = graspable & ((command > CLOSE) & ~holding)[:, None]

    carried_x = np.sum(x * held, axis=1, keepdims=True)
    below = (np.abs(x - carried_x) < BLOCK_SIZE - CONTACT) & ~held
    released = held & ((command < OPEN) & ~below.any(axis=1))[:, None]
    return np.where(released, 0.0, y), (held & ~released) | grasped


def _move(
    robot: Array, x: Array, y: Array, held: NDArray[np.bool_], displacement: Array
) -> tuple[Array, Array, Array]:
    """Move sideways, pushing, then up or down until something is touched."""
    holding = held.any(axis=1)
    # The pusher is the lower of gripper and carried block, at a fixed offset from the gripper.
    offset_x = np.where(holding, np.sum(x * held, axis=1) - robot[:, 0], 0.0)
    offset_y = np.where(holding, np.sum(y * held, axis=1) - robot[:, 1], 0.0)
    start = robot[:, 0] + offset_x
    height = robot[:, 1] + offset_y

    pushing = height < BLOCK_SIZE - CONTACT
    right = (x > start[:, None]) & ~held & pushing[:, None]
    left = ~right & ~held & pushing[:, None]
    lowest = np.maximum(BLOCK_SIZE * left.sum(axis=1), np.maximum(offset_x, 0.0))
    highest = np.minimum(1.0 - BLOCK_SIZE * right.sum(axis=1), 1.0 + np.minimum(offset_x, 0.0))
    # A limit that is already passed, by rounding, keeps the pusher where it is. Working with the
    # distance gone, not the place reached, leaves a robot that stands still exactly where it is.
    gone_x = np.clip(
        displacement[:, 0], np.minimum(lowest - start, 0.0), np.maximum(highest - start, 0.0)
    )
    pusher = start + gone_x
    x = _push(x, right, pusher)
    x = -_push(-x, left, -pusher)

    under = (np.abs(x - pusher[:, None]) < BLOCK_SIZE - CONTACT) & ~held
    floor = np.where(under.any(axis=1), BLOCK_SIZE, 0.0)
    ceiling = 1.0 + offset_y
    gone_y = np.clip(
        displacement[:, 1], np.minimum(floor - height, 0.0), np.maximum(ceiling - height, 0.0)
    )

    x = np.where(held, x + gone_x[:, None], x)
    y = np.where(held, y + gone_y[:, None], y)
    return robot + np.stack([gone_x, gone_y], axis=1), x, y


def _push(x: Array, pushable: NDArray[np.bool_], pusher: Array) -> Array:
    """Shift blocks to the right of the pusher until none overlaps it or its neighbour."""
    x = x.copy()
    rows = np.arange(len(x))
    edge = pusher + BLOCK_SIZE
    for block in np.argsort(np.where(pushable, x, np.inf), axis=1, kind="stable").T:
        mine = pushable[rows, block]
        here = x[rows, block]
        moved = np.where(edge > here + ROUNDING, edge, here)
        x[rows, block] = np.where(mine, moved, here)
        edge = np.where(mine, moved + BLOCK_SIZE, edge)
    return x


def require_valid(state: State) -> None:
    """Refuse states that no scene can be in.

    Raises:
        InvalidStateError: Not one robot, no block, two blocks held, bodies outside the unit
            square, a block in the air, or blocks inside one another.
    """
    layout = state.layout
    if len(layout.of_type(ROBOT)) != 1 or not layout.of_type(BLOCK):
        raise InvalidStateError("a scene of obstacle2d has one robot and at least one block")
    columns = _columns(layout)
    x, y, held = (state.data[c] for c in (columns.x, columns.y, columns.held))
    names = [block.name for block in layout.of_type(BLOCK)]
    if np.sum(held > 0.5) > 1:
        raise InvalidStateError("the gripper holds one block at most")
    places = np.concatenate([state.data[columns.robot], x, y])
    if places.min() < -CONTACT or places.max() > 1.0 + CONTACT:
        raise InvalidStateError("robot and blocks have their centres within the unit square")
    for i, name in enumerate(names):
        if held[i] < 0.5 and y[i] > CONTACT:
            raise InvalidStateError(f"{name} is neither held nor on the table (y = {y[i]} m)")
        for j in range(i):
            if max(abs(x[i] - x[j]), abs(y[i] - y[j])) < BLOCK_SIZE - CONTACT:
                raise InvalidStateError(f"{name} and {names[j]} are inside one another")


def settle(state: State) -> State:
    """A measured state as it can be: blocks on the table, side by side, between the walls."""
    columns = _columns(state.layout)
    data = state.data.copy()
    x, held = data[columns.x], data[columns.held] > 0.5
    data[columns.y] = np.where(held, data[columns.y], 0.0)
    order = [i for i in np.argsort(x, kind="stable") if not held[i]]
    data[columns.x[order]] = _apart(x[order])
    return State(state.layout, data)


def _apart(places: Array) -> Array:
    """Shift what overlaps apart, to either side by as much, and off the walls; places ascend."""
    room = BLOCK_SIZE * np.arange(len(places))
    gaps = places - room
    to_right = np.maximum.accumulate(gaps)
    to_left = np.minimum.accumulate(gaps[::-1])[::-1]
    apart: Array = np.clip(0.5 * (to_right + to_left), 0.0, 1.0 - room[-1:]) + room
    return apart


StepOfMany = Callable[[Layout, Array, Array, GraspTolerance], Array]  # as step has them


def _compiled_step() -> StepOfMany:
    """The step of many worlds by compiled code; see :func:`step`."""
    from slap_ros.domains.obstacle2d import kernels

    def compiled(layout: Layout, data: Array, actions: Array, tolerance: GraspTolerance) -> Array:
        columns = _columns(layout)
        sizes = kernels.Sizes(BLOCK_SIZE, CONTACT, ROUNDING, tolerance.reach, tolerance.gap)
        return kernels.step(
            data,
            np.array(actions, dtype=np.float64, order="C"),
            (columns.robot, columns.x, columns.y, columns.held),
            (CLOSE, OPEN),
            sizes,
        )

    return compiled


STEP_OF_MANY: TieredFunction[StepOfMany] = TieredFunction(step, _compiled_step)


class Obstacle2DVectorWorld:
    """Many worlds of the same objects, stepped by one computation."""

    def __init__(
        self, states: Sequence[State], tolerance: GraspTolerance = GRASP_TOLERANCE
    ) -> None:
        """Begin in ``states``; grasps have this tolerance.

        Raises:
            InvalidStateError: A scene that cannot be.
        """
        self._tolerance = tolerance
        for state in {state.key: state for state in states}.values():  # many begin alike
            require_valid(state)
        self._layout = states[0].layout
        self._data = np.stack([state.data for state in states])

    @property
    def states(self) -> State:
        """The current states, a batch."""
        return State(self._layout, self._data.copy())

    def reset(self, world: int, state: State) -> None:
        """Let one world continue from ``state``."""
        self._data[world] = state.data

    def step(self, actions: Array) -> State:
        """Act in every world once; ``actions``: shape (worlds, 3)."""
        step_all = STEP_OF_MANY.of(len(self._data))
        self._data = step_all(self._layout, self._data, actions, self._tolerance)
        return self.states


class Obstacle2DWorld:
    """A world in one state, stepped by itself; :func:`step` steps many at once."""

    def __init__(self, state: State, tolerance: GraspTolerance = GRASP_TOLERANCE) -> None:
        """Begin in ``state``; grasps have this tolerance.

        Raises:
            InvalidStateError: A scene that cannot be.
        """
        require_valid(state)
        self._tolerance = tolerance
        self._state = state

    @property
    def state(self) -> State:
        """The current state, all that the next step depends on."""
        return self._state

    def reset(self, state: State) -> None:
        """Continue from ``state``, which is taken to be valid."""
        self._state = state

    def step(self, action: Action) -> State:
        """Act for one control step.

        Raises:
            InvalidCommandError: The action is not in the action space; nothing moved.
        """
        ACTION_SPACE.check(action)
        layout = self._state.layout
        after = step(layout, self._state.data[None], action[None], self._tolerance)
        self._state = State(layout, after[0])
        return self._state
