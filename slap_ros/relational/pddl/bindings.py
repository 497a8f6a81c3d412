# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which objects an action's parameters can stand for, given atoms that can be reached.

The atoms that an action needs are joined like tables of a database, smallest extensions first, and
each atom that is reached later is joined with those before it (semi-naive evaluation of a logic
program: Helmert, "Concise finite-domain representations for PDDL planning tasks", AIJ 173, 2009).
So the work follows what can happen, not the product of all objects.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import prod

from slap_ros.errors import PlanningLimitError
from slap_ros.relational.pddl.conditions import Equality, Literal, conjuncts
from slap_ros.relational.pddl.task import Action

Objects = tuple[str, ...]  # by name, as everything here: names are found faster than objects
Binding = dict[str, str]  # names of variables and of objects
_Positions = tuple[int, ...]


class AtomIndex:
    """The atoms reached so far, found by predicate and by some of their objects."""

    def __init__(self) -> None:
        """Without any atoms."""
        self._atoms: dict[str, list[Objects]] = defaultdict(list)
        self._tables: dict[str, dict[_Positions, dict[Objects, list[Objects]]]] = defaultdict(dict)

    def add(self, predicate: str, objects: Objects) -> None:
        """Add an atom, which must be new."""
        self._atoms[predicate].append(objects)
        for positions, table in self._tables[predicate].items():
            table[tuple(objects[i] for i in positions)].append(objects)

    def count(self, predicate: str) -> int:
        """How many atoms of a predicate there are."""
        return len(self._atoms[predicate])

    def table(self, predicate: str, positions: _Positions) -> dict[Objects, list[Objects]]:
        """The atoms of a predicate by their objects at some positions; it grows with the index."""
        tables = self._tables[predicate]
        if positions not in tables:
            table = tables[positions] = defaultdict(list)
            for objects in self._atoms[predicate]:
                table[tuple(objects[i] for i in positions)].append(objects)
        return tables[positions]


class BindingLimit:
    """Counts bindings, partial ones included, up to a limit."""

    def __init__(self, limit: int) -> None:
        """Start at nothing.

        Args:
            limit: Number of bindings that may be looked at.
        """
        self._limit = self._left = limit

    def count(self, action: Action, bindings: int = 1) -> None:
        """Count some bindings.

        Raises:
            PlanningLimitError: There are more than may be.
        """
        self._left -= bindings
        if self._left < 0:
            raise PlanningLimitError(
                f"more than {self._limit} bindings of operators' parameters to objects, at "
                f"{action.name} with {len(action.parameters)} of them; give fewer parameters or "
                "objects"
            )


@dataclass(frozen=True)
class _Join:
    """One step of a join: atoms that agree with what is bound, and what they bind."""

    table: dict[Objects, list[Objects]]
    key: tuple[str, ...]
    binds: tuple[tuple[int, str], ...]  # the first place of each new variable
    same: tuple[tuple[int, int], ...]  # places of one atom that must have the same object

    def extend(self, binding: Binding) -> Iterator[Objects]:
        key = tuple([binding.get(term, term) for term in self.key])
        for objects in self.table.get(key, ()):
            if all(objects[i] == objects[j] for i, j in self.same):
                yield objects


@dataclass(frozen=True)
class _Choice:
    """One step of a join: a variable about which no atom says anything."""

    variable: str
    objects: Objects

    @property
    def binds(self) -> tuple[tuple[int, str], ...]:
        return ((0, self.variable),)

    def extend(self, _: Binding) -> Iterator[Objects]:
        return ((obj,) for obj in self.objects)


_Step = _Join | _Choice


