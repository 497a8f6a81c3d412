# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Groceries: tasks, sampled. Lengths in m, angles in rad."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from slap_ros.core import Task
from slap_ros.domains.benchtop.features import place_features, thing_features
from slap_ros.domains.benchtop.hand_motion import HandGoal
from slap_ros.domains.benchtop.presets import STEP_LIMIT
from slap_ros.domains.benchtop.room import HIGHEST, ROOM, Station, palm_space, within_reach
from slap_ros.domains.benchtop.tasks import ANY, BENCH_LIMITS, BenchSettings, Range, some_of
from slap_ros.domains.groceries.model import BASKET, GRASP_HEIGHT, GROCERY, HALF_WIDTH, IN, NAMES
from slap_ros.domains.groceries.scenery import BASKET_BODY, FLOOR_HEIGHT, GROCERIES, Grocery
from slap_ros.errors import InvalidParameterError, InvalidStateError
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, from_yaw
from slap_ros.relational import GroundAtom, Object, State
from slap_ros.worlds.contact.features import ROBOT, robot_features
from slap_ros.worlds.contact.hand import PALM, hand_at

MOST = 6  # things, by default
TRIES = 200  # scenes drawn before there is said to be no room
PLACES = 60  # drawn for a thing before the scene is given up
HOME = hand_at((0.45, 0.0, 0.35))
NUMBERS: dict[str, Range] = {"things": (1, len(NAMES)), "task": (ANY, len(NAMES) - 1)}
BASKET_LIMITS = {f"basket_{name}": BENCH_LIMITS[name] for name in ("x", "y", "yaw")}


@dataclass(frozen=True)
class RandomGroceryTasks(BenchSettings):
    """Things and the basket are put anywhere within reach where the hand has room.

    ``task`` names the thing that is surely there, and the goal that comes with the task: 3 is the
    thing of the goal ``task3``. With -1 it is any.
    """

    limits: ClassVar = NUMBERS | BENCH_LIMITS | BASKET_LIMITS

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
        names = [NAMES[i] for i in some_of(rng, len(NAMES), self.things, self.task)]
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
        if not all(within_reach(HandGoal(basket.position, turn)) for turn in self.yaw):
            return None
        stations, poses = [basket_station(basket)], []
        for name in names:
            pose = self._place(rng, GROCERIES[name], stations)
            if pose is None:
                return None
            stations.append(station(GROCERIES[name], pose))
            poses.append(pose)
        return make_task(basket, names, poses)

    def _place(
        self, rng: np.random.Generator, thing: Grocery, stations: Sequence[Station]
    ) -> Pose | None:
        """Where a thing can stand beside others; None where no room was found."""
        for _ in range(PLACES):
            x, y, yaw = (float(rng.uniform(*r)) for r in (self.x, self.y, self.yaw))
            pose = Pose((x, y, thing.rest_height), from_yaw(yaw))
            has_room = all(map(station(thing, pose).leaves_room, stations))
            if has_room and within_reach(grasp_goal(thing, pose, yaw)):
                return pose
        return None


SIDES = (1, -1)  # of the basket
SLOTS = tuple(
    (x, side * y) for x, y in ((0.45, 0.235), (0.6, 0.235), (0.5, 0.43)) for side in SIDES
)


@dataclass(frozen=True)
class PaperGroceryTasks(BenchSettings):
    """In the manner of LIBERO: the basket in its place, each thing near one of six, unturned.

    ``task`` is as in :class:`RandomGroceryTasks`.
    """

    limits: ClassVar = NUMBERS | {"things": (1, len(SLOTS)), "aside": (0.0, 0.02)}

    things: int = MOST
    task: int = ANY
    aside: float = 0.01  # m from its place, at most, along x and y

    def sample(self, rng: np.random.Generator) -> Task:
        """A task to put one thing into the basket."""
        names = [NAMES[i] for i in some_of(rng, len(NAMES), self.things, self.task)]
        poses = []
        for name, i in zip(names, rng.permutation(len(SLOTS)), strict=False):
            x, y = SLOTS[i]
            dx, dy = (float(d) for d in rng.uniform(-self.aside, self.aside, 2))
            poses.append(Pose((x + dx, y + dy, GROCERIES[name].rest_height)))
        return make_task(Pose((0.58, 0.0, FLOOR_HEIGHT)), names, poses)


def make_task(basket: Pose, names: Sequence[str], poses: Sequence[Pose]) -> Task:
    """The task to put the first thing into the basket.

    Args:
        basket: Pose of the basket.
        names: Names of the things, in the order of the state.
        poses: Poses of the things.
    """
    features: dict[Object, Mapping[str, float]] = {
        ROBOT("robot"): robot_features(HOME),
        BASKET("basket"): place_features(basket),
    }
    for name, pose in zip(names, poses, strict=True):
        features[GROCERY(name)] = grocery_features(GROCERIES[name], pose)
    state = State.build(features)
    return Task(state, first_in_basket(state), STEP_LIMIT)


def station(thing: Grocery, pose: Pose) -> Station:
    """The station of a thing that stands at a pose; nothing else is below the palm there."""
    return Station((thing.body.at(pose),), (palm_space(pose, bottom=0.0),))


def basket_station(pose: Pose) -> Station:
    """The station of the basket, into which the hand reaches turned in any way."""
    half = math.hypot(*PALM.half_extents_m[:2]) + ROOM
    return Station((BASKET_BODY.at(pose),), (OrientedBox(pose, (half, half, HIGHEST)),))


def grasp_goal(thing: Grocery, pose: Pose, yaw: float) -> HandGoal:
    """The hand around a thing.

    Args:
        thing: Thing that is to be grasped.
        pose: Pose at which the thing stands.
        yaw: Yaw of the hand, rad.
    """
    x, y, z = pose.position
    return HandGoal((x, y, z + thing.grasp_height), yaw)


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
