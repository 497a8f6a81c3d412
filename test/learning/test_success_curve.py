# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The curve in a record is that of the whole training, whatever interrupted it."""

from __future__ import annotations

from slap_ros.learning.success_curve import SuccessPoint, recorded_curve, success_curve


def test_what_an_interrupted_run_did_twice_counts_the_second_time() -> None:
    first = [(0, SuccessPoint(steps, 0.1)) for steps in (10, 20, 30)]
    again = [(0, SuccessPoint(20, 0.2)), (0, SuccessPoint(40, 0.4)), (1, SuccessPoint(5, 0.5))]
    curve = success_curve([*first, *again])
    assert curve == [[10, 0.1], [20, 0.2], [40, 0.4], [45, 0.5]]
    assert recorded_curve({"success_curve": curve})[-1] == SuccessPoint(45, 0.5)


def test_a_long_curve_has_a_hundred_points_at_even_distances_and_the_last() -> None:
    curve = success_curve((0, SuccessPoint(steps, 1.0)) for steps in range(1, 1001))
    assert [point[0] for point in curve] == list(range(10, 1001, 10))


def test_the_record_of_an_older_version_has_no_curve() -> None:
    assert recorded_curve({"environment_steps": 10}) == ()
