# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What scripts can do in the contact world: ``python -m benchmarks.contact_skills [--count N]``.

Things, those of domains as well, are grasped, lifted and shaken for 100 steps; drawers are pulled
open by their handles and pushed shut; a lid is turned down; a rod is pushed into a hole. Each from
places drawn at random, with errors of some millimetres. Slip is how far a thing moved in the hand
while it was shaken.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from benchmarks.printing import show
from benchmarks.workbench import (
    BENCH,
    CUBE,
    HANDLE_AT,
    LYING,
    ROD,
    THING,
    Move,
    Setting,
    hand_of,
    holed_plate,
    perform,
    start,
    value,
)
from slap_ros.domains.bowls.scenery import GRIP, REST_HEIGHT, bowl
from slap_ros.domains.groceries.scenery import GROCERIES
from slap_ros.domains.make_coffee.scenery import POD_HALF, pod
from slap_ros.domains.peg_in_hole.demonstrator import BEHIND
from slap_ros.domains.peg_in_hole.scenery import PEG_RADIUS, RED, peg
from slap_ros.domains.stow_hammer.scenery import RADIUS, hammer
from slap_ros.geometry.pose import (
    NO_ROTATION,
    ORIGIN,
    Pose,
    Quaternion,
    Vector,
    from_yaw,
    multiply,
    rotate,
)
from slap_ros.relational import State
from slap_ros.worlds.bodies import GREY
from slap_ros.worlds.contact.features import ROBOT, robot_features
from slap_ros.worlds.contact.hand import hand_at, wrapped
from slap_ros.worlds.contact.hand_model import QUICK
from slap_ros.worlds.contact.scene import TABLE, BoxPart, Compound, ContactScene, CylinderPart
from slap_ros.worlds.contact.world import ACTION_SPACE, MAX_SHIFT, MAX_TURN, ContactWorld
from slap_ros.worlds.features import body_features

HAND = QUICK  # what grasps; a benchmark without a piece has another one
SHAKEN = 100  # steps
SHAKE = (0.006, 0.006, 0.006, 0.05)  # m and rad a step, standard deviations
OFF = 0.005  # m, how far off the middle a thing is grasped at most, along each axis
OFF_TURN = 0.1  # rad
OPEN, SHUT, LID_SHUT = 0.1, 0.01, math.radians(5)  # m, m, rad: as the domains have it
CLEARANCES_MM = (8, 5, 3)  # what a hole is wider than the rod
PLATE_FACE, HOLE_Z = 0.63, 0.2  # m
INSERTED = 0.03  # m, how deep the rod's tip must be
QUARTER = 0.5 * math.pi

HAMMER = Compound(
    "hammer",
    (
        CylinderPart(0.012, 0.15, Pose((-0.04, 0.0, 0.0), LYING)),
        BoxPart((0.012, 0.03, 0.012), Pose((0.047, 0.0, 0.0))),
    ),
    mass_kg=0.2,
)


@dataclass(frozen=True)
class Graspable:
    """A thing and how it lies on the table.

    Args:
        body: Body of the thing.
        height: Height of the thing's origin above the table, m.
        lying: Orientation of the thing when its yaw is 0, a quaternion.
        grip: Grasp point from the thing's origin when its yaw is 0, m.
    """

    body: Compound
    height: float
    lying: Quaternion = NO_ROTATION
    grip: Vector = ORIGIN


GRASPABLE = {
    "cube": Graspable(CUBE, 0.02),
    "rod": Graspable(ROD, 0.012, LYING),
    "hammer": Graspable(HAMMER, 0.012, grip=(-0.03, 0.0, 0.0)),
}
OF_DOMAINS = {
    "stow_hammer": {"balanced hammer": Graspable(hammer("balanced hammer", GREY), RADIUS)},
    "make_coffee": {"pod": Graspable(pod("pod"), POD_HALF)},
    "groceries": {
        name: Graspable(thing.body, thing.rest_height, grip=(0.0, 0.0, thing.grasp_height))
        for name, thing in GROCERIES.items()
    },
    "peg_in_hole": {"peg": Graspable(peg("peg", RED), PEG_RADIUS, grip=(-BEHIND, 0.0, 0.0))},
    "bowls": {"bowl": Graspable(bowl("bowl"), REST_HEIGHT, grip=GRIP)},
}
EVERYTHING = GRASPABLE | {n: thing for things in OF_DOMAINS.values() for n, thing in things.items()}


