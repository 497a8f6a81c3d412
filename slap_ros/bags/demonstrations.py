# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The demonstrations in a bag: which atoms held, step by step."""

from __future__ import annotations

from slap_ros.bags.reader import Bag
from slap_ros.bags.recording import RecordedEpisode, Recording, initial_state
from slap_ros.core import Domain
from slap_ros.errors import ForeignBagError
from slap_ros.messages.decode import decode_state
from slap_ros.relational import GroundAtom

Demonstration = tuple[frozenset[GroundAtom], ...]  # by step


def read_demonstrations(bag: Bag, domain: Domain) -> list[Demonstration]:
    """The episodes of a bag as atoms, from the recorded states.

    Args:
        bag: Bag of one or more ensembles.
        domain: The one that was recorded.

    Returns:
        A demonstration per episode that has states, of all ensembles of this domain.

    Raises:
        ForeignBagError: The bag is of another domain, or has no states.
    """
    recordings = Recording.by_namespace(bag).values()
    infos = [recording.domain_info for recording in recordings]
    names = {"no domain" if info is None else info.name for info in infos}
    if domain.name not in names:
        raise ForeignBagError(
            f"{bag.path} has recorded {', '.join(sorted(names))}, not {domain.name}"
        )
    found = [
        shown
        for recording, info in zip(recordings, infos, strict=True)
        if info is not None and info.name == domain.name
        for episode in recording.episodes.values()
        if (shown := _demonstration(episode, domain)) is not None
    ]
    if not found:
        raise ForeignBagError(f"{bag.path} has no states, so it shows nothing")
    return found


def _demonstration(episode: RecordedEpisode, domain: Domain) -> Demonstration | None:
    """The atoms of an episode; None without states."""
    first = initial_state(episode, domain)
    if first is None or not episode.states:
        return None
    space = domain.atom_space(first[1])
    states = (episode.states[step] for step in sorted(episode.states))
    masks = (space.abstract(decode_state(msg, domain.types_by_name)) for msg in states)
    return tuple(frozenset(space.decode(mask)) for mask in masks)
