# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which abstract states a signature might join, in a given task."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from slap_ros.relational import AtomSpace, Predicate
from slap_ros.shortcuts.signature import Change, Pattern, Signature, context_of, kinds


class Reach:
    """Which pairs of abstract states a signature suits, most of it by bits."""

    def __init__(
        self, signature: Signature, space: AtomSpace, grasping: Collection[Predicate]
    ) -> None:
        """``grasping``: the predicates about what is held, see :attr:`Signature.context`."""
        self._signature, self._space, self._grasping = signature, space, grasping
        ordered = sorted(signature.patterns)
        self._adds = [_instances(p, space) for p in ordered if p[0] == "+"]
        self._deletes = [_instances(p, space) for p in ordered if p[0] == "-"]
        kind = kinds(space)
        self._left_alone = ~space.mask(
            atom for atom in space.atoms if all(kind[o] in signature.slots for o in atom.objects)
        )

    def pairs(self, nodes: Sequence[int]) -> Iterator[tuple[int, int]]:
        """Indices of nodes, the later one second."""
        for i, targets in self._by_source(nodes):
            for j in self._whole(nodes, i, targets):
                yield i, j

    def _by_source(self, nodes: Sequence[int]) -> Iterator[tuple[int, Sequence[int]]]:
        """Each node in which it may begin, with the later ones that it might reach.

        Only nodes that agree in what the signature leaves alone are compared, which are few.
        """
        alike: dict[int, list[int]] = {}
        for i, node in enumerate(nodes):
            alike.setdefault(node & self._left_alone, []).append(i)
        for group in alike.values():
            for number, i in enumerate(group):
                if self._may_begin(nodes[i]):
                    yield i, [j for j in group[number + 1 :] if self._suits(nodes[i], nodes[j])]

    def targets(self, nodes: Sequence[int], source: int) -> list[int]:
        """Indices of later nodes that a shortcut might reach from that of index ``source``."""
        if not self._may_begin(nodes[source]):
            return []
        later = range(source + 1, len(nodes))
        suitable = [j for j in later if self._suits(nodes[source], nodes[j])]
        return self._whole(nodes, source, suitable)

    def _may_begin(self, source: int) -> bool:
        return context_of(source, self._grasping, self._space) == self._signature.context

    def _whole(self, nodes: Sequence[int], source: int, targets: Sequence[int]) -> list[int]:
        """The targets that are not on the way to others: it was learned to do all of it."""
        changes = [Change.between(nodes[source], nodes[j]) for j in targets]
        return [
            j
            for j, change in zip(targets, changes, strict=True)
            if not any(_less(change, other) for other in changes)
        ]

    def _suits(self, source: int, target: int) -> bool:
        change = Change.between(source, target)
        return (
            not (change.add | change.delete) & self._left_alone
            and all(change.add & mask for mask in self._adds)
            and all(change.delete & mask for mask in self._deletes)
            and self._signature.suits(change, self._space)
        )


def _less(change: Change, other: Change) -> bool:
    """Whether a change is part of another."""
    part = not change.add & ~other.add and not change.delete & ~other.delete
    return part and change != other


def _instances(pattern: Pattern, space: AtomSpace) -> int:
    """The atoms of a pattern in a task."""
    _, name, wanted = pattern
    kind = kinds(space)
    return space.mask(
        atom
        for atom in space.atoms
        if atom.predicate.name == name and tuple(kind[obj] for obj in atom.objects) == wanted
    )
