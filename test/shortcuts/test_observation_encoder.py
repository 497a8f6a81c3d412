# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What learners observe of a Panda's joints."""

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.tabletop.observation import (
    STEP_SCALE,
    hand_frame,
    hand_frame_and_velocities,
    joint_contributions,
)
from slap_ros.domains.tabletop.state_access import JOINT_NAMES
from slap_ros.relational import State
from slap_ros.shortcuts.observation_encoder import ObservationEncoder
from slap_ros.shortcuts.shaping_potential import (
    JOINT_LIMIT_WEIGHT,
    LARGEST_SHARES,
    PROXIMITY_WEIGHT,
    largest_shares,
)
from slap_ros.shortcuts.signature import Change, Signature
from slap_ros.worlds.joint_space.features import ROBOT
from slap_ros.worlds.joint_space.scene import TABLE_TOP
from slap_ros.worlds.panda import JOINT_HIGH, JOINT_LOW, MAX_STEP

TOWER = get_domain("obstacle_tower", "paper")


@pytest.fixture(scope="module")
def encoder():
    """On the slap: the tower down from the target."""
    space = TOWER.atom_space(TOWER.task(0).initial_state)
    tower = [space.atom("On", ["block2", "target"])]
    change = Change(space.mask([space.atom("NothingOn", ["target"])]), space.mask(tower))
    return ObservationEncoder(TOWER, space, Signature.of(change, space), change)


def potential(encoder, **joints):
    """With some joints elsewhere: the seventh turns the hand about itself, and moves nothing."""
    state = TOWER.task(0).initial_state
    (robot,) = state.layout.of_type(ROBOT)
    moved = state.replace({(robot, name): value for name, value in joints.items()})
    return float(encoder.encode(moved.alone()).potential[0])


@pytest.mark.parametrize(("share", "penalty"), [(0.0, 0.0), (0.79, 0.0), (0.9, 0.25), (1.0, 1.0)])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_joint_close_to_its_limit_costs(encoder, share, penalty, side):
    high = JOINT_HIGH[6]  # its range is symmetric
    less = potential(encoder, joint7=0.0) - potential(encoder, joint7=side * share * high)
    assert less == pytest.approx(JOINT_LIMIT_WEIGHT * penalty, abs=1e-9)


def test_a_batch_is_penalised_like_its_states(encoder):
    state = TOWER.task(0).initial_state
    rng = np.random.default_rng(0)
    rows = np.tile(state.data, (20, 1))
    (robot,) = state.layout.of_type(ROBOT)
    for joint in range(7):
        column = state.layout.column(robot, f"joint{joint + 1}")
        rows[:, column] = rng.uniform(-2.8, 0.0 if joint == 3 else 2.8, 20)
    together = TOWER.learning.interface.joint_limit_penalty(State(state.layout, rows))
    alone = [
        TOWER.learning.interface.joint_limit_penalty(State(state.layout, row[None]))[0]
        for row in rows
    ]
    assert together == pytest.approx(np.array(alone))
    assert len(set(together)) == 20


def after_the_slap(block_to_hand_m, speed):
    """The target is free. A block of the tower moves, so far below the hand; the rest is away."""
    state = TOWER.task(0).initial_state
    x, y, z = hand_frame(state.alone())[0, :3, 3]
    features = {
        (state.layout.object(f"block{number}"), axis): value
        for number in (2, 3, 4)
        for axis, value in zip("xyz", (0.4, 0.3, TABLE_TOP + 0.025 + 0.05 * number), strict=True)
    }
    below = zip("xyz", (x, y, z - 0.025 - block_to_hand_m), strict=True)
    moving = state.layout.object("block2")
    features |= {(moving, axis): value for axis, value in below}
    return state.replace({**features, (moving, "vx"): speed})


def test_the_hand_is_to_leave_what_is_done_but_does_not_rest(encoder):
    def encode(block_to_hand_m, speed):
        return encoder.encode(after_the_slap(block_to_hand_m, speed).alone())

    near, far = encode(0.02, 0.5), encode(0.2, 0.5)
    assert not near.achieved[0] and not far.achieved[0]
    assert far.potential[0] - near.potential[0] == pytest.approx(0.8 * PROXIMITY_WEIGHT)
    assert encode(0.02, 0.0).potential[0] == pytest.approx(far.potential[0])  # it may rest there


@pytest.mark.parametrize(("name", "done"), [("block2", True), ("target", False)])
def test_fingers_need_room_around_the_target_alone(name, done):
    state = TOWER.task(0).initial_state
    space, thing = TOWER.atom_space(state), state.layout.object(name)
    moved = {
        (state.layout.object(f"block{number}"), axis): value
        for number in (2, 3, 4)
        for axis, value in zip("xy", (0.4, 0.3 - 0.1 * number), strict=True)
    }
    state = state.replace(moved)
    top = state.get(thing, "z") + state.get(thing, "half_z")
    over = zip("xyz", (state.get(thing, "x"), state.get(thing, "y"), top + 0.031), strict=True)
    hovering = {(state.layout.object("block3"), axis): value for axis, value in over}
    state = state.replace(hovering)  # 6 mm over it: it lies on nothing, but not by a finger's width
    change = Change(space.mask([space.atom("NothingOn", [name])]), 0)
    encoder = ObservationEncoder(TOWER, space, Signature.of(change, space), change)
    assert space.abstract(state) & change.add
    assert encoder.encode(state.alone()).achieved[0] == done


def test_joints_are_seen_to_take_the_hand_as_far_as_they_do():
    state, rng = TOWER.task(0).initial_state, np.random.default_rng(4)
    (robot,) = state.layout.of_type(ROBOT)
    joints = dict(zip(JOINT_NAMES, rng.uniform(JOINT_LOW, JOINT_HIGH), strict=True))
    here = state.replace({(robot, name): value for name, value in joints.items()})
    moving, way = hand_frame_and_velocities(here.alone()), rng.normal(size=3)
    seen = joint_contributions(moving, way[None, None])[0, 0]
    part = 1e-5  # of a control step
    for i, (name, value) in enumerate(joints.items()):
        there = here.replace({(robot, name): value + part * MAX_STEP[i]})
        shift = hand_frame(there.alone())[0, :3, 3] - moving[0, :3, 3]
        assert seen[i] == pytest.approx(
            shift @ way / np.linalg.norm(way) / part / STEP_SCALE, abs=1e-4
        )


@pytest.mark.parametrize("order", ["C", "F"])
def test_compiled_shares_have_the_bits_of_numpy(order):
    rng = np.random.default_rng(0)
    deficits = np.asarray(np.maximum(rng.normal(size=(50, 6)), 0.0), order=order)
    shares = (rng.random((6, 4)) < 0.4).astype(np.float64)
    found = LARGEST_SHARES.compiled()(deficits, shares)
    assert found.tobytes() == largest_shares(deficits, shares).tobytes()