class ActionBindings:
    """The bindings of one action."""

    def __init__(
        self,
        action: Action,
        fluents: frozenset[str],
        objects: dict[str, Objects],
        index: AtomIndex,
        limit: BindingLimit,
    ) -> None:
        """Prepare the joins of an action.

        Args:
            action: Action whose parameters are bound.
            fluents: Names of predicates whose atoms are reached one after the other; the index has
                all atoms of the others.
            objects: Objects of each parameter's type, by the parameter's name.
            index: Atoms reached so far.
            limit: Counts bindings.
        """
        self._action, self._index, self._limit = action, index, limit
        self._fluents = fluents
        self._objects = objects
        self._fitting = {variable: frozenset(found) for variable, found in objects.items()}
        parts = list(conjuncts(action.precondition))
        self._literals = [p for p in parts if isinstance(p, Literal) and p.positive]
        self._equalities = [p for p in parts if isinstance(p, Equality)]
        self._seen: set[Objects] = set()
        triggers = [n for n, atom in enumerate(self._literals) if atom.predicate.name in fluents]
        self._plans = {n: self._plan(n) for n in triggers}
        self.triggers = tuple((self._literals[n].predicate.name, n) for n in triggers)

    def without_trigger(self) -> Iterator[Objects]:
        """The bindings of an action that needs no fluent atom."""
        if not self.triggers:
            yield from self._complete({}, self._plan(None), 0)

    def triggered(self, number: int, objects: Objects) -> Iterator[Objects]:
        """The bindings that become possible by an atom, which is in the index already.

        Args:
            number: Position of the atom's literal, from :attr:`triggers`.
            objects: The atom's.
        """
        binding: Binding = {}
        for term, obj in zip(self._literals[number].terms, objects, strict=True):
            if not term.startswith("?"):
                if term != obj:
                    return
            elif binding.setdefault(term, obj) != obj or obj not in self._fitting[term]:
                return
        if self._possible(binding, binding):
            yield from self._complete(binding, self._plans[number], 0)

    def _complete(self, binding: Binding, steps: Sequence[_Step], depth: int) -> Iterator[Objects]:
        if depth == len(steps):
            found = tuple([binding[variable] for variable in self._objects])
            if found not in self._seen:
                self._seen.add(found)
                yield found
            return
        step = steps[depth]
        for objects in step.extend(binding):
            self._limit.count(self._action)
            new = {variable: objects[place] for place, variable in step.binds}
            binding.update(new)
            if self._possible(new, binding):
                yield from self._complete(binding, steps, depth + 1)
            for variable in new:
                del binding[variable]

    def _possible(self, new: Binding, binding: Binding) -> bool:
        """Whether new objects are of the parameters' types, and equalities hold as far as known."""
        if any(obj not in self._fitting[variable] for variable, obj in new.items()):
            return False
        for equality in self._equalities:
            left = binding.get(equality.left, equality.left)
            right = binding.get(equality.right, equality.right)
            known = not left.startswith("?") and not right.startswith("?")
            if known and (left == right) != equality.positive:
                return False
        return True

    def _plan(self, trigger: int | None) -> list[_Step]:
        """The steps that bind all parameters, cheapest first as far as that can be told."""
        bound: set[str] = set()
        remaining = dict(enumerate(self._literals))
        if trigger is not None:
            bound |= _variables(remaining.pop(trigger))
        steps: list[_Step] = []
        while remaining:
            number = min(remaining, key=lambda n: (self._size(remaining[n], bound), n))
            literal = remaining.pop(number)
            steps.append(self._join(literal, bound))
            bound |= _variables(literal)
        free = [variable for variable in self._objects if variable not in bound]
        return steps + [_Choice(variable, self._objects[variable]) for variable in free]

    def _size(self, literal: Literal, bound: set[str]) -> float:
        """About how many atoms agree with what is bound."""
        free = prod(len(self._objects[v]) for v in _variables(literal) - bound)
        if literal.predicate.name in self._fluents:
            return free
        everything = prod(len(self._objects[v]) for v in _variables(literal)) or 1
        return min(free, self._index.count(literal.predicate.name) * free / everything)

    def _join(self, literal: Literal, bound: set[str]) -> _Join:
        positions: list[int] = []
        key: list[str] = []
        first: dict[str, int] = {}
        same: list[tuple[int, int]] = []
        for place, term in enumerate(literal.terms):
            if not term.startswith("?") or term in bound:
                positions.append(place)
                key.append(term)
            elif term in first:
                same.append((first[term], place))
            else:
                first[term] = place
        table = self._index.table(literal.predicate.name, tuple(positions))
        binds = tuple((place, variable) for variable, place in first.items())
        return _Join(table, tuple(key), binds, tuple(same))


def _variables(literal: Literal) -> set[str]:
    return {term for term in literal.terms if term.startswith("?")}
