# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Controllers as drivers have them: what they follow, refuse and give up, in their own time."""

from dataclasses import replace

import numpy as np
import pytest

from slap_ros.errors import InvalidCommandError
from slap_ros.robot.finger_tracking import FingerTracker, GripOutcome
from slap_ros.robot.joint_trajectory import JointSpline, TrajectoryPoint, require_followable
from slap_ros.robot.trajectory_tracking import (
    TrajectoryCode,
    TrajectoryTolerances,
    TrajectoryTracker,
)

JOINTS = ("a", "b")
STILL = (0.0, 0.0)
END = TrajectoryPoint(1.0, (1.0, -1.0), STILL, STILL)
TOLERANCES = TrajectoryTolerances((0.2, 0.2), (0.01, 0.01), 0.01, 0.5)


def rate(spline, t, h=1e-6):
    return (spline.at(t + h) - spline.at(t - h)) / (2 * h)


@pytest.mark.parametrize(
    ("velocities", "accelerations"), [((), ()), ((0.4, -0.3), ()), ((0.4, -0.3), (0.2, 0.1))]
)
def test_a_spline_goes_through_its_points_with_what_they_say(velocities, accelerations):
    middle = TrajectoryPoint(0.4, (0.3, 0.5), velocities, accelerations)
    end = replace(END, velocities=STILL if velocities else (), accelerations=())
    if accelerations:
        end = END
    spline = JointSpline([middle, end], np.array([0.1, 0.2]), np.array([0.5, 0.0]))
    assert spline.at(0.0) == pytest.approx([0.1, 0.2])
    assert spline.at(0.4) == pytest.approx([0.3, 0.5])
    assert spline.at(1.0) == pytest.approx([1.0, -1.0])
    assert spline.at(7.0) == pytest.approx([1.0, -1.0])
    if not velocities:
        assert spline.at(0.2) == pytest.approx([0.2, 0.35])
        return
    for side in (-2e-6, 2e-6):
        assert rate(spline, 0.4 + side) == pytest.approx(velocities, abs=1e-4)
    if accelerations:
        bend = (rate(spline, 0.4001) - rate(spline, 0.3999)) / 0.0002
        assert bend == pytest.approx(accelerations, abs=0.05)


@pytest.mark.parametrize(
    ("names", "points", "words"),
    [
        (("a",), [TrajectoryPoint(1.0, (1.0,))], "must be for all of a, b"),
        ((), [END], "for no joint"),
        (("a", "c"), [END], "a, c"),
        (("a", "a"), [END], "a, a"),
        (JOINTS, [], "no point"),
        (JOINTS, [END, END], "do not increase"),
        (JOINTS, [replace(END, time_s=-1.0)], "do not increase"),
        (JOINTS, [replace(END, positions=(1.0,))], "1 positions"),
        (JOINTS, [replace(END, velocities=(0.0,))], "1 velocities"),
        (JOINTS, [replace(END, accelerations=(0.0,) * 3)], "3 accelerations"),
        (JOINTS, [replace(END, velocities=(0.1, 0.0))], "at rest"),
        (JOINTS, [replace(END, positions=(float("nan"), 0.0))], "not finite"),
    ],
)
def test_what_no_driver_follows_is_refused(names, points, words):
    with pytest.raises(InvalidCommandError, match=words):
        require_followable(names, JOINTS, points)


def test_joints_may_come_in_any_order():
    require_followable(("b", "a"), JOINTS, [END])


def started(tolerances=TOLERANCES):
    tracker = TrajectoryTracker(STILL)
    assert not tracker.busy
    tracker.start([END], tolerances, 10.0, STILL, STILL)
    return tracker


