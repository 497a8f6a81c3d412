# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which option a goal of the skill server asks for."""

from __future__ import annotations

from collections.abc import Sequence

from slap_msgs.action import ExecuteSkill
from slap_msgs.msg import PlanEdge

from ensemble.observation import Observation
from ensemble.shortcuts import ShortcutProvider
from slap_ros.errors import UnknownSkillError
from slap_ros.messages.decode import decode_target
from slap_ros.planning.options import HOLD, Option, OptionKind, given_option, hold_option
from slap_ros.relational import Object, Target


def requested_option(
    request: ExecuteSkill.Goal, start: Observation, provider: ShortcutProvider
) -> tuple[Option, Target]:
    """The option that a goal asks for and where it shall end.

    Args:
        request: The goal.
        start: Where the robot is.
        provider: The shortcuts that there are.

    Returns:
        The option, and its target over the episode's atom space.

    Raises:
        EpisodeChangedError: The goal is for another episode.
        UnknownSkillError: There is no such option, or it does not lead there from here.
        UnknownObjectError: The task has no such object.
    """
    episode, edge = start.episode, request.edge
    start.require_episode(request.episode)
    if edge.name == HOLD:
        hold = hold_option(episode.domain.action_space)
        return hold, hold.target(0)
    objects = [episode.space.layout.object(name) for name in edge.objects]
    target = decode_target(edge, episode.space)
    if edge.kind == OptionKind.SHORTCUT.value:
        return _shortcut(edge, objects, start, target, provider), target
    return given_option(episode.domain, edge.name, objects), target


def _shortcut(
    edge: PlanEdge,
    objects: Sequence[Object],
    start: Observation,
    target: Target,
    provider: ShortcutProvider,
) -> Option:
    """The shortcut that an edge names, from where the robot is."""
    episode, name = start.episode, edge.name
    known = [shortcut.name for shortcut in provider.shortcuts(episode.domain)]
    grounded = provider.grounded(episode, start.state)
    if grounded is None or name not in known:
        loaded = f"there are {', '.join(known)}" if known else "no shortcut library is loaded"
        raise UnknownSkillError(f"unknown shortcut {name!r}: {loaded}")
    space, known = episode.space, episode.domain.atom_space(start.state)
    option = grounded.option(
        name,
        space.project(start.abstract, known),
        target.projected(space, known),
        edge.attempt,
    )
    if option is None:
        raise UnknownSkillError(
            f"{name} does not lead from here to the expected atoms: what they change is not what "
            "it was learned for"
        )
    if tuple(objects) != option.objects:
        about, got = (", ".join(map(str, names)) for names in (option.objects, objects))
        raise UnknownSkillError(
            f"{name} from here to the expected atoms is about ({about}), not ({got})"
        )
    return option
