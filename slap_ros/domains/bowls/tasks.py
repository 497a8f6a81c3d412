# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bowls: tasks, sampled. Lengths in m, angles in rad."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from slap_ros.core import Task
from slap_ros.domains.benchtop.features import place_features
from slap_ros.domains.benchtop.presets import STEP_LIMIT
from slap_ros.domains.benchtop.room import (
    Station,
    finger_space,
    palm_space,
    upright,
    within_reach,
)
from slap_ros.domains.benchtop.tasks import ANY, BENCH_LIMITS, BenchSettings, Range, some_of
from slap_ros.domains.bowls.demonstrator import rim_at
from slap_ros.domains.bowls.model import BOWL, ON, PLATE, SPOTS, SURFACE
from slap_ros.domains.bowls.scenery import (
    FURNITURE,
    OUTSIDE,
    PLATE_BODY,
    PLATE_HEIGHT,
    PLATE_RADIUS,
    REST_HEIGHT,
    bowl,
    bowl_features,
)
from slap_ros.errors import InvalidParameterError, InvalidStateError
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, from_yaw
from slap_ros.relational import GroundAtom, Object, State
from slap_ros.worlds.contact.features import ROBOT, robot_features
from slap_ros.worlds.contact.hand import hand_at
from slap_ros.worlds.contact.scene import TABLE

TRIES = 300  # scenes drawn before there is said to be no room
DARTS = 30  # for each piece of furniture, and for each bowl
HOME = hand_at((0.45, 0.0, 0.35))
GAP = 0.02  # between what stands on the table
ALWAYS = ("ramekin", "cookies")
# By the number of a spot: what a bowl stands on there.
ON_TOP_OF = {3: "cookies", 4: "tray", 5: "ramekin", 7: "stove", 9: "cabinet"}
BETWEEN, BY_RAMEKIN, CENTRE, BY_COOKIES, BY_PLATE = 0, 1, 2, 6, 8  # the other spots
MIDDLE = (0.56, 0.0)  # of the table, as far as the arm reaches
FROM_PLATE = (0.28, 0.34)  # to the ramekin, so that there is room between them
BESIDE = (0.02, 0.04)  # between a bowl and what it is next to
ASIDE = 0.01  # of a bowl, at most, along x and y
PLATE_PLACE = (0.61, -0.15)  # in the preset paper, as are the next
PLACES: Mapping[str, tuple[float, float]] = {
    "ramekin": (0.4, -0.39),
    "cookies": (0.66, 0.26),
    "tray": (0.42, 0.2),
    "stove": (0.48, 0.38),
    "cabinet": (0.42, -0.03),
}

NUMBERS: dict[str, Range] = {"bowls": (1, 3), "task": (ANY, len(SPOTS) - 1)}

Poses = dict[str, Pose]  # of the plate and of furniture, by name


@dataclass(frozen=True)
class RandomBowlTasks(BenchSettings):
    """Furniture is put anywhere, and bowls at some of ten spots that are told by it.

    ``task`` is the number of the spot at which there surely is a bowl, and that of the goal that
    comes with the task: 3 is that of the goal ``task3``. With -1 it is any.
    """

    limits: ClassVar = (
        NUMBERS | BENCH_LIMITS | {f"plate_{axis}": BENCH_LIMITS[axis] for axis in ("x", "y")}
    )

    bowls: int = 2
    task: int = ANY
    x: Range = (0.36, 0.76)
    y: Range = (-0.4, 0.4)
    yaw: Range = (-0.4, 0.4)
    plate_x: Range = (0.48, 0.62)
    plate_y: Range = (-0.25, 0.25)

    def sample(self, rng: np.random.Generator) -> Task:
        """A task to put one bowl on the plate.

        Raises:
            InvalidParameterError: There is no room for so many bowls.
        """
        numbers = some_of(rng, len(SPOTS), self.bowls, self.task)
        for _ in range(TRIES):
            poses = self._draw(rng, [ON_TOP_OF[n] for n in numbers if n in ON_TOP_OF])
            task = None if poses is None else with_bowls(rng, poses, numbers)
            if task is not None:
                return task
        raise InvalidParameterError(
            f"no room was found for bowls {', '.join(SPOTS[n] for n in numbers)}; give x, y, "
            "plate_x and plate_y wider ranges"
        )

    def _draw(self, rng: np.random.Generator, wanted: Sequence[str]) -> Poses | None:
        """Where the plate and furniture stand; None where something found no room."""
        plate = Pose(
            (float(rng.uniform(*self.plate_x)), float(rng.uniform(*self.plate_y)), PLATE_HEIGHT)
        )
        poses: Poses = {"plate": plate}
        for name in sorted({*ALWAYS, *wanted}, key=list(FURNITURE).index):
            pose = self._place(rng, name, poses)
            if pose is None:
                return None
            poses[name] = pose
        return poses

    def _place(self, rng: np.random.Generator, name: str, poses: Poses) -> Pose | None:
        """Where a piece of furniture can stand beside others; None where no room was found."""
        others = [fixed_station(other, pose) for other, pose in poses.items()]
        for _ in range(DARTS):
            x, y, yaw = (float(rng.uniform(*r)) for r in (self.x, self.y, self.yaw))
            if name == "ramekin":
                x, y = _beside(rng, poses["plate"], FROM_PLATE)
            pose = Pose((x, y, FURNITURE[name].height), from_yaw(yaw))
            here = fixed_station(name, pose, GAP)
            if _within(self.x, x) and _within(self.y, y) and all(map(here.leaves_room, others)):
                return pose
        return None


