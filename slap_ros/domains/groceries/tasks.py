# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Groceries: tasks, sampled; and the goals, one per thing. Lengths in m, angles in rad."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from slap_ros.contact.arm import arm_joints
from slap_ros.contact.features import ROBOT, robot_features
from slap_ros.contact.hand import PALM, hand_at, pointing_down
from slap_ros.core import Goal, Task
from slap_ros.domains.benchtop.features import place_features, thing_features
from slap_ros.domains.benchtop.goals import goal
from slap_ros.domains.benchtop.presets import STEP_LIMIT
from slap_ros.domains.benchtop.state_access import pose_of
from slap_ros.domains.groceries.model import BASKET, GRASP_HEIGHT, GROCERY, HALF_WIDTH, IN
from slap_ros.domains.groceries.scenery import BASKET_BODY, FLOOR_HEIGHT, GROCERIES, NAMES, Grocery
from slap_ros.domains.variation import TaskSettings
from slap_ros.errors import InvalidParameterError, InvalidStateError
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, Vector, from_yaw
from slap_ros.relational import GroundAtom, Object, State

Range = tuple[float, float]

ANY = -1  # instead of a task's number
MOST = 6  # things, by default
TRIES = 200  # scenes drawn before there is said to be no room
PLACES = 60  # drawn for a thing before the scene is given up
HOME = hand_at((0.45, 0.0, 0.35))
ROOM = 0.03  # around the hand where it grasps: it may come down that far aside
TALL = 0.2  # half the height of the space around the hand that other things leave free
LOWEST, HIGHEST = 0.01, 0.32  # heights between which the hand must get everywhere
TURNS = (-0.6, 0.6)  # of the hand, that it must get there with

NUMBERS: dict[str, Range] = {"things": (1, len(NAMES)), "task": (ANY, len(NAMES) - 1)}
WITHIN_X, WITHIN_Y, TURN = (0.3, 0.8), (-0.5, 0.5), (-math.pi, math.pi)


@dataclass(frozen=True)
class RandomGroceryTasks(TaskSettings):
    """Things and the basket are put anywhere within reach where the hand has room.

    ``task`` names the thing that is surely there, and the goal that comes with the task: 3 is the
    thing of the goal ``task3``. With -1 it is any.
    """

    limits: ClassVar = NUMBERS | {
        "x": WITHIN_X,
        "y": WITHIN_Y,
        "yaw": TURN,
        "basket_x": WITHIN_X,
        "basket_y": WITHIN_Y,
        "basket_yaw": TURN,
    }

    things: int = MOST
    task: int = ANY
    x: Range = (0.42, 0.70)
    y: Range = (-0.42, 0.42)
    yaw: Range = (-0.6, 0.6)
    basket_x: Range = (0.50, 0.62)
    basket_y: Range = (-0.25, 0.25)
    basket_yaw: Range = (-0.3, 0.3)

    def sample(self, rng: np.random.Generator) -> Task:
        """A task to put one thing into the basket.

        Raises:
            InvalidParameterError: There is no room for so many things.
        """
        names = chosen(rng, self.things, self.task)
        for _ in range(TRIES):
            task = self._draw(rng, names)
            if task is not None:
                return task
        raise InvalidParameterError(f"the table has no room for {self.things} things")

    def _draw(self, rng: np.random.Generator, names: Sequence[str]) -> Task | None:
        """A task with things of these names; None where one of them found no room."""
        x, y, yaw = (
            float(rng.uniform(*r)) for r in (self.basket_x, self.basket_y, self.basket_yaw)
        )
        basket = Pose((x, y, FLOOR_HEIGHT), from_yaw(yaw))
        if not within_reach(basket.position):
            return None
        spots, poses = [Spot.of_basket(basket)], []
        for name in names:
            pose = self._place(rng, GROCERIES[name], spots)
            if pose is None:
                return None
            spots.append(Spot.of_thing(GROCERIES[name], pose))
            poses.append(pose)
        return make_task(basket, names, poses)

    def _place(
        self, rng: np.random.Generator, thing: Grocery, spots: Sequence[Spot]
    ) -> Pose | None:
        """Where a thing can stand beside others; None where no room was found."""
        for _ in range(PLACES):
            x, y, yaw = (float(rng.uniform(*r)) for r in (self.x, self.y, self.yaw))
            pose = Pose((x, y, thing.rest_height), from_yaw(yaw))
            spot = Spot.of_thing(thing, pose)
            if all(map(spot.leaves_room, spots)) and within_reach(pose.position):
                return pose
        return None


SIDES = (1, -1)  # of the basket
SLOTS = tuple(
    (x, side * y) for x, y in ((0.45, 0.235), (0.6, 0.235), (0.5, 0.43)) for side in SIDES
)