def grasped_world(name: str, seed: int) -> ContactWorld:
    """A world in which a script grasped the thing and lifted it, or tried to."""
    rng = np.random.default_rng([seed, len(name)])
    thing = EVERYTHING[name]
    x, y, yaw = rng.uniform((0.42, -0.15, -1.2), (0.6, 0.15, 1.2)).tolist()
    pose = Pose((x, y, thing.height), multiply(from_yaw(yaw), thing.lying))
    ahead = rotate(from_yaw(yaw), thing.grip)
    off = rng.uniform(-OFF, OFF, 2)
    gx, gy = x + ahead[0] + float(off[0]), y + ahead[1] + float(off[1])
    turn = yaw + float(rng.uniform(-OFF_TURN, OFF_TURN))
    scene = ContactScene((TABLE, thing.body), HAND)
    low = (gx, gy, thing.height + ahead[2])
    features = {
        ROBOT("robot"): robot_features(hand_at((gx, gy, max(0.12, low[2] + 0.07)), turn)),
        THING(name): body_features(*pose),
    }
    world = ContactWorld(scene, State.build(features))
    perform(
        world,
        [
            Move(low, 8, yaw=turn),
            Move(low, 6, close=True, yaw=turn),
            Move((gx, gy, max(0.22, low[2] + 0.2)), 14, close=True, yaw=turn),
        ],
    )
    return world


def in_hand(state: State, name: str) -> Pose:
    """A thing's pose in the hand's frame."""
    return _pose(state, "robot").inverse().compose(_pose(state, name))


def shaken_slip(world: ContactWorld, name: str, seed: int) -> float:
    """How far a held thing moves in the hand while it is shaken, m; infinite if it is lost."""
    rng = np.random.default_rng(seed)
    before = in_hand(world.state, name)
    for _ in range(SHAKEN):
        noise = np.clip(rng.normal(0.0, SHAKE), ACTION_SPACE.low[:4], ACTION_SPACE.high[:4])
        world.step(np.array([*noise, 1.0]))
    after = in_hand(world.state, name)
    held = value(world.state, name, "held") > 0.5
    return math.dist(before.position, after.position) if held else math.inf


def grasps(name: str, count: int) -> dict[str, float]:
    """How many of so many grasps hold, and how far the things slip."""
    slips = []
    for seed in range(count):
        with grasped_world(name, seed) as world:
            slips.append(shaken_slip(world, name, seed))
    held = np.array([slip for slip in slips if slip < math.inf])
    return {
        "count": count,
        "held_percent": 100.0 * len(held) / count,
        "slip_median_mm": 1e3 * float(np.median(held)) if held.size else math.inf,
        "slip_p95_mm": 1e3 * float(np.percentile(held, 95)) if held.size else math.inf,
    }


def drawer_opened(world: ContactWorld, rng: np.random.Generator) -> float:
    """Pull the left drawer open; how far, m."""
    x, y, z = (float(p + e) for p, e in zip(HANDLE_AT, rng.uniform(-0.004, 0.004, 3), strict=True))
    world.reset(start(Setting(hand=hand_at((x, y, 0.14), QUARTER))))
    state = perform(
        world,
        [
            Move((x, y, z), 8, yaw=QUARTER),
            Move((x, y, z), 6, close=True, yaw=QUARTER),
            Move((x - 0.13, y, z), 18, close=True, yaw=QUARTER, fastest=0.01),
        ],
    )
    return value(state, "left", "opening")


def drawer_shut(world: ContactWorld) -> float:
    """Let go of the handle and push the drawer shut; how far it is open, m."""
    x, y, z = hand_of(world.state).tolist()
    state = perform(
        world,
        [
            Move((x, y, 0.14), 8, yaw=QUARTER),
            Move((x - 0.08, y, 0.14), 6, close=True, yaw=QUARTER),
            Move((x - 0.08, y, z), 8, close=True, yaw=QUARTER),
            Move((HANDLE_AT[0] + 0.02, y, z), 30, close=True, yaw=QUARTER, fastest=0.01),
        ],
    )
    return value(state, "left", "opening")


def lid_shut(world: ContactWorld, rng: np.random.Generator) -> float:
    """Turn the lid down from behind and press on it; how far it is open, rad."""
    opening = float(rng.uniform(0.9, 1.5))
    x, y = (float(p + e) for p, e in zip((0.8, 0.0), rng.uniform(-0.005, 0.005, 2), strict=True))
    hand = hand_at((x, y, 0.1), finger=0.0, closing=True)
    world.reset(start(Setting(hand=hand, openings=(0.0, 0.0, opening))))
    over = [(0.71, 0.1), (0.67, 0.08), (0.67, 0.056)]
    state = perform(world, [Move((px, y, pz), 7, close=True) for px, pz in over])
    return value(state, "lid", "opening")


