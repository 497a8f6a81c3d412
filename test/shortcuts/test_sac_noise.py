# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The observations over which the noise of a shortcut that SAC learned is measured."""

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from gymnasium.spaces import Box
from stable_baselines3.common.buffers import ReplayBuffer

from slap_ros.shortcuts.sac import RECENT_ROWS, recent_observations

ROWS, ENVS = 2 * RECENT_ROWS, 2
SPACE = Box(-np.inf, np.inf, (1,))


def filled(added):
    """A buffer after so many steps; what was observed in each is its number, from 1."""
    buffer = ReplayBuffer(ROWS * ENVS, SPACE, SPACE, "cpu", ENVS)
    for number in range(1, added + 1):
        seen = np.full((ENVS, 1), number, np.float32)
        buffer.add(seen, seen, seen, np.zeros(ENVS), np.zeros(ENVS), [{}] * ENVS)
    return buffer


@pytest.mark.parametrize("added", [1, 5, RECENT_ROWS + 3, ROWS, ROWS + 5, 2 * ROWS, 3 * ROWS - 1])
def test_the_last_observations_are_those_of_the_last_steps(added):
    """Also where the buffer was full and began again, as after a whole training."""
    last = np.arange(max(0, added - RECENT_ROWS), added) + 1
    assert recent_observations(filled(added)).ravel().tolist() == np.repeat(last, ENVS).tolist()


def test_an_empty_buffer_has_zeros():
    assert not recent_observations(filled(0)).any()
