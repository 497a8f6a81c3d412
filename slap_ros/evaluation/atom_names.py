# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ground atoms by their names alone, as messages have them."""

from __future__ import annotations

from collections.abc import Iterable

from slap_ros.messages.protocols import GroundAtomMessage

AtomNames = frozenset[tuple[str, tuple[str, ...]]]  # (predicate, objects)


def atom_names(msgs: Iterable[GroundAtomMessage]) -> AtomNames:
    """The names of the predicate and the objects of each atom in messages."""
    return frozenset((msg.predicate, tuple(msg.objects)) for msg in msgs)


def describe(atoms: Iterable[tuple[str, tuple[str, ...]]]) -> str:
    """Atoms by their names, for people."""
    return ", ".join(f"{predicate}({', '.join(objs)})" for predicate, objs in sorted(atoms))
