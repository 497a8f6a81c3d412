# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which of the recorded commands the simulator took: a bag has those that it refused as well."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress

import numpy as np

from slap_ros.core import Action, ActionSpace, Domain, World
from slap_ros.errors import InvalidCommandError
from slap_ros.messages.decode import decode_command
from slap_ros.messages.protocols import CommandMessage
from slap_ros.relational import State


def taken_commands(
    domain: Domain, states: Mapping[int, State], commands: Mapping[int, Sequence[CommandMessage]]
) -> dict[int, Action]:
    """The command that was taken at each step.

    It is the first within the robot's limits. Where there are several, in arrival order, a world
    tells which one leads to the recorded state; where none does, the first is as good as any.

    Args:
        domain: The domain that was recorded.
        states: Recorded states, by step.
        commands: Recorded commands, by the step that they answer, in order of arrival.

    Returns:
        An action by step. The last state has none, as nothing shows that a command was taken.
    """
    taken = {}
    world: World | None = None
    for step in sorted(states)[:-1]:
        candidates = _distinct(_within_limits(commands.get(step, ()), domain.action_space))
        if len(candidates) > 1 and step + 1 in states:
            world = world or domain.make_world(states[step])
            leading = _leading(world, states[step], states[step + 1], candidates)
            candidates = [leading, *candidates] if leading is not None else candidates
        if candidates:
            taken[step] = candidates[0]
    return taken


def _within_limits(messages: Iterable[CommandMessage], actions: ActionSpace) -> list[Action]:
    found = []
    for message in messages:
        with suppress(InvalidCommandError):  # the simulator refused it just so
            action = decode_command(message, actions)
            actions.check(action)
            found.append(action)
    return found


def _distinct(actions: Iterable[Action]) -> list[Action]:
    """The actions without repetitions, in order."""
    return list({action.tobytes(): action for action in actions}.values())


def _leading(
    world: World, before: State, after: State, candidates: Iterable[Action]
) -> Action | None:
    """The first action that leads from one state to the next; None if none does."""
    for action in candidates:
        world.reset(before)
        with suppress(InvalidCommandError):
            if np.array_equal(world.step(action).data, after.data):
                return action
    return None
