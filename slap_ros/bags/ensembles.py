# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ensembles in a recording: which topics belong together, by their namespace.

Several robots have an ensemble each, in one recording: ``/robot1/slap/state`` beside
``/robot2/slap/state``. Within an ensemble names do not matter: a topic may have been remapped, as
long as there is no other of its type that it could be mistaken for.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping

from slap_ros.bags.raw import Channel
from slap_ros.errors import InvalidParameterError
from slap_ros.messages.interfaces import (
    ACQUISITION_EVENT,
    ATOMS,
    COMMAND,
    DOMAIN_INFO,
    FAULT,
    MARKERS,
    PLAN,
    PLAN_EVENT,
    SKILL_EVENT,
    SKILL_LIBRARY,
    STATE,
    TASK,
)

ROOT = "/"
USUAL_NAMES: Mapping[str, str] = {
    DOMAIN_INFO: "slap/domain",
    TASK: "slap/task",
    STATE: "slap/state",
    ATOMS: "slap/atoms",
    COMMAND: "slap/command",
    FAULT: "slap/fault",
    PLAN: "slap/plan",
    PLAN_EVENT: "slap/plan_events",
    SKILL_EVENT: "slap/skill_events",
    ACQUISITION_EVENT: "slap/acquisition_events",
    SKILL_LIBRARY: "slap/skills",
    MARKERS: "slap/markers",
}
Topic = tuple[str, str]  # its name, and the type of its messages


class Ensembles:
    """The ensembles of a bag.

    Attributes:
        namespaces: Namespace of each, sorted; ``/`` for one without.
        left_out: Topics of slap_msgs that belong to no ensemble for certain, sorted.
    """

    def __init__(self, channels: Iterable[Channel]) -> None:
        """Sort the topics of a bag by ensemble."""
        topics = {
            (channel.topic, channel.type_name)
            for channel in channels
            if channel.type_name in USUAL_NAMES
        }
        counted = Counter(kind for _, kind in topics if kind != MARKERS)
        usual = {topic: space for topic in topics if (space := _usual_namespace(topic)) is not None}
        spaces = {space for (_, kind), space in usual.items() if kind != MARKERS}
        if len(spaces) <= 1 and max(counted.values(), default=1) == 1:
            self._of = dict.fromkeys(topics, next(iter(spaces), ROOT))
        else:
            self._of = usual | _renamed_ensembles(topics - usual.keys())
            self._of |= _renamed_topics(topics - self._of.keys(), self._of)
        self.namespaces = tuple(
            sorted({space for (_, kind), space in self._of.items() if kind != MARKERS}) or [ROOT]
        )
        self.left_out = tuple(
            sorted(name for name, kind in topics - self._of.keys() if kind != MARKERS)
        )

    def of(self, topic: str, type_name: str) -> str | None:
        """The namespace of the ensemble to which a topic belongs; None if it belongs to none."""
        return self._of.get((topic, type_name))

    def chosen(self, namespace: str | None) -> tuple[str, ...]:
        """The namespaces that are meant: one, or all.

        Args:
            namespace: Namespace of an ensemble, with or without the first slash; None for all.

        Raises:
            InvalidParameterError: There is no such ensemble.
        """
        if namespace is None:
            return self.namespaces
        wanted = ROOT + namespace.strip(ROOT)
        if wanted not in self.namespaces:
            raise InvalidParameterError(
                f"no ensemble was recorded in the namespace {wanted}, only in {self._listed}"
            )
        return (wanted,)

    def only(self, namespace: str | None) -> str:
        """The namespace that is meant, where there can be only one.

        Raises:
            InvalidParameterError: There is no such ensemble, or there are several to choose from.
        """
        chosen = self.chosen(namespace)
        if len(chosen) > 1:
            raise InvalidParameterError(
                f"the bag has {len(chosen)} ensembles: choose with --namespace, of {self._listed}"
            )
        return chosen[0]

    @property
    def _listed(self) -> str:
        return ", ".join(self.namespaces)


def _usual_namespace(topic: Topic) -> str | None:
    """The namespace of a topic under its usual name; None for one that was renamed."""
    name, kind = topic
    usual = ROOT + USUAL_NAMES[kind]
    return (name.removesuffix(usual) or ROOT) if name.endswith(usual) else None


def _renamed_ensembles(topics: Iterable[Topic]) -> dict[Topic, str]:
    """Topics whose part before the last slash they share with both a task and states."""
    by_parent: defaultdict[str, set[Topic]] = defaultdict(set)
    for topic in topics:
        by_parent[topic[0].rpartition(ROOT)[0] or ROOT].add(topic)
    return {
        topic: parent
        for parent, together in by_parent.items()
        if {TASK, STATE} <= {kind for _, kind in together}
        for topic in together
    }


def _renamed_topics(topics: Iterable[Topic], known: Mapping[Topic, str]) -> dict[Topic, str]:
    """Single topics that belong to the innermost ensemble around them, if it lacks their type."""
    has = {(space, kind) for (_, kind), space in known.items()}
    spaces = sorted(set(known.values()), key=len, reverse=True)
    found: dict[Topic, str] = {}
    for topic in topics:
        name, kind = topic
        around = (space for space in spaces if name.startswith(space.rstrip(ROOT) + ROOT))
        space = next(around, None)
        if space is not None and ((space, kind) not in has or kind == MARKERS):
            found[topic] = space
    claimed = Counter((space, kind) for (_, kind), space in found.items() if kind != MARKERS)
    return {topic: space for topic, space in found.items() if claimed[space, topic[1]] <= 1}
