# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a PDDL problem to the ground task that is planned with.

First the actions are found that could ever be applied if nothing were deleted (``bindings.py``).
Then their conditions are simplified by what can never change, quantifiers become conjunctions and
disjunctions over the objects, and what no way to the goal needs is left out. Only the rest gets
bits.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

from slap_ros.errors import MalformedPddlError, PlanningLimitError, UnsolvableError
from slap_ros.relational.objects import Type
from slap_ros.relational.operators import Variable
from slap_ros.relational.pddl.bindings import ActionBindings, AtomIndex, BindingLimit, Objects
from slap_ros.relational.pddl.conditions import (
    And,
    Condition,
    Equality,
    Literal,
    Or,
    Quantified,
    conjuncts,
)
from slap_ros.relational.pddl.effects import Effect, evaluate
from slap_ros.relational.pddl.ground_task import (
    Disjunction,
    GroundAction,
    GroundEffect,
    GroundTask,
    with_disjunctions,
)
from slap_ros.relational.pddl.task import Action, PddlDomain, PddlProblem

MAX_BINDINGS = 5_000_000  # of parameters, partial ones included; some ten seconds
MAX_ATOMS = 50_000  # that can be reached; masks of them then take much memory

_Binding = Mapping[str, str]  # names of variables and of objects
_Atom = tuple[str, Objects]  # name of a predicate, and objects
_Symbols = frozenset[int]  # a conjunction: see _Conditions


def ground_task(
    domain: PddlDomain, problem: PddlProblem, max_bindings: int = MAX_BINDINGS
) -> GroundTask:
    """The task that a problem states.

    Args:
        domain: Types, predicates and actions.
        problem: Objects, start and goal.
        max_bindings: Bindings of parameters, partial ones included, to look at before giving up.

    Raises:
        UnsolvableError: The goal cannot hold, whatever actions do.
        PlanningLimitError: There are more bindings, or more than ``MAX_ATOMS`` atoms.
        MalformedPddlError: An action has a negative cost.
    """
    reached = _Reachability(domain, problem, max_bindings)
    conditions = _Conditions(reached)
    goal = conditions.ground(problem.condition, {})
    if goal is None:
        raise _out_of_reach(problem.condition, conditions)
    without_cost: list[str] = []
    instances = [
        instance
        for found in reached.instances
        if (instance := _ground(found, conditions, problem, without_cost))
    ]
    task = _Assembly(conditions, goal, instances).task(reached.initial, reached.reached)
    return replace(task, without_cost=tuple(without_cost))


def _out_of_reach(goal: Condition, conditions: _Conditions) -> UnsolvableError:
    """The error for a goal that can never hold; names the parts that no operator achieves."""
    never = [
        str(part)
        for part in conjuncts(goal)
        if isinstance(part, Literal) and conditions.ground(part, {}) is None
    ]
    which = f": nothing that can be done achieves {', '.join(never)}" if never else ""
    return UnsolvableError(f"the goal is out of reach, even if operators deleted nothing{which}")


# -- what can be reached --------------------------------------------------------------------------


@dataclass(frozen=True)
class _EffectInstance:
    """An effect with objects for its variables."""

    condition: Condition
    binding: _Binding
    added: tuple[_Atom, ...]
    deleted: tuple[_Atom, ...]


@dataclass(frozen=True)
class _ActionInstance:
    """An action with objects for its parameters."""

    action: Action
    binding: _Binding
    effects: tuple[_EffectInstance, ...]