@dataclass(frozen=True)
class PaperBowlTasks(BenchSettings):
    """In the manner of LIBERO: plate and furniture in their places, bowls at some of ten spots.

    ``task`` is as in :class:`RandomBowlTasks`.
    """

    limits: ClassVar = NUMBERS | {"aside": (0.0, 0.02)}

    bowls: int = 2
    task: int = ANY
    aside: float = 0.01  # of everything from its place, at most, along x and y

    def sample(self, rng: np.random.Generator) -> Task:
        """A task to put one bowl on the plate.

        Raises:
            InvalidParameterError: There is no room for so many bowls.
        """
        for _ in range(TRIES):
            numbers = some_of(rng, len(SPOTS), self.bowls, self.task)
            poses = {"plate": self._near(rng, PLATE_PLACE, PLATE_HEIGHT)}
            for name, place in PLACES.items():
                poses[name] = self._near(rng, place, FURNITURE[name].height)
            task = with_bowls(rng, poses, numbers)
            if task is not None:
                return task
        raise InvalidParameterError(f"no room was found for {self.bowls} bowls; give fewer")

    def _near(self, rng: np.random.Generator, place: tuple[float, float], height: float) -> Pose:
        x, y = (float(v) for v in np.add(place, rng.uniform(-self.aside, self.aside, 2)))
        return Pose((x, y, height))


def with_bowls(rng: np.random.Generator, poses: Poses, numbers: Sequence[int]) -> Task | None:
    """The task to put the first bowl on the plate.

    Args:
        rng: Source of random numbers for where exactly bowls stand, and how they are turned.
        poses: Poses of the plate and of furniture, by name.
        numbers: Numbers of the spots at which there are bowls.

    Returns:
        None where the hand has no room at one of the bowls.
    """
    stations = [fixed_station(name, pose) for name, pose in poses.items()]
    bowls: dict[str, Pose] = {}
    for number in numbers:
        pose = _bowl_pose(rng, number, poses, stations)
        if pose is None:
            return None
        stations.append(bowl_station(pose, poses["plate"]))
        bowls[f"bowl{number}"] = pose
    features: dict[Object, Mapping[str, float]] = {
        ROBOT("robot"): robot_features(HOME),
        PLATE("plate"): place_features(poses["plate"]),
    }
    for name, piece in FURNITURE.items():
        if name in poses:
            features[SURFACE(name)] = piece.features(poses[name])
    for name, pose in bowls.items():
        features[BOWL(name)] = bowl_features(pose)
    state = State.build(features)
    return Task(state, first_on_plate(state), STEP_LIMIT)


def first_on_plate(state: State) -> frozenset[GroundAtom]:
    """The goal that comes with a task: its first bowl is on the plate.

    Raises:
        InvalidStateError: The state has no bowl or no plate.
    """
    bowls, plates = state.layout.of_type(BOWL), state.layout.of_type(PLATE)
    if not bowls or not plates:
        raise InvalidStateError("a state of bowls needs a bowl and a plate")
    return frozenset({ON(bowls[0], plates[0])})