def test_a_motion_succeeds_once_the_arm_is_there_and_stands():
    tracker = started()
    assert tracker.check(10.5, tracker.command(10.5).tolist(), (1.0, 1.0)) is None
    assert tracker.check(11.1, (1.0, -0.98), STILL) is None  # not there
    assert tracker.check(11.2, (1.0, -1.0), (0.1, 0.0)) is None  # not at rest
    outcome = tracker.check(11.3, (1.0, -0.995), STILL)
    assert outcome.code is TrajectoryCode.SUCCESSFUL
    assert not tracker.busy
    assert tracker.command(20.0) == pytest.approx(END.positions)  # and holds the end


def test_an_arm_that_is_held_up_on_the_way_is_given_up_and_held_there():
    tracker = started()
    outcome = tracker.check(10.7, (0.0, 0.0), STILL)
    assert outcome.code is TrajectoryCode.PATH_TOLERANCE_VIOLATED
    assert "joint 1" in outcome.reason
    assert tracker.command(11.0) == pytest.approx(STILL)


def test_an_arm_that_does_not_arrive_is_given_up_after_a_while():
    tracker = started()
    assert tracker.check(11.4, (0.9, -1.0), STILL) is None
    outcome = tracker.check(11.6, (0.9, -1.0), STILL)
    assert outcome.code is TrajectoryCode.GOAL_TOLERANCE_VIOLATED
    assert "joint 1 is 0.100 rad off" in outcome.reason


def test_without_tolerances_nothing_is_checked():
    tracker = started(TrajectoryTolerances(STILL, STILL, 0.0, 0.0))
    assert tracker.check(10.9, (9.0, 9.0), (5.0, 5.0)) is None
    assert tracker.check(11.0, (9.0, 9.0), (5.0, 5.0)).code is TrajectoryCode.SUCCESSFUL


def test_without_a_goal_time_the_end_may_be_reached_at_any_time():
    tracker = started(replace(TOLERANCES, goal_time_s=0.0))
    assert tracker.check(999.0, (0.9, -1.0), STILL) is None
    assert tracker.check(999.1, (1.0, -1.0), STILL).code is TrajectoryCode.SUCCESSFUL


def test_another_motion_begins_where_the_arm_is():
    tracker = started()
    tracker.start([replace(END, positions=(2.0, 2.0))], TOLERANCES, 10.5, (0.4, -0.4), STILL)
    assert tracker.command(10.5) == pytest.approx((0.4, -0.4))
    assert tracker.command(11.5) == pytest.approx((2.0, 2.0))


def test_fingers_have_stalled_where_they_stand_for_a_while_before_they_are_there():
    fingers = FingerTracker()
    fingers.start(0.0, 5.0)
    assert fingers.check(5.05, 0.06, -0.2) is None
    assert fingers.check(5.10, 0.05, 0.0) is None
    assert fingers.check(5.14, 0.05, 0.0) is None
    assert fingers.check(5.16, 0.05, 0.0) is GripOutcome.STALLED
    assert not fingers.busy
    fingers.start(0.08, 6.0)
    assert fingers.check(6.2, 0.0795, 0.0) is GripOutcome.REACHED


def test_fingers_that_tremble_have_stalled_where_they_go_nowhere():
    """On a round toy of 10 g, the engine's fingers go to and fro by 0.1 mm at 50 mm/s, for ever."""
    fingers = FingerTracker()
    fingers.start(0.0, 5.0)
    times = [5.0 + 0.002 * i for i in range(1, 600)]
    closing = {t: max(0.0428, 0.08 - 0.2 * (t - 5.0)) for t in times}
    outcomes = {
        t: fingers.check(t, gap + 0.00005 * (-1) ** i, 0.04 * (-1) ** i)
        for i, (t, gap) in enumerate(closing.items())
    }
    (stalled_s,) = (t for t, outcome in outcomes.items() if outcome is not None)
    assert outcomes[stalled_s] is GripOutcome.STALLED
    assert closing[stalled_s] == 0.0428
    slow = FingerTracker()  # but not where they are on their way
    slow.start(0.0, 5.0)
    assert all(slow.check(t, 0.08 - 0.01 * (t - 5.0), -0.01) is None for t in times)
