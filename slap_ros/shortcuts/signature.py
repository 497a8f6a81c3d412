# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a shortcut changes, and for which objects: substitution (SLAP §4.4, A.2, Alg. 3).

A change is the atoms that it adds and those that it deletes. Lifted, its objects become roles;
each role has a *kind*: the object's type with the static atoms that hold of it alone, so that a
table and a target area, both surfaces, are different kinds.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from typing import Any
from weakref import WeakKeyDictionary

from slap_ros.relational import AtomSpace, GroundAtom, Object, Predicate

Kind = str
Pattern = tuple[str, str, tuple[Kind, ...]]  # "+" or "-", predicate, kinds of its objects
# Weak, since a space refers to every state that was perceived with it.
_KINDS: WeakKeyDictionary[AtomSpace, Mapping[Object, Kind]] = WeakKeyDictionary()


@dataclass(frozen=True)
class Change:
    """A change from an abstract state to another: masks over a task's atoms."""

    add: int
    delete: int

    @classmethod
    def between(cls, source: int, target: int) -> Change:
        """The change from one abstract state to another."""
        return cls(target & ~source, source & ~target)

    def apply(self, abstract: int) -> int:
        """The abstract state after the change."""
        return (abstract & ~self.delete) | self.add

    def atoms(self, space: AtomSpace) -> Iterator[tuple[str, GroundAtom]]:
        """The atoms with their signs, in the space's order."""
        for atom in space.decode(self.add):
            yield "+", atom
        for atom in space.decode(self.delete):
            yield "-", atom


def context_of(
    abstract: int, predicates: Collection[Predicate], space: AtomSpace
) -> frozenset[str]:
    """The predicates of which an atom holds in an abstract state.

    Args:
        abstract: Abstract state, a mask.
        predicates: Predicates that are looked at.
        space: Atoms of the task.

    Returns:
        Names of predicates.
    """
    holding = (atom.predicate for atom in space.decode(abstract & ~space.static))
    return frozenset(predicate.name for predicate in holding if predicate in predicates)


def kinds(space: AtomSpace) -> Mapping[Object, Kind]:
    """The kind of each object of a task; cached as long as the space exists."""
    known = _KINDS.get(space)
    if known is None:
        known = _KINDS[space] = _kinds(space)
    return known


def _kinds(space: AtomSpace) -> Mapping[Object, Kind]:
    labels: dict[Object, list[str]] = {obj: [] for obj in space.layout.objects}
    for atom in space.decode(space.static_truth):
        if len(atom.objects) == 1:
            labels[atom.objects[0]].append(atom.predicate.name)
    return {obj: f"{obj.type}({','.join(sorted(names))})" for obj, names in labels.items()}


def instances(pattern: Pattern, space: AtomSpace) -> int:
    """The mask of a pattern's atoms in a task."""
    _, name, wanted = pattern
    kind = kinds(space)
    return space.mask(
        atom
        for atom in space.atoms
        if atom.predicate.name == name and tuple(kind[obj] for obj in atom.objects) == wanted
    )


def concerned(change: Change, space: AtomSpace) -> tuple[Object, ...]:
    """The objects of a change, from the ground up: in order of kind, then as they stand.

    Objects that were on something are ordered by how many others lie between them and one whose
    kind nothing else has: a tower from its bottom. So roles do not depend on names.
    """
    kind = kinds(space)
    objects = {obj for _, atom in change.atoms(space) for obj in atom.objects}
    depth = _depths(change, space, objects)
    order = {obj: i for i, obj in enumerate(space.layout.objects)}
    return tuple(sorted(objects, key=lambda obj: (kind[obj], depth[obj], order[obj])))


def _depths(change: Change, space: AtomSpace, objects: set[Object]) -> dict[Object, int]:
    kind = kinds(space)
    count = Counter(kind[obj] for obj in objects)
    bonds = [atom.objects for atom in space.decode(change.delete) if len(atom.objects) > 1]
    depth = {obj: 0 for obj in objects if count[kind[obj]] == 1}
    while True:
        reached = {
            other: min(depth[obj] for obj in bond if obj in depth) + 1
            for bond in bonds
            if any(obj in depth for obj in bond)
            for other in bond
            if other not in depth
        }
        if not reached:
            return {obj: depth.get(obj, len(objects)) for obj in objects}
        depth.update(reached)


