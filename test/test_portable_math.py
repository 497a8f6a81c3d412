# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Functions that are the same on every processor are those of mathematics, and on a grid."""

import numpy as np
import pytest

from slap_ros.portable_math import RESOLUTION, exp, on_grid, tanh, tanh_on_grid
from tools.processors import PLAN, PROCESSORS, RECORDED_RUN, differences, main

VALUES = np.concatenate([np.linspace(-30.0, 30.0, 20001), [-1e-9, 0.0, 1e-9, -800.0, 800.0]])


def test_exp_and_tanh_are_those_of_numpy():
    np.testing.assert_allclose(exp(VALUES[:-2]), np.exp(VALUES[:-2]), rtol=1e-11)
    np.testing.assert_allclose(tanh(VALUES), np.tanh(VALUES), atol=1e-11)


def test_tanh_on_the_grid_is_the_rounded_tanh_to_the_bit():
    halves = np.arctanh((np.arange(-3000, 3000) + 0.5) * RESOLUTION)  # where rounding is unsure
    odd = np.array([0.0, -0.0, np.nan, np.inf, -np.inf, 1e-300, -1e-9])
    random = np.random.default_rng(0).standard_normal(300_000)
    for values in (odd, VALUES, halves, np.nextafter(halves, 1.0), random, 9.0 * random):
        assert tanh_on_grid(values).tobytes() == on_grid(tanh(values)).tobytes()


def test_tanh_of_what_is_no_number():
    np.testing.assert_array_equal(tanh(np.array([np.nan, np.inf, -np.inf])), [np.nan, 1.0, -1.0])


def test_values_that_differ_in_their_last_bits_become_equal():
    values = np.random.default_rng(0).uniform(-3.0, 3.0, 10_000)
    near = np.nextafter(values, np.inf)
    assert on_grid(values).tobytes() == on_grid(near).tobytes() != values.tobytes()
    assert np.abs(on_grid(values) - values).max() <= RESOLUTION / 2
    assert on_grid(np.array([-1e-17])).tobytes() == np.zeros(1).tobytes()


def test_processors_that_are_not_known_are_refused(capsys):
    with pytest.raises(SystemExit):
        main(["nehalem", "abacus"])
    said = " ".join(capsys.readouterr().err.split())
    assert f"no processor 'abacus'; there are {', '.join(PROCESSORS)}" in said


@pytest.mark.slow
@pytest.mark.timeout(300)  # three plans and three runs, each in a process of its own
def test_plans_and_runs_are_the_same_on_other_processors(network):
    """Motion planning is not compiled anew for them: its kernels' own tests stand for it."""
    found = differences(["nehalem", "libraries"], [PLAN, RECORDED_RUN])
    assert not list(map(str, found))