class _Reachability:
    """The atoms and actions that are possible if operators delete nothing."""

    def __init__(self, domain: PddlDomain, problem: PddlProblem, max_bindings: int) -> None:
        """Find them all.

        Args:
            domain: Types, predicates and actions.
            problem: Objects and start.
            max_bindings: Limit of bindings.

        Raises:
            PlanningLimitError: There are more bindings, or more than ``MAX_ATOMS`` atoms.
        """
        self._objects = problem.objects.objects
        self._of_type: dict[Type, Objects] = {}
        static = {predicate.name for predicate in domain.static_predicates}
        self.fluents = frozenset(p.name for p in domain.predicates) - static
        self.initial = {
            (atom.predicate.name, tuple([obj.name for obj in atom.objects]))
            for atom in problem.init
        }
        self.reached: dict[_Atom, int] = {}  # fluent atoms, with numbers in order of discovery
        self.deleted: set[_Atom] = set()
        found: list[tuple[int, int, _ActionInstance]] = []
        self._index, limit = AtomIndex(), BindingLimit(max_bindings)
        self._queue: deque[_Atom] = deque()
        # Sorted, as sets have another order in each process.
        for atom in sorted(self.initial):
            if atom[0] in self.fluents:
                self._reach(atom)
            else:
                self._index.add(*atom)
        every = [self._bindings(action, limit) for action in domain.actions]
        effects = [_grouped(action.effects) for action in domain.actions]
        for number, bindings in enumerate(every):
            for objects in bindings.without_trigger():
                self._instantiate(domain.actions[number], effects[number], objects, found, number)
        waiting: dict[str, list[tuple[int, int]]] = {}
        for number, bindings in enumerate(every):
            for predicate, literal in bindings.triggers:
                waiting.setdefault(predicate, []).append((number, literal))
        while self._queue:
            atom = self._queue.popleft()
            self._index.add(*atom)
            for number, literal in waiting.get(atom[0], ()):
                action = domain.actions[number]
                for objects in every[number].triggered(literal, atom[1]):
                    self._instantiate(action, effects[number], objects, found, number)
        found.sort(key=lambda entry: entry[:2])
        self.instances = [instance for *_, instance in found]

    def of_type(self, kind: Type) -> Objects:
        """The names of a type's objects, in the order of the problem."""
        if kind not in self._of_type:
            self._of_type[kind] = tuple(obj.name for obj in self._objects if obj.type.is_a(kind))
        return self._of_type[kind]

    def bindings_of(self, variables: Sequence[Variable], outer: _Binding) -> Iterator[_Binding]:
        """Every choice of objects for the variables of a quantifier."""
        if not variables:
            yield outer
            return
        for objects in product(*(self.of_type(variable.type) for variable in variables)):
            yield {**outer, **{v.name: obj for v, obj in zip(variables, objects, strict=True)}}

    def _bindings(self, action: Action, limit: BindingLimit) -> ActionBindings:
        objects = {variable.name: self.of_type(variable.type) for variable in action.parameters}
        return ActionBindings(action, self.fluents, objects, self._index, limit)

    def _reach(self, atom: _Atom) -> None:
        if atom not in self.reached:
            if len(self.reached) >= MAX_ATOMS:
                raise PlanningLimitError(
                    f"more than {MAX_ATOMS} atoms over {len(self._objects)} objects; give fewer "
                    "objects, or predicates with fewer arguments"
                )
            self.reached[atom] = len(self.reached)
            self._queue.append(atom)

    def _instantiate(
        self,
        action: Action,
        effects: Sequence[Effect],
        objects: Objects,
        found: list[tuple[int, int, _ActionInstance]],
        number: int,
    ) -> None:
        names = [variable.name for variable in action.parameters]
        binding: _Binding = dict(zip(names, objects, strict=True))
        if self._never(action.precondition, binding):
            return
        instances = []
        for effect in effects:
            for inner in self.bindings_of(effect.variables, binding):
                if self._never(effect.condition, inner):
                    continue
                added = tuple(_atom(x, inner) for x in effect.literals if x.positive)
                deleted = tuple(_atom(x, inner) for x in effect.literals if not x.positive)
                for atom in added:
                    self._reach(atom)
                self.deleted.update(deleted)
                instances.append(_EffectInstance(effect.condition, inner, added, deleted))
        order = len(found)
        found.append((number, order, _ActionInstance(action, binding, tuple(instances))))

    def _never(self, condition: Condition, binding: _Binding) -> bool:
        """Whether atoms that nothing changes, or equalities, rule a conjunction out."""
        for part in conjuncts(condition):
            match part:
                case Literal(predicate, _, positive) if predicate.name not in self.fluents:
                    if (_atom(part, binding) in self.initial) != positive:
                        return True
                case Equality() if not _equal(part, binding):
                    return True
        return False


def _grouped(effects: Sequence[Effect]) -> list[Effect]:
    """Effects of the same variables and condition as one."""
    groups: dict[tuple[tuple[Variable, ...], Condition], list[Literal]] = {}
    for effect in effects:
        groups.setdefault((effect.variables, effect.condition), []).extend(effect.literals)
    return [
        Effect(variables, condition, tuple(literals))
        for (variables, condition), literals in groups.items()
    ]


def _atom(literal: Literal, binding: _Binding) -> _Atom:
    return literal.predicate.name, tuple([binding.get(term, term) for term in literal.terms])


