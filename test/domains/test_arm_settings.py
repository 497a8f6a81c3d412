# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the arm may move in the domains on a table: at which timing, and shortcuts how fast."""

from contextlib import suppress

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError, SkillNotApplicableError
from slap_ros.portable_math import RESOLUTION
from slap_ros.worlds.panda import MAX_STEP

DOMAINS = ("obstacle_tower", "cluttered_drawer", "cleanup_table")
LIMITS = np.array([*MAX_STEP, 1.0])


@pytest.mark.parametrize("name", DOMAINS)
def test_what_shortcuts_may_command(name):
    share = 1.0 if name == "obstacle_tower" else 1 / 3
    for preset, speed in [("fair", 1.0), ("paper", share), ("fair:shortcut_speed=0.25", 0.25)]:
        learned = get_domain(name, preset).learned_actions
        wanted = LIMITS * [*(speed,) * len(MAX_STEP), 1.0]  # the gripper as ever
        np.testing.assert_array_equal(learned.high, wanted)
        np.testing.assert_array_equal(learned.low, -wanted)


def first_policy(domain, state):
    """Of the first option that can be started."""
    space = domain.atom_space(state)
    truth = space.abstract(state)
    for option in domain.ground(space):
        if option.applicable(truth):
            with suppress(SkillNotApplicableError):
                return domain.skills[option.operator.name].start(state, option.objects)
    raise AssertionError("no option can be started")


def first_motion(domain):
    """Until the gripper is to do something, by the first option that can be started."""
    state = domain.task(0).initial_state
    policy, world, moves = first_policy(domain, state), domain.make_world(state), []
    while (action := policy(state)) is not None and not action[-1]:
        state = world.step(action)
        moves.append(action)
    return np.array(moves)


@pytest.mark.parametrize("name", DOMAINS)
def test_skills_are_as_fast_as_the_joints_may_move(name):
    share = (np.abs(first_motion(get_domain(name, "fair:timing=limit"))) / LIMITS).max()
    assert 0.9 < share <= 1.0 + 1e-6


def test_skills_move_in_tens():
    moves = first_motion(get_domain("obstacle_tower", "fair:timing=tens"))
    assert len(moves) % 10 == 0
    for piece in moves.reshape(-1, 10, 8):
        even = np.broadcast_to(piece[0], piece.shape)
        np.testing.assert_allclose(piece, even, atol=2 * RESOLUTION)  # of each end, once


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ("timing=fast", "'timing' is fast; it must be limit or tens"),
        ("shortcut_speed=0", "'shortcut_speed' is 0.0; it must be from 0.01 to 1"),
        ("shortcut_speed=2", "'shortcut_speed' is 2.0; it must be from 0.01 to 1"),
        ("shortcut_speed=nan", "'shortcut_speed' is nan"),
    ],
)
@pytest.mark.parametrize("preset", ["fair", "paper"])
def test_settings_that_make_no_sense(preset, changed, message):
    with pytest.raises(InvalidParameterError, match=message):
        get_domain("obstacle_tower", f"{preset}:{changed}")
