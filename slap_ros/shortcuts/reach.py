# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which abstract states a signature might join, in a given task."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from slap_ros.relational import AtomSpace
from slap_ros.shortcuts.signature import Change, Pattern, Signature, kinds


class Reach:
    """Which pairs of abstract states a signature suits, most of it by bits."""

    def __init__(self, signature: Signature, space: AtomSpace) -> None:
        self._signature, self._space = signature, space
        ordered = sorted(signature.patterns)
        self._adds = [_instances(p, space) for p in ordered if p[0] == "+"]
        self._deletes = [_instances(p, space) for p in ordered if p[0] == "-"]
        kind = kinds(space)
        self._left_alone = ~space.mask(
            atom for atom in space.atoms if all(kind[o] in signature.slots for o in atom.objects)
        )

    def pairs(self, nodes: Sequence[int]) -> Iterator[tuple[int, int]]:
        """Indices of nodes, the later one second.

        Only nodes that agree in what the signature leaves alone are compared, which are few.
        """
        alike: dict[int, list[int]] = {}
        for i, node in enumerate(nodes):
            alike.setdefault(node & self._left_alone, []).append(i)
        for group in alike.values():
            for number, j in enumerate(group):
                for i in group[:number]:
                    if self._suits(nodes[i], nodes[j]):
                        yield i, j

    def targets(self, nodes: Sequence[int], source: int) -> Iterator[int]:
        """Indices of later nodes that a shortcut might reach from that of index ``source``."""
        for j in range(source + 1, len(nodes)):
            if self._suits(nodes[source], nodes[j]):
                yield j

    def _suits(self, source: int, target: int) -> bool:
        change = Change.between(source, target)
        return (
            not (change.add | change.delete) & self._left_alone
            and all(change.add & mask for mask in self._adds)
            and all(change.delete & mask for mask in self._deletes)
            and self._signature.suits(change, self._space)
        )


def _instances(pattern: Pattern, space: AtomSpace) -> int:
    """The atoms of a pattern in a task."""
    _, name, wanted = pattern
    kind = kinds(space)
    return space.mask(
        atom
        for atom in space.atoms
        if atom.predicate.name == name and tuple(kind[obj] for obj in atom.objects) == wanted
    )