@dataclass(frozen=True)
class PaperGroceryTasks(TaskSettings):
    """In the manner of LIBERO: the basket in its place, each thing near one of six, unturned.

    ``task`` is as in :class:`RandomGroceryTasks`.
    """

    limits: ClassVar = NUMBERS | {"things": (1, len(SLOTS)), "aside": (0.0, 0.02)}

    things: int = MOST
    task: int = ANY
    aside: float = 0.01  # m from its place, at most, along x and y

    def sample(self, rng: np.random.Generator) -> Task:
        """A task to put one thing into the basket."""
        names = chosen(rng, self.things, self.task)
        poses = []
        for name, i in zip(names, rng.permutation(len(SLOTS)), strict=False):
            x, y = SLOTS[i]
            dx, dy = (float(d) for d in rng.uniform(-self.aside, self.aside, 2))
            poses.append(Pose((x + dx, y + dy, GROCERIES[name].rest_height)))
        return make_task(Pose((0.58, 0.0, FLOOR_HEIGHT)), names, poses)


def chosen(rng: np.random.Generator, count: int, task: int) -> list[str]:
    """Names of things, drawn at random.

    Args:
        rng: Draws.
        count: Of them.
        task: The number of the one that comes first; :data:`ANY` for any.

    Returns:
        Different names.
    """
    names = [NAMES[i] for i in rng.permutation(len(NAMES))]
    if task != ANY:
        names.remove(NAMES[task])
        names.insert(0, NAMES[task])
    return names[:count]


def make_task(basket: Pose, names: Sequence[str], poses: Sequence[Pose]) -> Task:
    """The task to put the first thing into the basket.

    Args:
        basket: Where it stands.
        names: Of things, in the order of the state.
        poses: Where they stand.
    """
    features: dict[Object, Mapping[str, float]] = {
        ROBOT("robot"): robot_features(HOME),
        BASKET("basket"): place_features(basket),
    }
    for name, pose in zip(names, poses, strict=True):
        features[GROCERY(name)] = grocery_features(GROCERIES[name], pose)
    state = State.build(features)
    return Task(state, first_in_basket(state), STEP_LIMIT)


@dataclass(frozen=True)
class Spot:
    """What a body fills, and what the hand fills around it when it grasps or puts down there."""

    body: OrientedBox
    hand: OrientedBox

    @classmethod
    def of_thing(cls, thing: Grocery, pose: Pose) -> Spot:
        """Of a thing that stands at a pose, and is grasped across its width."""
        x, y, _ = PALM.half_extents_m
        return cls(thing.body.at(pose), OrientedBox(pose, (x + ROOM, y + ROOM, TALL)))

    @classmethod
    def of(cls, state: State, obj: Object) -> Spot:
        """Of the basket or a thing, as it is in a state."""
        pose = pose_of(state, obj)
        return (
            cls.of_basket(pose) if obj.type == BASKET else cls.of_thing(GROCERIES[obj.name], pose)
        )

    @classmethod
    def of_basket(cls, pose: Pose) -> Spot:
        """Of the basket, into which the hand reaches turned in any way."""
        half = math.hypot(*PALM.half_extents_m[:2]) + ROOM
        return cls(BASKET_BODY.at(pose), OrientedBox(pose, (half, half, TALL)))

    def leaves_room(self, other: Spot) -> bool:
        """Whether the hand has room at both."""
        return not (self.hand.overlaps(other.body) or other.hand.overlaps(self.body))


def within_reach(position: Vector) -> bool:
    """Whether the arm reaches a place, high and low, and around it."""
    x, y, _ = position
    return all(
        arm_joints(Pose((x + i * ROOM, y + j * ROOM, z), pointing_down(turn))) is not None
        for i in (-1, 1)
        for j in (-1, 1)
        for z in (LOWEST, HIGHEST)
        for turn in TURNS
    )


def grocery_features(thing: Grocery, pose: Pose) -> Mapping[str, float]:
    """The features of a thing that stands at a pose, for ``State.build``."""
    return {
        **thing_features(pose, thing.rest_height, thing.body.extent((0.0, 0.0, 1.0))),
        HALF_WIDTH.name: thing.half_width,
        GRASP_HEIGHT.name: thing.grasp_height,
    }


def first_in_basket(state: State) -> frozenset[GroundAtom]:
    """The goal that comes with a task: its first thing is in the basket.

    Raises:
        InvalidStateError: The state has no thing or no basket.
    """
    things, baskets = state.layout.of_type(GROCERY), state.layout.of_type(BASKET)
    if not things or not baskets:
        raise InvalidStateError("a state of groceries needs a thing and a basket")
    return frozenset({IN(things[0], baskets[0])})


GOALS: Mapping[str, Goal] = {
    f"task{number}": goal((IN, name, "basket")) for number, name in enumerate(NAMES)
}