def inserted_depth(clearance_mm: float, seed: int, steps: int = 90) -> float:
    """How deep a script that sees everything gets a rod into a hole, m.

    Args:
        clearance_mm: Difference between the width of the hole and that of the rod, mm.
        seed: Seed of the rod's place in the hand.
        steps: Number of steps after which the script gives up.
    """
    rng = np.random.default_rng([seed, 7])
    half = ROD.parts[0].bounding_box.half[0] + 0.5e-3 * clearance_mm
    scene = ContactScene((TABLE, ROD, holed_plate(half, z=HOLE_Z)))
    x, y = (float(v) for v in rng.uniform((0.46, -0.05), (0.5, 0.05)))
    back, turn = float(rng.uniform(0.015, 0.025)), float(rng.uniform(-OFF_TURN, OFF_TURN))
    rod = Pose((x, y, 0.012), multiply(from_yaw(turn), LYING))
    gx = x - back
    features = {
        ROBOT("robot"): robot_features(hand_at((gx, y, 0.12), turn)),
        THING("rod"): body_features(*rod),
    }
    with ContactWorld(scene, State.build(features)) as world:
        low = (gx, y, 0.012)
        moves = [Move(low, 8, yaw=turn), Move(low, 6, close=True, yaw=turn)]
        perform(world, [*moves, Move((gx, y, HOLE_Z), 14, close=True)])
        for _ in range(steps):
            world.step(_inserting(world.state))
        return float(_tip(world.state)[0]) - PLATE_FACE


def _inserting(state: State) -> np.ndarray:
    """Bring the rod's tip in front of the hole, then push."""
    tip, middle = _tip(state), np.array(_pose(state, "rod").position)
    lead = np.array([value(state, "robot", f"target_{a}") for a in "xyz"]) - hand_of(state)
    off = np.array([0.0, tip[1], tip[2] - HOLE_Z])
    aligned = bool(np.abs(off).max() < 0.001) or tip[0] > PLATE_FACE
    off[0] = tip[0] - (PLATE_FACE + 0.06 if aligned else PLATE_FACE - 0.015)
    shift = np.clip(-0.6 * off - lead, -MAX_SHIFT, MAX_SHIFT)
    shift[0] = np.clip(-off[0] - lead[0], -MAX_SHIFT, 0.006 if aligned else MAX_SHIFT)
    yaw = math.atan2(tip[1] - middle[1], tip[0] - middle[0])
    lag = wrapped(value(state, "robot", "target_yaw") - _yaw(state))
    return np.array([*shift, np.clip(-0.6 * yaw - lag, -MAX_TURN, MAX_TURN), 1.0])


def _yaw(state: State) -> float:
    x, y, _, _ = _pose(state, "robot").quaternion
    return 2.0 * math.atan2(y, x)


def _tip(state: State) -> np.ndarray:
    """The end of the rod that is further away from the arm."""
    pose = _pose(state, "rod")
    ends = [pose.apply((0.0, 0.0, sign * 0.075)) for sign in (-1.0, 1.0)]
    return np.array(max(ends))


def _pose(state: State, name: str) -> Pose:
    x, y, z, qx, qy, qz, qw = (
        value(state, name, f) for f in ("x", "y", "z", "qx", "qy", "qz", "qw")
    )
    return Pose((x, y, z), (qx, qy, qz, qw))


def drawers(count: int) -> Mapping[str, float]:
    """How many of so many drawers are opened, then shut."""
    opened, shut = [], []
    with ContactWorld(BENCH, start()) as world:
        for seed in range(count):
            opened.append(drawer_opened(world, np.random.default_rng(seed)))
            shut.append(drawer_shut(world))
    return {
        "count": count,
        "opened_percent": 100.0 * float(np.mean(np.array(opened) >= OPEN)),
        "shut_percent": 100.0 * float(np.mean(np.array(shut) < SHUT)),
    }


def lids(count: int) -> Mapping[str, float]:
    """How many of so many lids are shut."""
    with ContactWorld(BENCH, start()) as world:
        left = [lid_shut(world, np.random.default_rng(seed)) for seed in range(count)]
    return {"count": count, "shut_percent": 100.0 * float(np.mean(np.array(left) < LID_SHUT))}


def insertions(clearance_mm: float, count: int) -> Mapping[str, float]:
    """How many of so many rods get into a hole."""
    depths = np.array([inserted_depth(clearance_mm, seed) for seed in range(count)])
    return {
        "count": count,
        "inserted_percent": 100.0 * float(np.mean(depths >= INSERTED)),
        "depth_median_mm": 1e3 * float(np.median(depths)),
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--count", type=int, default=200, metavar="N", help="repetitions of each skill"
    )
    parser.add_argument("--json", action="store_true")
    parser.add_argument(
        "--only", default="", metavar="TEXT", help="run only rows with this text in their name"
    )
    arguments = parser.parse_args()
    count: int = arguments.count
    table: dict[str, Callable[[], Mapping[str, float]]] = {
        **{f"grasp {name}": partial(grasps, name, count) for name in GRASPABLE},
        "drawer": partial(drawers, count),
        "lid": partial(lids, count),
        **{f"insert {c} mm": partial(insertions, c, count) for c in CLEARANCES_MM},
        **{
            f"{domain}: grasp {n}": partial(grasps, n, count)
            for domain, things in OF_DOMAINS.items()
            for n in things
        },
    }
    rows = {name: measure for name, measure in table.items() if arguments.only in name}
    show({name: measure() for name, measure in rows.items()}, arguments.json)


if __name__ == "__main__":
    main()