def _equal(equality: Equality, binding: _Binding) -> bool:
    left = binding.get(equality.left, equality.left)
    right = binding.get(equality.right, equality.right)
    return (left == right) == equality.positive


# -- conditions -----------------------------------------------------------------------------------


class _Conditions:
    """Ground conditions, as sets of symbols that must all be true.

    A symbol is twice the number of an atom, one more for its negation; a disjunction is negative.
    """

    def __init__(self, reached: _Reachability) -> None:
        """Without any conditions.

        Args:
            reached: Atoms that are possible.
        """
        self._reached = reached
        self._numbers: dict[tuple[_Symbols, ...], int] = {}
        self.disjunctions: list[tuple[_Symbols, ...]] = []  # inner ones first

    def ground(self, condition: Condition, binding: _Binding) -> _Symbols | None:
        """The symbols of a condition; None where it can never hold.

        Args:
            condition: Condition with variables.
            binding: Objects for its variables.
        """
        match condition:
            case Literal():
                return self._literal(condition, binding)
            case Equality():
                return frozenset() if _equal(condition, binding) else None
            case And(parts):
                return self._all(self.ground(part, binding) for part in parts)
            case Or(parts):
                return self._any(self.ground(part, binding) for part in parts)
            case Quantified(universal, variables, body):
                inner = self._reached.bindings_of(variables, binding)
                found = (self.ground(body, objects) for objects in inner)
                return self._all(found) if universal else self._any(found)

    def numbers(self, atoms: Iterable[_Atom]) -> tuple[int, ...]:
        """Numbers of those atoms that can be reached."""
        reached = self._reached.reached
        return tuple(reached[atom] for atom in atoms if atom in reached)

    def _literal(self, literal: Literal, binding: _Binding) -> _Symbols | None:
        atom = _atom(literal, binding)
        initially = atom in self._reached.initial
        number = self._reached.reached.get(atom)
        if number is None or (initially and atom not in self._reached.deleted):
            # Nothing changes it: it is static, never comes true, or never ceases to be.
            return frozenset() if initially == literal.positive else None
        return frozenset((2 * number + (not literal.positive),))

    def _all(self, parts: Iterable[_Symbols | None]) -> _Symbols | None:
        symbols: set[int] = set()
        for part in parts:
            if part is None:
                return None
            symbols |= part
        if any(symbol ^ 1 in symbols for symbol in symbols if symbol >= 0):
            return None
        return frozenset(symbols)

    def _any(self, parts: Iterable[_Symbols | None]) -> _Symbols | None:
        alternatives: dict[_Symbols, None] = {}
        for part in parts:
            if part is not None:
                if not part:
                    return part
                alternatives[part] = None
        if len(alternatives) < 2:
            return next(iter(alternatives), None)
        key = tuple(alternatives)
        if key not in self._numbers:
            self.disjunctions.append(key)
            self._numbers[key] = -len(self.disjunctions)
        return frozenset((self._numbers[key],))


# -- the task -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _GroundInstance:
    """An action whose conditions are symbols; effects are a condition, and atoms by number."""

    name: str
    precondition: _Symbols
    effects: tuple[tuple[_Symbols, tuple[int, ...], tuple[int, ...]], ...]
    cost: float


def _ground(
    found: _ActionInstance, conditions: _Conditions, problem: PddlProblem, without_cost: list[str]
) -> _GroundInstance | None:
    """The action with its conditions ground; None where it can never be applied.

    Args:
        found: Action that may be possible.
        conditions: What grounds conditions.
        problem: Gives the values of functions.
        without_cost: Gets the name of the action where its cost is not given.
    """
    precondition = conditions.ground(found.action.precondition, found.binding)
    if precondition is None:
        return None
    objects = [found.binding[variable.name] for variable in found.action.parameters]
    name = f"({' '.join((found.action.name, *objects))})"
    cost = _cost(found, problem)
    if cost is None:
        without_cost.append(name)
        return None
    effects = []
    for effect in found.effects:
        condition = conditions.ground(effect.condition, effect.binding)
        if condition is not None:
            added, deleted = map(conditions.numbers, (effect.added, effect.deleted))
            effects.append((condition, added, deleted))
    return _GroundInstance(name, precondition, tuple(effects), cost)


def _cost(found: _ActionInstance, problem: PddlProblem) -> float | None:
    """What an action costs; None where the problem does not state it."""
    if not problem.minimises_cost:
        return 1
    total: float = 0
    for term in found.action.costs:
        cost = evaluate(term, found.binding, problem.values)
        if cost is None:
            return None
        if cost < 0:
            raise MalformedPddlError(
                f"{found.action.position}: operator {found.action.name} has a cost of {cost}; "
                "costs must not be negative"
            )
        total += cost
    return total


