# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Worlds of which half are in another process are worlds like any others."""

from functools import partial
from multiprocessing import active_children

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import InvalidStateError
from slap_ros.learning.divided_worlds import divided_worlds
from slap_ros.relational import State

DOMAIN = get_domain("stack_at_target")
MAKE_DOMAIN = partial(get_domain, "stack_at_target")
STARTS = [DOMAIN.task(0, i).initial_state for i in range(5)]


def drawn(rng, worlds):
    space = DOMAIN.action_space
    return rng.uniform(space.low, space.high, (worlds, len(space.axes)))


@pytest.mark.parametrize("count", [1, 2, 5])
def test_they_step_as_others_do(count):
    """Also after one of them was set anew, wherever it is, and with several batches of them."""
    rng, states = np.random.default_rng(0), STARTS[:count]
    whole = DOMAIN.make_vector_world(states)
    with divided_worlds(DOMAIN, MAKE_DOMAIN) as make_worlds:
        others, divided = make_worlds(STARTS[::-1]), make_worlds(states)
        np.testing.assert_array_equal(divided.states.data, whole.states.data)
        for step in range(12):
            actions = drawn(rng, count)
            stepped = divided.step(actions)
            np.testing.assert_array_equal(stepped.data, whole.step(actions).data)
            others.step(drawn(rng, len(STARTS)))
            for worlds in (whole, divided):
                worlds.reset(step % count, STARTS[step % len(STARTS)])
            np.testing.assert_array_equal(divided.states.data, whole.states.data)
    assert not active_children()


def test_a_state_that_the_other_process_refuses_is_an_error_here():
    with divided_worlds(DOMAIN, MAKE_DOMAIN) as make_worlds:
        divided = make_worlds(STARTS)
        divided.reset(
            len(STARTS) - 1, State(STARTS[0].layout, np.full_like(STARTS[0].data, np.nan))
        )
        with pytest.raises(InvalidStateError, match="finite"):
            divided.step(np.zeros((len(STARTS), len(DOMAIN.action_space.axes))))


def test_worlds_that_are_refused_here_do_not_shift_those_there():
    bad = State(STARTS[0].layout, np.full_like(STARTS[0].data, np.nan))
    hold = np.zeros((2, len(DOMAIN.action_space.axes)))
    with divided_worlds(DOMAIN, MAKE_DOMAIN) as make_worlds:
        with pytest.raises(InvalidStateError):
            make_worlds([bad, STARTS[0]])
        first, second = make_worlds(STARTS[1:3]), make_worlds(STARTS[3:5])
        for worlds, states in ((first, STARTS[1:3]), (second, STARTS[3:5])):
            expected = DOMAIN.make_vector_world(states).step(hold)
            np.testing.assert_array_equal(worlds.step(hold).data, expected.data)


def test_a_process_that_was_killed_is_noticed():
    with divided_worlds(DOMAIN, MAKE_DOMAIN) as make_worlds:
        divided = make_worlds(STARTS)
        (process,) = active_children()
        process.kill()
        with pytest.raises(ChildProcessError, match="a process that stepped worlds ended"):
            divided.step(np.zeros((len(STARTS), len(DOMAIN.action_space.axes))))
