# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PDDL's types: a hierarchy in which a type may have several parents, and alternatives."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from slap_ros.errors import MalformedPddlError
from slap_ros.relational.objects import Type
from slap_ros.relational.pddl.names import OBJECT, Names, check_words
from slap_ros.relational.pddl.sexpr import MAX_DEPTH, Word
from slap_ros.relational.pddl.typed_list import TypedName


@dataclass(frozen=True)
class EitherType(Type):
    """``(either car truck)``: what is a car or a truck is of this type, and this type may be both.

    As the parent of a type it stands for several parents.
    """

    alternatives: tuple[Type, ...] = ()

    @classmethod
    def of(cls, alternatives: Iterable[Type]) -> Type:
        """The type of what is of any of these types; the type itself where there is only one."""
        found = tuple(dict.fromkeys(alternatives))
        if len(found) == 1:
            return found[0]
        return cls(f"(either {' '.join(kind.name for kind in found)})", alternatives=found)

    def is_a(self, other: Type) -> bool:
        """Whether it may be ``other``."""
        return self == other or any(kind.is_a(other) for kind in self.alternatives)

    def includes(self, other: Type) -> bool:
        """Whether ``other`` is one of the alternatives, or below one."""
        return any(other.is_a(kind) for kind in self.alternatives)

    def __hash__(self) -> int:
        return hash(self.name)


class TypeNames:
    """The types of a domain by name, ``object`` among them."""

    def __init__(self, types: Mapping[str, Type]) -> None:
        """Look up types; those of the domain by name."""
        self._names = Names("type", types, MalformedPddlError)
        self._has_object = OBJECT in types

    def of(self, entry: TypedName) -> Type:
        """The type of an entry of a typed list.

        Raises:
            MalformedPddlError: It names a type that is not declared.
        """
        return EitherType.of(map(self._find, entry.types))

    def _find(self, word: Word) -> Type:
        if word.keyword == OBJECT and not self._has_object:
            return Type(OBJECT)  # nothing else of the domain is of this type
        return self._names.find(word)


def make_types(declared: list[TypedName], with_object: bool) -> dict[str, Type]:
    """The types of a domain by name: ``object`` first where it is wanted, then the declared ones.

    A type that is declared again has the parents of all its declarations. A type that is only named
    as a parent counts as declared there.

    Args:
        declared: The list of types as it is written.
        with_object: Whether ``object`` is wanted.

    Raises:
        MalformedPddlError: Types descend from themselves, or from types that are not declared.
    """
    for entry in declared:
        if entry.word.keyword == OBJECT and not entry.is_untyped:
            raise MalformedPddlError(f"{entry.word.position}: type {OBJECT!r} cannot have a parent")
    entries = _with_parents(_merge([e for e in declared if e.word.keyword != OBJECT]))
    return _Hierarchy(entries, Type(OBJECT) if with_object else None).types()


def _merge(declared: list[TypedName]) -> dict[str, TypedName]:
    """One entry for each type, in the order of their first declarations."""
    merged: dict[str, TypedName] = {}
    for entry in declared:
        check_words("type", [entry.word])
        if (known := merged.get(entry.word.keyword)) is not None:
            if known.word.text != entry.word.text:
                check_words("type", [known.word, entry.word])
            parents = {word.keyword: word for word in (*known.types, *entry.types)}
            if len(parents) > 1:
                parents.pop(OBJECT, None)
            entry = TypedName(known.word, tuple(parents.values()))
        merged[entry.word.keyword] = entry
    return {entry.word.text: entry for entry in merged.values()}


def _with_parents(entries: dict[str, TypedName]) -> dict[str, TypedName]:
    """The entries, and one for each parent without an entry of its own."""
    declared = {OBJECT, *(name.lower() for name in entries)}
    implied = {
        word.text: TypedName(word, (Word(OBJECT, word.position),))
        for entry in entries.values()
        for word in entry.types
        if word.keyword not in declared
    }
    check_words("type", (entry.word for entry in implied.values()))
    return entries | implied


class _Hierarchy:
    """Types as they are built, parents first."""

    def __init__(self, entries: dict[str, TypedName], root: Type | None) -> None:
        self._entries = entries
        self._root = root
        self._names = Names("type", entries, MalformedPddlError)
        self._built: dict[str, Type] = {}

    def types(self) -> dict[str, Type]:
        """The types by name."""
        first = {OBJECT: self._root} if self._root else {}
        return first | {name: self._build(entry, ()) for name, entry in self._entries.items()}

    def _build(self, entry: TypedName, below: tuple[str, ...]) -> Type:
        name, position = entry.word.text, entry.word.position
        if name in below:
            raise MalformedPddlError(f"{position}: type {name} descends from itself")
        if len(below) > MAX_DEPTH:
            raise MalformedPddlError(f"{position}: more than {MAX_DEPTH} types below {name}")
        if name not in self._built:
            self._built[name] = Type(name, parent=self._parent(entry, (*below, name)))
        return self._built[name]

    def _parent(self, entry: TypedName, below: tuple[str, ...]) -> Type | None:
        words: list[Word] = [word for word in entry.types if word.keyword != OBJECT]
        if not words:
            return self._root
        return EitherType.of(self._build(self._names.find(word), below) for word in words)