# -- where bowls can be ---------------------------------------------------------------------------


def _bowl_pose(
    rng: np.random.Generator, number: int, poses: Poses, stations: Sequence[Station]
) -> Pose | None:
    """Where a bowl stands at a spot, and the hand has room to take it to the plate; or None."""
    for _ in range(DARTS):
        x, y, top = _spot(rng, number, poses)
        pose = Pose((x, y, top + REST_HEIGHT), from_yaw(float(rng.uniform(-math.pi, math.pi))))
        goals = (rim_at(pose), rim_at(_on_plate(pose, poses["plate"])))
        has_room = all(map(bowl_station(pose, poses["plate"]).leaves_room, stations))
        if has_room and _on_table(x, y) and all(map(within_reach, goals)):
            return pose
    return None


def _spot(rng: np.random.Generator, number: int, poses: Poses) -> tuple[float, float, float]:
    """X and y of a bowl's middle, and the height of what it stands on."""
    if number in ON_TOP_OF:
        x, y, top = poses[ON_TOP_OF[number]].position
        return (*_jittered(rng, x, y), top)
    if number == BETWEEN:
        (x, y, _), (u, v, _) = poses["plate"].position, poses["ramekin"].position
        return (*_jittered(rng, 0.5 * (x + u), 0.5 * (y + v)), 0.0)
    if number == CENTRE:
        return (*_jittered(rng, *MIDDLE), 0.0)
    name, reach = {
        BY_RAMEKIN: ("ramekin", FURNITURE["ramekin"].half_length),
        BY_COOKIES: ("cookies", FURNITURE["cookies"].half_length),
        BY_PLATE: ("plate", PLATE_RADIUS),
    }[number]
    low, high = (reach + OUTSIDE + gap for gap in BESIDE)
    return (*_beside(rng, poses[name], (low, high)), 0.0)


def _on_table(x: float, y: float) -> bool:
    """Whether all of a bowl is over the table."""
    (u, v, _), (length, width, _) = TABLE.pose.position, TABLE.bounding_box.half
    return abs(x - u) <= length - OUTSIDE and abs(y - v) <= width - OUTSIDE


def _within(bounds: Range, number: float) -> bool:
    low, high = bounds
    return low <= number <= high


def _jittered(rng: np.random.Generator, x: float, y: float) -> tuple[float, float]:
    dx, dy = (float(d) for d in rng.uniform(-ASIDE, ASIDE, 2))
    return x + dx, y + dy


def _beside(rng: np.random.Generator, pose: Pose, far: Range) -> tuple[float, float]:
    """A place in any direction from a pose, so far away."""
    x, y, _ = pose.position
    angle, distance = float(rng.uniform(-math.pi, math.pi)), float(rng.uniform(*far))
    return x + distance * math.cos(angle), y + distance * math.sin(angle)


# -- room -----------------------------------------------------------------------------------------


def fixed_station(name: str, pose: Pose, gap: float = 0.0) -> Station:
    """The station of the plate or a piece of furniture, which no hand has to grasp.

    Args:
        name: Name of the plate or of the piece of furniture.
        pose: Pose of its frame.
        gap: Space to be left around it, m.

    Returns:
        What takes room, without room for a hand.
    """
    body = PLATE_BODY if name == "plate" else FURNITURE[name].body
    boxes = (part.bounding_box.at(pose) for part in body.parts)
    return Station(tuple(box.grown(gap) for box in boxes))


def bowl_station(pose: Pose, plate: Pose) -> Station:
    """The station of a bowl, with the hand that grasps it and puts it on the plate."""
    there = _on_plate(pose, plate)
    hands = [upright(rim_at(at)) for at in (pose, there)]
    spaces = (space for hand in hands for space in (palm_space(hand), finger_space(hand)))
    return Station((_space(pose),), (*spaces, _space(there)))


def _on_plate(pose: Pose, plate: Pose) -> Pose:
    x, y, z = plate.position
    return Pose((x, y, z + REST_HEIGHT), pose.quaternion)


def _space(pose: Pose) -> OrientedBox:
    """What a bowl fills, less a layer, since it touches what it stands on."""
    return bowl("bowl").at(pose).shrunk(0.001)