@dataclass(frozen=True)
class Signature:
    """A lifted change, as a shortcut was trained on.

    Args:
        roles: Kind of each role.
        add: Atoms added: the predicate, and the roles that are its arguments.
        delete: Atoms deleted: the predicate, and the roles that are its arguments.
        context: Names of the predicates about what is held that hold where it was learned: a slap
            with a block in the hand is another one than with the hand empty.
        counted: Whether it matches changes of exactly as many atoms and objects. What two skills
            show is done with one object; with several it would be done again and again.
        regrasps: Whether something is taken or released on the way, though nothing about what is
            held changes.
    """

    roles: tuple[Kind, ...]
    add: frozenset[tuple[str, tuple[int, ...]]]
    delete: frozenset[tuple[str, tuple[int, ...]]]
    context: frozenset[str] = frozenset()
    counted: bool = False
    regrasps: bool = False

    @classmethod
    def between(
        cls, source: int, target: int, space: AtomSpace, grasping: Collection[Predicate]
    ) -> Signature:
        """Lift the change from an abstract state to another, with what is held in the first.

        Args:
            source: Abstract state in which a shortcut begins, a mask.
            target: Abstract state that it leads to, a mask.
            space: Atoms of the task.
            grasping: Predicates about what is held.

        Returns:
            The signature, in which objects are roles.
        """
        change = Change.between(source, target)
        return cls.of(change, space, context_of(source, grasping, space))

    @classmethod
    def of(
        cls, change: Change, space: AtomSpace, context: frozenset[str] = frozenset()
    ) -> Signature:
        """Lift a change.

        Args:
            change: Change from an abstract state of the task to another.
            space: Atoms of the task.
            context: Names of predicates about what is held; see the class.

        Returns:
            The signature, in which objects are roles.
        """
        objects, kind = concerned(change, space), kinds(space)
        number = {obj: i for i, obj in enumerate(objects)}

        def lifted(mask: int) -> frozenset[tuple[str, tuple[int, ...]]]:
            return frozenset(
                (atom.predicate.name, tuple(number[obj] for obj in atom.objects))
                for atom in space.decode(mask)
            )

        roles = tuple(kind[obj] for obj in objects)
        return cls(roles, lifted(change.add), lifted(change.delete), context)

    def as_json(self) -> dict[str, Any]:
        """A JSON object, which says that it is counted, or regrasps, only where it is so."""
        return {
            "roles": list(self.roles),
            "add": [[predicate, list(roles)] for predicate, roles in sorted(self.add)],
            "delete": [[predicate, list(roles)] for predicate, roles in sorted(self.delete)],
            "context": sorted(self.context),
            **({"counted": True} if self.counted else {}),
            **({"regrasps": True} if self.regrasps else {}),
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Signature:
        """The signature of :meth:`as_json`.

        Raises:
            KeyError, TypeError, ValueError: The data is no signature.
        """
        roles = tuple(str(kind) for kind in data["roles"])

        def atoms(lists: Sequence[Any]) -> frozenset[tuple[str, tuple[int, ...]]]:
            return frozenset((str(name), tuple(int(i) for i in about)) for name, about in lists)

        context = frozenset(str(name) for name in data["context"])
        marks = bool(data.get("counted", False)), bool(data.get("regrasps", False))
        signature = cls(roles, atoms(data["add"]), atoms(data["delete"]), context, *marks)
        used = {i for _, about in signature.add | signature.delete for i in about}
        if not used <= set(range(len(roles))):
            raise ValueError(f"an atom is about a role that is not among the {len(roles)}")
        if len(used) < len(roles):
            raise ValueError(f"of {len(roles)} roles, atoms are about {len(used)} only")
        if not signature.add | signature.delete:
            raise ValueError("it changes no atom")
        return signature

    @cached_property
    def patterns(self) -> frozenset[Pattern]:
        """The atoms changed, with kinds in place of objects, however many these are."""
        signed = [("+", *atom) for atom in self.add] + [("-", *atom) for atom in self.delete]
        return frozenset(
            (sign, predicate, tuple(self.roles[i] for i in arguments))
            for sign, predicate, arguments in signed
        )

    @cached_property
    def slots(self) -> Mapping[Kind, int]:
        """The number of roles of each kind, kinds in order."""
        return dict(sorted(Counter(self.roles).items()))

    @cached_property
    def name(self) -> str:
        """The predicates that are added, and a hash that tells different signatures apart."""
        parts = (self.roles, sorted(self.add), sorted(self.delete), sorted(self.context))
        marks = {"counted": self.counted, "regrasps": self.regrasps}
        text = repr((*parts, *(name for name, marked in marks.items() if marked)))
        words = "_".join(sorted({predicate for predicate, _ in self.add})) or "nothing"
        return f"{words}-{sha256(text.encode()).hexdigest()[:8]}"

    def matches(self, change: Change, source: int, space: AtomSpace) -> bool:
        """Whether a change has the patterns of the signature, with any number of objects.

        Of a counted signature, with as many objects and atoms as it has itself.

        What is already so need not change: a tower of one block has none on another, and of none
        the top becomes free. Objects of each kind must change, and one pattern at least must be
        added, and one deleted, of those that the signature has.

        As in Alg. 3 the change may delete more atoms, but about these objects only, and, unlike
        there, it adds no others: nothing that was not to be achieved in training. Beyond it, the
        number of objects is free: Alg. 3 asks for each atom of the training's change, so that
        what was learned on a tower of three is of no use for a tower of two. A shortcut is tried
        in the model anyway, before it is used.

        Args:
            change: Change from the source to another abstract state.
            source: Abstract state in which the shortcut would begin, a mask.
            space: Atoms of the task.
        """
        conditions = self.conditions(change, space)
        return conditions is not None and all(source & mask == held for mask, held in conditions)

    def conditions(self, change: Change, space: AtomSpace) -> Sequence[tuple[int, int]] | None:
        """Under which conditions on its source a change has the patterns of the signature.

        Args:
            change: Change from one abstract state to another.
            space: Atoms of the task.

        Returns:
            Masks, each with those of its atoms that must hold in the source while its others must
            not; None where the change does not have the patterns, whatever the source.
        """
        if self.counted and not self._counts_fit(change, space):
            return None
        kind = kinds(space)
        found: set[Pattern] = set()
        mine: set[Object] = set()
        others: set[Object] = set()
        for sign, atom in change.atoms(space):
            pattern = (sign, atom.predicate.name, tuple(kind[obj] for obj in atom.objects))
            if pattern in self.patterns:
                found.add(pattern)
                mine.update(atom.objects)
            elif sign == "+":
                return None
            else:
                others.update(atom.objects)
        if not (
            others <= mine
            and {kind[obj] for obj in mine} == set(self.roles)
            and _signs(found) == _signs(self.patterns)
        ):
            return None
        return [_already_so(pattern, mine, space) for pattern in self.patterns - found]

    def may_match_part(self, change: Change, space: AtomSpace) -> bool:
        """Whether the signature may match a part of a change, from some source.

        Args:
            change: Change that adds no atoms but those of patterns.
            space: Atoms of the task.
        """
        kind, found = kinds(space), set()
        mine: set[Kind] = set()
        for sign, atom in change.atoms(space):
            pattern = (sign, atom.predicate.name, tuple(kind[obj] for obj in atom.objects))
            if pattern in self.patterns:
                found.add(pattern)
                mine.update(pattern[2])
        return mine == set(self.roles) and _signs(found) == _signs(self.patterns)

    def _counts_fit(self, change: Change, space: AtomSpace) -> bool:
        """Whether a change adds and deletes as many atoms, about as many objects of each kind."""
        kind = kinds(space)
        objects = Counter(kind[obj] for obj in concerned(change, space))
        atoms = change.add.bit_count(), change.delete.bit_count()
        return atoms == (len(self.add), len(self.delete)) and objects == self.slots


def _signs(patterns: Collection[Pattern]) -> set[str]:
    return {sign for sign, _, _ in patterns}


def _already_so(pattern: Pattern, objects: Collection[Object], space: AtomSpace) -> tuple[int, int]:
    """The atoms of a pattern about these objects, and which hold: all of them if added, or none."""
    about = [
        atom
        for atom in space.decode(instances(pattern, space))
        if set(atom.objects) <= set(objects)
    ]
    mask = space.mask(about)
    return mask, mask if pattern[0] == "+" else 0
