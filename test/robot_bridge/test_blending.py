# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Motions through several waypoints without a stop."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.robot.blended_run import BlendedRun
from slap_ros.robot.blending import MotionLimits, blend
from slap_ros.robot.dry_run import DryRun
from slap_ros.robot.franka.limits import FRANKA, JERK, franka_limits
from slap_ros.robot.gripper import GripperAction
from slap_ros.robot.joint_trajectory import JointSpline
from slap_ros.robot.limits import FR3, Workspace
from slap_ros.robot.recorded_motion import RecordedMotion, RecordedWaypoint
from slap_ros.worlds.panda import HOME, MAX_STEP

PERIOD_S = 0.125


def wandering(seed, steps=20):
    """Waypoints as skills make them: full steps, slow ones, turns and stops of single joints."""
    rng = np.random.default_rng(seed)
    places = [np.array(HOME)]
    way = rng.uniform(-1.0, 1.0, 7)
    for _ in range(steps):
        if rng.random() < 0.3:
            way = rng.uniform(-1.0, 1.0, 7) * (rng.random(7) < 0.6)
        places.append(places[-1] + way * MAX_STEP)
    return [tuple(place.tolist()) for place in places]


def scaled(speed):
    limits = franka_limits(FR3.scaled(speed, Workspace()), speed)
    return MotionLimits.of(limits, tuple(speed * jerk for jerk in JERK))


@pytest.mark.parametrize(("seed", "speed"), [(0, 0.1), (1, 0.5), (2, 1.0)])
def test_a_blended_motion_keeps_every_limit_at_every_moment(seed, speed):
    """Derivatives by finite differences of the trajectory that a controller follows."""
    places, limits = wandering(seed), scaled(speed)
    motion = blend(places, limits, PERIOD_S)
    spline = JointSpline(motion.points, np.array(places[0]), np.zeros(7))
    step_s = 2.5e-4
    times = np.arange(0.0, motion.duration_s, step_s)
    way = np.array([spline.at(t) for t in times])
    for order, allowed in enumerate((limits.velocity, limits.acceleration), start=1):
        found = np.abs(np.diff(way, order, axis=0)).max(axis=0) / step_s**order
        assert (found <= np.array(allowed) * 1.01).all()
    # Jerk jumps at waypoints, where differences of four positions mean nothing.
    inside = np.diff(way, 3, axis=0) / step_s**3
    near = np.min(np.abs(times[:-3, None] - [p.time_s for p in motion.points]), axis=1)
    assert (np.abs(inside[near > 5 * step_s]).max(axis=0) <= np.array(limits.jerk) * 1.01).all()


@pytest.mark.parametrize("seed", range(3))
def test_no_joint_is_ever_beyond_the_waypoints_around_it(seed):
    places = wandering(seed)
    motion = blend(places, scaled(0.5), PERIOD_S)
    spline = JointSpline(motion.points, np.array(places[0]), np.zeros(7))
    begins = 0.0
    for (a, b), point in zip(pairwise(places), motion.points, strict=True):
        way = np.array([spline.at(t) for t in np.linspace(begins, point.time_s, 50)])
        assert (way >= np.minimum(a, b) - 1e-9).all()
        assert (way <= np.maximum(a, b) + 1e-9).all()
        np.testing.assert_allclose(way[-1], b, atol=1e-9)
        begins = point.time_s
    assert not any(motion.points[-1].velocities)


def test_it_is_much_faster_than_with_a_stop_at_each_waypoint():
    limits = franka_limits(FR3.scaled(0.5, Workspace()), 0.5)
    turns = np.array([0.04, 0.0, 0.04, 0.0, 0.04, 0.0, 0.04])
    straight = [tuple((np.array(HOME) + k * turns).tolist()) for k in range(10)]
    stopping = sum(limits.motion(a, b, PERIOD_S).duration_s for a, b in pairwise(straight))
    assert blend(straight, scaled(0.5), PERIOD_S).duration_s < stopping / 1.5


def recording(waypoints):
    domain = get_domain("obstacle_tower")
    state = domain.task(1, 0).initial_state
    return RecordedMotion(domain, 1, 0, (state,), tuple(waypoints), 0)


def test_the_arm_stops_where_the_gripper_acts_and_nowhere_else():
    start = recording(()).start
    there = tuple(q + 0.03 for q in start)
    beyond = tuple(q + 0.06 for q in start)
    keep, close, opens = GripperAction.KEEP, GripperAction.CLOSE, GripperAction.OPEN
    waypoints = [
        RecordedWaypoint(1, there, keep, 0.0),
        RecordedWaypoint(2, beyond, keep, 0.0),
        RecordedWaypoint(3, beyond, close, 0.05),  # the arm stands meanwhile
        RecordedWaypoint(4, there, keep, 0.05),
        RecordedWaypoint(5, start, opens, 0.0),
    ]
    limits = replace(FRANKA, workspace=Workspace((-2.0,) * 3, (2.0,) * 3), step=(0.1,) * 7)
    run = BlendedRun.without_stops(recording(waypoints), limits, JERK)
    assert not run.violations
    assert [[w.step for w in s.waypoints] for s in run.stretches] == [[1, 2], [3, 4], [5]]
    assert [s.steps for s in run.stretches] == [(1, 2), (4,), (5,)]
    assert run.duration_s == pytest.approx(sum(s.points[-1].time_s for s in run.stretches))
    assert [e.quantity.split()[0] for e in run.extremes[2:5]] == [
        "velocity",
        "acceleration",
        "jerk",
    ]
    assert all(extreme.share <= 1.0 + 1e-6 for extreme in run.extremes[2:5])


def test_what_is_refused_from_rest_to_rest_is_refused_without_stops_too():
    start = recording(()).start
    waypoints = [RecordedWaypoint(1, tuple(q + 0.2 for q in start), GripperAction.KEEP, 0.0)]
    recorded = recording(waypoints)
    found = BlendedRun.without_stops(recorded, FRANKA, JERK)
    assert found.violations == DryRun.of(recorded, FRANKA).violations
    assert found.violations
