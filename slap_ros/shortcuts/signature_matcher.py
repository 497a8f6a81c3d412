# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which abstract states a shortcut's signature may join in a given task."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from functools import reduce
from operator import or_

from slap_ros.relational import AtomSpace, Predicate
from slap_ros.shortcuts.signature import Change, Signature, instances, kinds


class SignatureMatcher:
    """Finds the pairs of abstract states that a signature matches, mostly by bit masks."""

    def __init__(
        self, signature: Signature, space: AtomSpace, grasping: Collection[Predicate]
    ) -> None:
        """Prepare the masks of the signature's patterns.

        Args:
            signature: Signature to match.
            space: Atoms of the task.
            grasping: Predicates about what is held; see :attr:`Signature.context`.
        """
        self._signature, self._space = signature, space
        adds = [instances(p, space) for p in signature.patterns if p[0] == "+"]
        deletes = [instances(p, space) for p in signature.patterns if p[0] == "-"]
        self.may_be_added = reduce(or_, adds, 0)  # for any objects, a mask
        self._may_be_deleted = reduce(or_, deletes, 0)
        self._adds_some, self._deletes_some = bool(adds), bool(deletes)
        self._context = [
            (_fluents(name, space), name in signature.context)
            for name in sorted({*signature.context, *(p.name for p in grasping)})
        ]
        self._conditions: dict[Change, Sequence[tuple[int, int]] | None] = {}
        kind = kinds(space)
        self.left_alone = ~space.mask(
            atom for atom in space.atoms if all(kind[o] in signature.slots for o in atom.objects)
        )

    def pairs(self, nodes: Sequence[int]) -> Iterator[tuple[int, int]]:
        """Yield the pairs of nodes that a shortcut may join, as indices, the later one second."""
        for i, targets in self._by_source(nodes):
            for j in self._maximal(nodes, i, targets):
                yield i, j

    def _by_source(self, nodes: Sequence[int]) -> Iterator[tuple[int, Sequence[int]]]:
        """Yield each node in which a shortcut may begin, with the later ones that match.

        Only nodes that agree in what the signature leaves alone are compared, which are few.
        """
        alike: dict[int, list[int]] = {}
        for i, node in enumerate(nodes):
            alike.setdefault(node & self.left_alone, []).append(i)
        for group in alike.values():
            for number, i in enumerate(group):
                if self.may_begin(nodes[i]):
                    yield i, [j for j in group[number + 1 :] if self.matches(nodes[i], nodes[j])]

    def targets(self, nodes: Sequence[int], source: int) -> list[int]:
        """The indices of the later nodes that a shortcut may reach from the node ``source``."""
        if not self.may_begin(nodes[source]):
            return []
        later = range(source + 1, len(nodes))
        matching = [j for j in later if self.matches(nodes[source], nodes[j])]
        return self._maximal(nodes, source, matching)

    def may_begin(self, source: int) -> bool:
        """Whether as much is held as in training; see :func:`~.signature.context_of`.

        Args:
            source: Abstract state in which a shortcut would begin, a mask.
        """
        return all(bool(source & mask) == wanted for mask, wanted in self._context)

    def _maximal(self, nodes: Sequence[int], source: int, targets: Sequence[int]) -> list[int]:
        """The targets that are not on the way to others: the whole change was learned."""
        changes = [Change.between(nodes[source], nodes[j]) for j in targets]
        return [
            j
            for j, change in zip(targets, changes, strict=True)
            if not any(_is_part(change, other) for other in changes)
        ]

    def matches(self, source: int, target: int) -> bool:
        """Whether a shortcut that may begin in the source may lead to the target, both masks."""
        add, delete = target & ~source, source & ~target  # masks first: most pairs end here
        return (
            not (add | delete) & self.left_alone
            and not add & ~self.may_be_added
            and bool(add) == self._adds_some
            and bool(delete & self._may_be_deleted) == self._deletes_some
            and self._fits(Change(add, delete), source)
        )

    def _fits(self, change: Change, source: int) -> bool:
        """Whether the signature matches a change, which mostly joins many pairs of nodes."""
        if change not in self._conditions:
            self._conditions[change] = self._signature.conditions(change, self._space)
        conditions = self._conditions[change]
        return conditions is not None and all(source & mask == held for mask, held in conditions)


def _fluents(predicate: str, space: AtomSpace) -> int:
    """The atoms of a predicate that operators change, a mask."""
    return space.mask(a for a in space.atoms if a.predicate.name == predicate) & ~space.static


def _is_part(change: Change, other: Change) -> bool:
    """Whether a change is a proper part of another."""
    part = not change.add & ~other.add and not change.delete & ~other.delete
    return part and change != other
