# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Joint states as drivers send them: read by the standard, or refused whole."""

import math
from array import array

import numpy as np
import pytest

from slap_ros.errors import InvalidMeasurementError
from slap_ros.robot.joint_reading import JointLists, gap_between, require_radians
from slap_ros.robot.limits import ARMS

NAMES = ["rail", "a", "b"]


def test_lists_that_fit_are_read_by_name_in_any_order_and_beside_others():
    joints = JointLists(NAMES[::-1], [3.0, 2.0, 1.0])
    assert dict(joints.position) == {"rail": 1.0, "a": 2.0, "b": 3.0}
    assert joints.velocity == {}


@pytest.mark.parametrize("kind", [list, tuple, np.array, lambda v: array("d", v)])
def test_a_list_of_any_kind_may_be_empty(kind):
    joints = JointLists(NAMES, kind([]), kind([1.0, 2.0, 3.0]), kind([]))
    assert joints.position == {} and joints.velocity["a"] == 2.0
    assert JointLists([], kind([])).position == {}


@pytest.mark.parametrize("what", ["positions", "velocities", "efforts"])
@pytest.mark.parametrize("length", [1, 2, 4])
def test_a_list_of_another_length_makes_all_of_them_unknown(what, length):
    with pytest.raises(InvalidMeasurementError, match=rf"3 names, but a list \w+ of {length}"):
        JointLists(NAMES, **{"positions": [0.0] * 3, what: [0.0] * length})


def test_a_name_that_occurs_twice_is_refused():
    with pytest.raises(InvalidMeasurementError, match="names a, b twice"):
        JointLists(["a", "b", "a", "b"], [0.0] * 4)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_positions_in_another_unit_are_refused_and_those_at_a_limit_are_not(arm):
    for joints in (arm.low, arm.high):
        require_radians(joints, arm.low, arm.high)
    middle = [0.5 * (a + b) for a, b in zip(arm.low, arm.high, strict=True)]
    for spoilt in ([math.degrees(q) for q in arm.high], [math.nan, *middle[1:]]):
        with pytest.raises(InvalidMeasurementError, match=r"joint \d .*in rad\?"):
            require_radians(spoilt, arm.low, arm.high)


def test_a_gap_is_in_metres():
    assert gap_between([0.04, 0.04]) == 0.08
    for fingers in ([40.0, 40.0], [0.04, math.nan], [-math.inf, 0.0]):
        with pytest.raises(InvalidMeasurementError, match=r"positions in m\?"):
            gap_between(fingers)
