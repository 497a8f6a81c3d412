# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a shortcut would change in a given abstract state: its roles filled (SLAP Alg. 3)."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice

from slap_ros.relational import AtomSpace, Object, Predicate
from slap_ros.shortcuts.signature import Change, Kind, Signature, context_of, instances, kinds

Chosen = dict[int, Object]  # the objects that fill roles, by role
# In one abstract state. Roles that are alike can be filled in many ways, which come to the same.
MOST_SUBSTITUTIONS = 1_000


@dataclass(frozen=True)
class _RoleAtom:
    """An atom of a signature.

    Args:
        predicate: Name of the predicate.
        roles: Roles that are the arguments of the predicate.
        holds: Whether the atom holds before the change, which then deletes it, or else adds it.
    """

    predicate: str
    roles: tuple[int, ...]
    holds: bool


class SignatureGrounder:
    """Finds the changes that a signature makes in an abstract state.

    Every lifted atom has to be there, as Alg. 3 asks for: so many objects as in training. And all
    of it or nothing: of a higher tower than in training, the lower blocks alone do not fall.
    """

    def __init__(
        self, signature: Signature, space: AtomSpace, grasping: Collection[Predicate]
    ) -> None:
        """Order the roles: those of rare kinds first, since they tell which objects the others are.

        Args:
            signature: Signature to ground.
            space: Atoms of the task.
            grasping: Predicates about what is held; see :attr:`Signature.context`.
        """
        self._signature, self._space, self._grasping = signature, space, grasping
        self._of_kind = _by_kind(kinds(space))
        self._may_be_deleted = 0
        for pattern in signature.patterns:
            if pattern[0] == "-":
                self._may_be_deleted |= instances(pattern, space)
        self._bits = {(a.predicate.name, a.objects): space.mask([a]) for a in space.atoms}
        roles = range(len(signature.roles))
        self._order = sorted(roles, key=lambda role: len(self._objects(role)))
        lifted = [_RoleAtom(*atom, holds=False) for atom in sorted(signature.add)]
        lifted += [_RoleAtom(*atom, holds=True) for atom in sorted(signature.delete)]
        turn = {role: i for i, role in enumerate(self._order)}
        self._decided: list[list[_RoleAtom]] = [[] for _ in roles]  # by roles filled
        for atom in lifted:
            self._decided[max((turn[role] for role in atom.roles), default=0)].append(atom)

    def changes(self, abstract: int) -> Iterator[Change]:
        """The changes from an abstract state, a mask; each once."""
        if context_of(abstract, self._grasping, self._space) == self._signature.context:
            filled = self._fill(abstract, {}, Change(0, 0))
            found = dict.fromkeys(islice(filled, MOST_SUBSTITUTIONS))
            yield from (change for change in found if self._is_whole(abstract, change))

    def _is_whole(self, abstract: int, change: Change) -> bool:
        """Whether nothing is left to delete about the objects that the change deletes atoms of."""
        objects = {obj for atom in self._space.decode(change.delete) for obj in atom.objects}
        left = self._space.decode(change.apply(abstract) & self._may_be_deleted)
        return all(objects.isdisjoint(atom.objects) for atom in left)

    def _fill(self, abstract: int, chosen: Chosen, change: Change) -> Iterator[Change]:
        """Fill the next role with each object that agrees with the abstract state."""
        if len(chosen) == len(self._order):
            yield change
            return
        role = self._order[len(chosen)]
        for obj in self._objects(role):
            if obj not in chosen.values():
                longer = {**chosen, role: obj}
                more = self._with_decided(abstract, longer, change)
                if more is not None:
                    yield from self._fill(abstract, longer, more)

    def _with_decided(self, abstract: int, chosen: Chosen, change: Change) -> Change | None:
        """Add the atoms whose last role was just filled; None where one is not as it must be."""
        add, delete = change.add, change.delete
        for atom in self._decided[len(chosen) - 1]:
            bit = self._bits.get((atom.predicate, tuple(chosen[role] for role in atom.roles)), 0)
            if not bit or bool(abstract & bit) != atom.holds:
                return None
            add, delete = (add, delete | bit) if atom.holds else (add | bit, delete)
        return Change(add, delete)

    def _objects(self, role: int) -> list[Object]:
        return self._of_kind.get(self._signature.roles[role], [])


def _by_kind(kind: Mapping[Object, Kind]) -> dict[Kind, list[Object]]:
    objects: dict[Kind, list[Object]] = {}
    for obj, its in kind.items():
        objects.setdefault(its, []).append(obj)
    return objects
