# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The episodes of a bag: states, atoms and commands as core objects."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import isfinite
from typing import Any

from slap_ros.bags.reader import Bag
from slap_ros.core import Domain
from slap_ros.errors import ForeignBagError, InvalidLibraryError, SkillsChangedError
from slap_ros.evaluation.atom_names import AtomNames, atom_names
from slap_ros.messages.decode import decode_state, stamp_ns
from slap_ros.messages.interfaces import (
    ACQUISITION_EVENT,
    ATOMS,
    BODIES,
    COMMAND,
    DOMAIN_INFO,
    MARKERS,
    STATE,
    TASK,
)
from slap_ros.messages.protocols import (
    AcquisitionEventMessage,
    AtomsMessage,
    CommandMessage,
    DomainInfoMessage,
    MarkersMessage,
    StateMessage,
    TaskMessage,
)
from slap_ros.relational import State
from slap_ros.skills.domain_choice import NO_SKILLS, DomainChoice, open_domain


@dataclass
class RecordedEpisode:
    """What is known of an episode; everything by step."""

    task: TaskMessage | None = None
    states: dict[int, StateMessage] = field(default_factory=dict)
    atoms: dict[int, AtomNames] = field(default_factory=dict)
    exact: set[int] = field(default_factory=set)  # steps of atoms that can be found again
    commands: dict[int, list[CommandMessage]] = field(default_factory=dict)  # in order of arrival

    @property
    def objects(self) -> list[tuple[str, str]]:
        """Name and type of each object, those of all its states; empty where it has none yet."""
        if self.task is not None:
            return _names(self.task.initial_state)
        return next(map(_names, self.states.values()), [])


class Recording:
    """Collects the messages of an ensemble by episode."""

    def __init__(self) -> None:
        self.episodes: dict[int, RecordedEpisode] = {}
        self.domain_info: DomainInfoMessage | None = None
        self.markers: dict[int, MarkersMessage] = {}  # by stamp, ns
        self.acquisition: list[AcquisitionEventMessage] = []  # in order of arrival
        self.not_finite = 0  # states
        self.contradicting = 0  # states of which there is another, or of others' objects
        self._add: Mapping[str, Callable[[Any], None]] = {
            DOMAIN_INFO: self._add_domain,
            TASK: self._add_task,
            STATE: self._add_state,
            ATOMS: self._add_atoms,
            COMMAND: self._add_command,
            MARKERS: self._add_markers,
            ACQUISITION_EVENT: self.acquisition.append,
        }

    @classmethod
    def of(cls, bag: Bag, namespace: str | None = None) -> Recording:
        """Everything of one ensemble in a bag.

        Args:
            bag: Bag to read.
            namespace: Namespace of the ensemble; None for the only one.

        Raises:
            InvalidParameterError: There is no such ensemble, or several to choose from.
        """
        only = bag.ensembles.only(namespace)
        return cls.by_namespace(bag)[only]

    @classmethod
    def by_namespace(cls, bag: Bag) -> dict[str, Recording]:
        """Everything in a bag, by the namespace of its ensemble."""
        found = {namespace: cls() for namespace in bag.ensembles.namespaces}
        for topic, type_name, _, message in bag:
            if (namespace := bag.ensembles.of(topic, type_name)) is not None:
                found[namespace].add(type_name, message)
        return found

    def add(self, type_name: str, message: object) -> None:
        """Take a message; types that belong to no episode are left out."""
        if type_name in self._add:
            self._add[type_name](message)

    def _episode(self, number: int) -> RecordedEpisode:
        return self.episodes.setdefault(number, RecordedEpisode())

    def _add_domain(self, msg: DomainInfoMessage) -> None:
        self.domain_info = msg

    def _add_task(self, msg: TaskMessage) -> None:
        episode = self._episode(msg.episode)
        if episode.task is None or not episode.states:  # else it is another simulator's
            episode.task = msg

    def _add_state(self, msg: StateMessage) -> None:
        if not all(isfinite(value) for obj in msg.objects for value in obj.features):
            self.not_finite += 1  # no world publishes it, and no node acts on it
            return
        episode = self._episode(msg.episode)
        if (objects := episode.objects) and objects != _names(msg):
            self.contradicting += 1  # of another simulator
            return
        kept = episode.states.setdefault(msg.step, msg)
        self.contradicting += kept is not msg and _features(kept) != _features(msg)

    def _add_atoms(self, msg: AtomsMessage) -> None:
        episode = self._episode(msg.episode)
        episode.atoms.setdefault(msg.step, atom_names(msg.atoms))
        if msg.exact:
            episode.exact.add(msg.step)

    def _add_command(self, msg: CommandMessage) -> None:
        commands = self._episode(msg.episode).commands
        commands.setdefault(msg.step, []).append(msg)

    def _add_markers(self, msg: MarkersMessage) -> None:
        if any(marker.ns == BODIES for marker in msg.markers):
            self.markers.setdefault(stamp_ns(msg.markers[0].header), msg)

    def domain(self) -> Domain | None:
        """The domain that was recorded; None where the bag breaks off before naming it.

        Where the library of skills that was used is not at hand, the domain has none: what is
        perceived, drawn and replayed needs none.

        Raises:
            UnknownDomainError: It is not known here.
            InvalidParameterError: Its preset, or its skills, are not known here.
            ForeignBagError: It has other types or features here.
        """
        info = self.domain_info
        if info is None:
            return None
        domain = _open(DomainChoice.announced(info))
        recorded = {t.name: [str(name) for name in t.feature_names] for t in info.types}
        here = {t.name: [feature.name for feature in t.features] for t in domain.types}
        if recorded != here:
            raise ForeignBagError(
                f"version mismatch: {info.name} was recorded with types {recorded} and has "
                f"{here} here; read the bag with the version of slap_ros that wrote it"
            )
        return domain


def _names(state: StateMessage) -> list[tuple[str, str]]:
    return [(obj.name, obj.type) for obj in state.objects]


def _features(state: StateMessage) -> list[tuple[str, tuple[float, ...]]]:
    return [(obj.name, tuple(obj.features)) for obj in state.objects]


def _open(choice: DomainChoice) -> Domain:
    """The domain, without skills where its library is not the one that ships here."""
    try:
        return open_domain(choice)
    except (InvalidLibraryError, SkillsChangedError):
        return open_domain(replace(choice, skills=NO_SKILLS, digest=""))


def initial_state(episode: RecordedEpisode, domain: Domain) -> tuple[int, State] | None:
    """The task's initial state, or else the first one recorded, with its step.

    Raises:
        InvalidStateError: It is no state of the domain.
    """
    types = domain.types_by_name
    if episode.task is not None:
        return 0, decode_state(episode.task.initial_state, types)
    if episode.states:
        first = min(episode.states)
        return first, decode_state(episode.states[first], types)
    return None