class _Assembly:
    """Puts a task together of what leads to the goal."""

    def __init__(
        self, conditions: _Conditions, goal: _Symbols, instances: Sequence[_GroundInstance]
    ) -> None:
        """Find what is relevant, and give it bits.

        Args:
            conditions: Disjunctions, whose numbers are symbols.
            goal: What shall hold in the end.
            instances: All actions.
        """
        self._disjunctions = conditions.disjunctions
        self._goal = goal
        self._instances = instances
        self._relevant = self._find_relevant()
        atoms = sorted({symbol // 2 for symbol in self._relevant if symbol >= 0})
        self._bits: dict[int, int] = {}  # of symbols
        self._atom_bits: dict[int, int] = {}
        self._wanted = self._complemented = size = 0  # atoms that ought to hold, or not to
        for atom in atoms:
            self._bits[2 * atom] = self._atom_bits[atom] = 1 << size
            if 2 * atom in self._relevant:
                self._wanted |= 1 << size
            size += 1
            if 2 * atom + 1 in self._relevant:
                self._bits[2 * atom + 1] = 1 << size
                self._complemented |= 1 << (size - 1)
                size += 1
        for number in range(1, len(self._disjunctions) + 1):
            if -number in self._relevant:
                self._bits[-number] = 1 << size
                size += 1
        self._size = size

    def _find_relevant(self) -> set[int]:
        """The symbols on which reaching the goal may depend.

        What an effect depends on matters even where it only spoils things; what its action needs
        matters where it is of use.
        """
        changes: dict[int, list[tuple[int, int, bool]]] = {}  # of atoms: action, effect, added
        for i, instance in enumerate(self._instances):
            for j, (_, adds, deletes) in enumerate(instance.effects):
                for atom in adds:
                    changes.setdefault(atom, []).append((i, j, True))
                for atom in deletes:
                    changes.setdefault(atom, []).append((i, j, False))
        relevant, stack = set(self._goal), list(self._goal)

        def add(symbols: Iterable[int]) -> None:
            fresh = set(symbols) - relevant
            relevant.update(fresh)
            stack.extend(fresh)

        while stack:
            symbol = stack.pop()
            if symbol < 0:
                for alternative in self._disjunctions[-symbol - 1]:
                    add(alternative)
                continue
            for i, j, added in changes.get(symbol // 2, ()):
                add(self._instances[i].effects[j][0])
                if added == (symbol % 2 == 0):
                    add(self._instances[i].precondition)
        return relevant

    def task(self, initial: set[_Atom], numbers: Mapping[_Atom, int]) -> GroundTask:
        """The task.

        Args:
            initial: Atoms that hold at first.
            numbers: Numbers of the atoms that can be reached.
        """
        start = 0
        for atom in initial:
            start |= self._atom_bits.get(numbers.get(atom, -1), 0)
        start |= (self._complemented & ~start) << 1
        disjunctions = tuple(
            Disjunction(self._bits[-number], tuple(map(self._mask, alternatives)))
            for number, alternatives in enumerate(self._disjunctions, start=1)
            if -number in self._relevant
        )
        return GroundTask(
            self._size,
            with_disjunctions(start, disjunctions),
            self._mask(self._goal),
            tuple(self._actions()),
            self._complemented,
            disjunctions,
        )

    def _actions(self) -> Iterator[GroundAction]:
        for instance in self._instances:
            effects = tuple(self._effects(instance))
            # One that only spoils things is of no use, and what it needs has no bits.
            if any((e.added & self._wanted) | (e.deleted & self._complemented) for e in effects):
                precondition = self._mask(instance.precondition)
                yield GroundAction(instance.name, precondition, effects, instance.cost)

    def _effects(self, instance: _GroundInstance) -> Iterator[GroundEffect]:
        for condition, added, deleted in instance.effects:
            adds, deletes = self._atoms(added), self._atoms(deleted)
            if adds | deletes:
                yield GroundEffect(self._mask(condition), adds, deletes)

    def _mask(self, symbols: Iterable[int]) -> int:
        mask = 0
        for symbol in symbols:
            mask |= self._bits[symbol]
        return mask

    def _atoms(self, numbers: Iterable[int]) -> int:
        mask = 0
        for number in numbers:
            mask |= self._atom_bits.get(number, 0)
        return mask
