# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Learning ends when plans get no shorter, and a run that goes on knows what was validated."""

from math import inf

import pytest

from slap_ros.errors import InvalidParameterError
from slap_ros.shortcuts.stopping import PlanLengths, Stopping, Validation, is_flat, read_validations

RULE = Stopping(every=100, patience=2, least_saving=0.02)


@pytest.mark.parametrize(
    ("lengths", "flat"),
    [
        ([], False),
        ([50.0], False),
        ([50.0, 50.0], False),  # two more are to be waited for
        ([50.0, 50.0, 50.0], True),
        ([50.0, 49.5, 49.2], True),  # shorter, by less than 2 %
        ([50.0, 49.5, 48.9], False),
        ([50.0, 48.0, 48.0], False),  # the 48.0 itself was shorter
        ([50.0, 48.0, 48.0, 47.9], True),
        ([inf, inf, inf, inf], False),  # nothing was learned yet
        ([inf, 50.0, 50.0], False),
        ([40.0, inf, inf], True),
    ],
)
def test_a_stage_is_over_when_plans_get_no_shorter(lengths, flat):
    assert is_flat(lengths, RULE) == flat


def test_plans_are_made_once_in_each_interval_and_kept(tmp_path):
    path, lengths = tmp_path / "plan_lengths.jsonl", iter([inf, 50.0, 30.0, 30.0, 31.0])
    first = PlanLengths(path, RULE, lambda: next(lengths))
    assert [first.go_on(0, steps) for steps in (60, 120, 180, 240, 330)] == [True] * 5
    again = PlanLengths(path, RULE, lambda: next(lengths))  # interrupted, and continued
    assert again.go_on(0, 330)
    assert again.go_on(0, 400)
    assert not again.go_on(0, 500)
    assert next(lengths, None) is None
    ended = PlanLengths(path, RULE, lambda: next(lengths))
    assert not ended.go_on(0, 0)  # so that a stage that is over is not learned any further
    assert ended.go_on(1, 0)
    assert read_validations(path) == [
        Validation(0, 120, inf),
        Validation(0, 240, 50.0),
        Validation(0, 330, 30.0),
        Validation(0, 400, 30.0),
        Validation(0, 500, 31.0),
    ]


def test_half_a_line_is_left_out_and_damage_is_named(tmp_path):
    path = tmp_path / "plan_lengths.jsonl"
    path.write_text('{"stage": 0, "steps": 100, "plan_length": 9.0}\n{"stage": 0, "st')
    assert read_validations(path) == [Validation(0, 100, 9.0)]
    PlanLengths(path, RULE, lambda: 8.0).go_on(0, 200)
    assert read_validations(path) == [Validation(0, 100, 9.0), Validation(0, 200, 8.0)]
    path.write_text('{"stage": 0, "steps": 100}\n')
    with pytest.raises(InvalidParameterError, match=r"plan_lengths\.jsonl.*damaged"):
        read_validations(path)
