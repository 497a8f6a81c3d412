# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Abstract states as bit masks over a task's ground atoms."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, permutations, product

import numpy as np
from numpy.typing import NDArray

from slap_ros.errors import MismatchedAtomError, PlanningLimitError, UnknownPredicateError
from slap_ros.relational.objects import Column, Object, Type
from slap_ros.relational.predicates import Classifier, GroundAtom, Margin, Predicate
from slap_ros.relational.state import Layout, State

MAX_ATOMS = 50_000  # of a task; masks of them then take 150 MB
MAX_TUPLES = 10_000_000  # of objects that are tried for the arguments of a predicate
MAX_CACHED_STATES = 1024


class AtomSpace:
    """The ground atoms of a task, each with a bit.

    An abstract state is an ``int`` with the bits of the atoms that hold. The space has every
    atom whose objects have the right types and, except in PDDL, are pairwise different. Atoms of
    static predicates (those that no operator changes) are evaluated once.
    """

    def __init__(
        self,
        predicates: Sequence[Predicate],
        static: Collection[Predicate],
        layout: Layout,
        holds: Callable[[GroundAtom], bool],
        rarely_read: Collection[Type] = (),
        readers: Collection[Predicate] = (),
        *,
        one_object_twice: bool = False,
    ) -> None:
        """Enumerate the atoms over the objects of ``layout``.

        Args:
            predicates: The domain's.
            static: Those that no operator changes.
            layout: The task's objects.
            holds: Whether an atom of a static predicate holds.
            rarely_read: Types of objects whose features few predicates read, the robot as a rule:
                for states that differ only there, all other predicates are evaluated once.
            readers: These few predicates.
            one_object_twice: Whether there are atoms that relate an object to itself, as in PDDL.

        Raises:
            PlanningLimitError: There are more than ``MAX_ATOMS``.
        """
        self.layout = layout
        self.predicates = {predicate.name: predicate for predicate in predicates}
        atoms = (
            predicate(*objects)
            for predicate in predicates
            for objects in _type_consistent(predicate, layout.objects, one_object_twice)
        )
        self.atoms = tuple(islice(atoms, MAX_ATOMS + 1))
        if len(self.atoms) > MAX_ATOMS:
            raise PlanningLimitError(
                f"more than {MAX_ATOMS} atoms over {len(layout.objects)} objects; give fewer "
                "objects, or predicates with fewer arguments"
            )
        self._bits = {atom: 1 << i for i, atom in enumerate(self.atoms)}
        self.static_predicates = frozenset(static)
        statics = {atom: bit for atom, bit in self._bits.items() if atom.predicate in static}
        self.static = sum(statics.values())
        self.static_truth = sum(bit for atom, bit in statics.items() if holds(atom))
        self._truth = np.array([bool(statics.get(a, 0) & self.static_truth) for a in self.atoms])
        self._fluents = self._blocks(predicates)
        self._cached_masks: dict[bytes, int] = {}
        self._key_columns = _columns_of(layout, rarely_read)
        self._reader_blocks = self._blocks(readers)
        self._reader_atoms = self.mask(atom for atom in self.atoms if atom.predicate in readers)

    def _blocks(self, predicates: Collection[Predicate]) -> list[_Block]:
        """The atoms of each fluent predicate that has any."""
        fluent = {atom.predicate for atom in self.atoms} - self.static_predicates
        return [_Block.of(predicate, self.atoms) for predicate in predicates if predicate in fluent]

    @classmethod
    def of_state(
        cls,
        predicates: Sequence[Predicate],
        static: Collection[Predicate],
        state: State,
        rarely_read: Collection[Type] = (),
        readers: Collection[Predicate] = (),
    ) -> AtomSpace:
        """The space over a state's objects, static atoms as they are in that state.

        Args:
            predicates: The domain's.
            static: Those that no operator changes.
            state: Gives the objects, and the truth of static atoms.
            rarely_read: See the constructor, as for ``readers``.
            readers: The predicates that read them.
        """
        return cls(
            predicates, static, state.layout, lambda atom: atom.holds(state), rarely_read, readers
        )

    def abstract(self, state: State) -> int:
        """The abstract state of a single state."""
        key = state.data.take(self._key_columns).tobytes()
        mask = self._cached_masks.get(key)
        if mask is None:
            mask = _mask(self.truth(state))
            if len(self._cached_masks) == MAX_CACHED_STATES:
                self._cached_masks.clear()
            self._cached_masks[key] = mask & ~self._reader_atoms
        elif self._reader_blocks:
            mask |= _mask(self._evaluate(self._reader_blocks, state, np.zeros_like(self._truth)))
        return mask

    def abstract_within(self, state: State, shifts: NDArray[np.float64]) -> int:
        """The abstract state of a single state under other thresholds.

        Args:
            state: The state.
            shifts: Increase of each atom's threshold, in the unit of its predicate's margin, shape
                (atoms,). It is ignored for predicates without a margin.
        """
        truth = self.truth(state)
        for block in self._fluents:
            if block.margin is not None:
                margins = block.margin(state, *block.columns)
                truth[block.where] = margins >= shifts[block.where]
        return _mask(truth)

    def abstract_each(self, states: State) -> list[int]:
        """The abstract states of a batch of states, shape (n, layout.size)."""
        return _masks(self.truth(states))

    def truth(self, state: State) -> NDArray[np.bool_]:
        """Whether each atom holds, for a state or a batch of states, shape (..., atoms)."""
        truth = np.empty((*state.data.shape[:-1], len(self.atoms)), dtype=bool)
        truth[...] = self._truth
        return self._evaluate(self._fluents, state, truth)

    @staticmethod
    def _evaluate(
        blocks: Sequence[_Block], state: State, truth: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Put in the truth of some of the atoms."""
        for block in blocks:
            truth[..., block.where] = block.classifier(state, *block.columns)
        return truth

    def bit(self, atom: GroundAtom) -> int:
        """The atom's bit.

        Raises:
            MismatchedAtomError: The atom relates an object to itself, or objects of another task.
        """
        try:
            return self._bits[atom]
        except KeyError:
            raise MismatchedAtomError(
                f"{atom} is not an atom of this task: atoms relate different objects of the task"
            ) from None

    def has(self, atom: GroundAtom) -> bool:
        """Whether it is an atom of this space."""
        return atom in self._bits

    def mask(self, atoms: Iterable[GroundAtom]) -> int:
        """The bits of several atoms."""
        mask = 0
        for atom in atoms:
            mask |= self.bit(atom)
        return mask

    def project(self, mask: int, space: AtomSpace) -> int:
        """A mask over another space of the same domain, with the atoms that it has as well.

        Args:
            mask: Over this space.
            space: Over more or fewer objects.
        """
        shared = (space._bits.get(atom, 0) for atom in self.decode(mask))
        return sum(shared)

    def decode(self, mask: int) -> Iterator[GroundAtom]:
        """The atoms of a mask, in the space's order."""
        while mask:
            low = mask & -mask
            yield self.atoms[low.bit_length() - 1]
            mask ^= low

    def atom(self, predicate: str, objects: Sequence[str]) -> GroundAtom:
        """The atom with these names.

        Raises:
            UnknownPredicateError: The domain has no such predicate.
            UnknownObjectError: The task has no such object.
            MismatchedAtomError: Number or types of the objects do not fit.
        """
        if predicate not in self.predicates:
            raise UnknownPredicateError(
                f"unknown predicate {predicate!r}; the domain has "
                f"{', '.join(sorted(self.predicates))}"
            )
        return self.predicates[predicate](*(self.layout.object(name) for name in objects))

    def describe(self, mask: int) -> str:
        """The fluent atoms of a mask, for people."""
        return ", ".join(str(atom) for atom in self.decode(mask & ~self.static))


@dataclass(frozen=True)
class _Block:
    """The atoms of one predicate."""

    classifier: Classifier
    margin: Margin | None
    columns: tuple[Column, ...]
    where: slice  # of the space's atoms

    @classmethod
    def of(cls, predicate: Predicate, atoms: Sequence[GroundAtom]) -> _Block:
        numbers = [i for i, atom in enumerate(atoms) if atom.predicate == predicate]
        start = numbers[0]
        columns = zip(*(atoms[i].objects for i in numbers), strict=True)
        return cls(
            predicate.classifier,
            predicate.margin,
            tuple(Column(objects) for objects in columns),
            slice(start, start + len(numbers)),
        )


def _mask(truth: NDArray[np.bool_]) -> int:
    """Bits of one state's atoms."""
    return int.from_bytes(np.packbits(truth, bitorder="little").tobytes(), "little")


def _masks(truth: NDArray[np.bool_]) -> list[int]:
    """Bits of the atoms of each state, a row each."""
    packed = np.packbits(truth, axis=1, bitorder="little")
    width, data = packed.shape[1], packed.tobytes()
    return [int.from_bytes(data[i * width : (i + 1) * width], "little") for i in range(len(packed))]


def _columns_of(layout: Layout, left_out: Collection[Type]) -> NDArray[np.intp]:
    """Indices of the features of all objects but those of some types."""
    parts = [
        np.arange(part.start, part.stop)
        for obj, part in layout.slices.items()
        if obj.type not in left_out
    ]
    return np.concatenate(parts or [np.empty(0, np.intp)])


def _type_consistent(
    predicate: Predicate, objects: tuple[Object, ...], one_object_twice: bool
) -> Iterator[tuple[Object, ...]]:
    if one_object_twice:
        fitting = ([obj for obj in objects if obj.type.is_a(kind)] for kind in predicate.types)
        yield from product(*fitting)
        return
    if math.perm(len(objects), len(predicate.types)) > MAX_TUPLES:
        raise PlanningLimitError(
            f"more than {MAX_TUPLES} tuples of {len(predicate.types)} from {len(objects)} objects "
            f"for {predicate.name}; give fewer objects, or predicates with fewer arguments"
        )
    for chosen in permutations(objects, len(predicate.types)):
        if all(obj.type.is_a(t) for obj, t in zip(chosen, predicate.types, strict=True)):
            yield chosen
