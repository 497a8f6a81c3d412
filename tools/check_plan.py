# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Checks a plan against the words of two PDDL files.

    python -m tools.check_plan domain.pddl problem.pddl plan.txt

It shares no code with the planner. The files are read as nested lists, states are sets of atoms,
and conditions are judged by recursion, straight from the text. A plan has a line for each operator,
as ``slap plan`` and competitions write it: ``(drive truck depot shop)``; maybe with its time and
duration: ``0: (drive truck depot shop) [1]``; or as ``slap plan`` wrote it before:
``drive(truck, depot, shop)``. Comments begin with a semicolon.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

Atom = tuple[str, ...]
Tree = Any  # a word, or a list of trees
_EARLIER = re.compile(r"([^\s(]+)\((.*)\)")
_COMPETITIONS = re.compile(r"(?:[\d.]+\s*:\s*)?\(\s*([^\s()]+)([^()]*)\)(?:\s*\[[\d.]+\])?")
_WORDS = re.compile(r"\(|\)|:[^\s()?:]*|-(?=[a-z])|\?[^\s()?]+|[^\s()?]+")


class InvalidPlanError(Exception):
    """A plan that does not do what it should; the message says why."""


def parse(text: str) -> list[Tree]:
    """The nested lists of a text, in lower case."""
    lines = [line.split(";")[0] for line in text.lstrip("\ufeff").lower().splitlines()]
    stack: list[list[Tree]] = [[]]
    for word in _WORDS.findall("\n".join(lines)):
        if word == "(":
            stack.append([])
        elif word == ")":
            closed = stack.pop()
            stack[-1].append(closed)
        else:
            stack[-1].append(word)
    return stack[0]


def typed(items: list[Tree]) -> Iterator[tuple[str, list[str]]]:
    """The names of a typed list, each with its types."""
    waiting: list[str] = []
    position = 0
    while position < len(items):
        if items[position] == "-":
            kind = items[position + 1]
            kinds = kind[1:] if isinstance(kind, list) else [kind]
            yield from ((name, kinds) for name in waiting)
            waiting, position = [], position + 2
        else:
            waiting.append(items[position])
            position += 1
    yield from ((name, ["object"]) for name in waiting)


@dataclass
class World:
    """A domain and a problem, as they are written."""

    parents: dict[str, set[str]] = field(default_factory=dict)
    objects: dict[str, set[str]] = field(default_factory=dict)  # with all their types
    actions: dict[str, dict[str, Tree]] = field(default_factory=dict)
    values: dict[Atom, float] = field(default_factory=dict)
    start: set[Atom] = field(default_factory=set)
    goal: Tree = None

    @classmethod
    def read(cls, *texts: str) -> World:
        """The world of the definitions in some texts."""
        world = cls()
        sections = [part for text in texts for tree in parse(text) for part in tree[2:]]
        for part in sections:
            if part[0] == ":types":
                for name, kinds in typed(part[1:]):
                    world.parents.setdefault(name, set()).update(kinds)
        for part in sections:
            world._take(part)
        return world

    def _take(self, part: list[Tree]) -> None:
        if part[0] in (":constants", ":objects"):
            for name, kinds in typed(part[1:]):
                for kind in kinds:
                    self.objects.setdefault(name, {"object"}).update(self._above(kind))
        elif part[0] == ":action":
            self.actions[part[1]] = dict(zip(part[2::2], part[3::2], strict=True))
        elif part[0] in (":init", ":timeless"):
            for item in part[1:]:
                if item[0] == "=" and isinstance(item[1], list):
                    self.values[tuple(item[1])] = float(item[2])
                elif item[0] != "not":
                    self.start.add(tuple(item))
        elif part[0] == ":goal":
            self.goal = part[1]

    def _above(self, kind: str, below: frozenset[str] = frozenset()) -> set[str]:
        found = {kind}
        for parent in self.parents.get(kind, set()) - below:
            found |= self._above(parent, below | {kind})
        return found

    def choices(self, variables: list[Tree]) -> Iterator[dict[str, str]]:
        """Every choice of objects for a typed list of variables."""
        entries = list(typed(variables))
        fitting = [[o for o, has in self.objects.items() if has & set(ks)] for _, ks in entries]
        for chosen in product(*fitting):
            yield {name: obj for (name, _), obj in zip(entries, chosen, strict=True)}

    def holds(self, tree: Tree, state: set[Atom], binding: dict[str, str]) -> bool:
        """Whether a condition holds in a state."""
        if not tree:
            return True
        head, *parts = tree
        if head == "and":
            return all(self.holds(part, state, binding) for part in parts)
        if head == "or":
            return any(self.holds(part, state, binding) for part in parts)
        if head == "not":
            return not self.holds(parts[0], state, binding)
        if head == "imply":
            return not self.holds(parts[0], state, binding) or self.holds(parts[1], state, binding)
        if head in ("forall", "exists"):
            found = (self.holds(parts[1], state, binding | more) for more in self.choices(parts[0]))
            return all(found) if head == "forall" else any(found)
        if head == "=":
            left, right = ground(parts, binding)
            return left == right
        return ground(tree, binding) in state

    def change(self, tree: Tree, state: set[Atom], binding: dict[str, str], change: Change) -> None:
        """Add to a change what an effect does in a state."""
        if not tree:
            return
        head, *parts = tree
        if head == "and":
            for part in parts:
                self.change(part, state, binding, change)
        elif head == "forall":
            for more in self.choices(parts[0]):
                self.change(parts[1], state, binding | more, change)
        elif head == "when":
            if self.holds(parts[0], state, binding):
                self.change(parts[1], state, binding, change)
        elif head == "increase":
            change.cost += self.number(parts[1], binding)
        elif head == "not":
            change.deleted.add(ground(parts[0], binding))
        else:
            change.added.add(ground(tree, binding))

    def number(self, tree: Tree, binding: dict[str, str]) -> float:
        """What an expression is worth."""
        if isinstance(tree, str):
            return float(tree)
        if tree[0] in ("+", "*"):
            left, right = (self.number(part, binding) for part in tree[1:])
            return left + right if tree[0] == "+" else left * right
        return self.values[ground(tree, binding)]


@dataclass
class Change:
    """What one operator adds, deletes and costs."""

    added: set[Atom] = field(default_factory=set)
    deleted: set[Atom] = field(default_factory=set)
    cost: float = 0.0


def ground(tree: Tree, binding: dict[str, str]) -> Atom:
    """An atom with objects for its variables."""
    return tuple(binding.get(word, word) for word in tree)


def check(world: World, steps: list[tuple[str, list[str]]]) -> float:
    """The cost of a plan.

    Args:
        world: Domain and problem.
        steps: Names of operators, each with its objects.

    Raises:
        InvalidPlanError: A step cannot be taken, or the goal does not hold in the end.
    """
    state, cost = set(world.start), 0.0
    for number, (name, objects) in enumerate(steps, start=1):
        action = world.actions.get(name)
        if action is None:
            raise InvalidPlanError(f"step {number}: there is no operator {name}")
        entries = list(typed([*action.get(":parameters", []), *action.get(":vars", [])]))
        if len(entries) != len(objects):
            raise InvalidPlanError(f"step {number}: {name} takes {len(entries)} objects")
        for (variable, kinds), obj in zip(entries, objects, strict=True):
            if not world.objects.get(obj, set()) & set(kinds):
                raise InvalidPlanError(f"step {number}: {obj} cannot be {variable} of {name}")
        binding = {variable: obj for (variable, _), obj in zip(entries, objects, strict=True)}
        if not world.holds(action.get(":precondition", []), state, binding):
            raise InvalidPlanError(f"step {number}: ({' '.join((name, *objects))}) is not possible")
        change = Change()
        world.change(action.get(":effect", []), state, binding, change)
        state = (state - change.deleted) | change.added
        cost += change.cost
    if not world.holds(world.goal, state, {}):
        raise InvalidPlanError(f"the goal does not hold after {len(steps)} steps")
    return cost


def read_steps(text: str) -> list[tuple[str, list[str]]]:
    """The steps of a plan: names of operators, each with its objects.

    Raises:
        InvalidPlanError: A line is no step.
    """
    steps = []
    for number, line in enumerate(text.lower().splitlines(), start=1):
        if not (step := line.split(";")[0].strip()):
            continue
        if found := _COMPETITIONS.fullmatch(step):
            steps.append((found[1], found[2].split()))
        elif found := _EARLIER.fullmatch(step):
            steps.append((found[1], found[2].replace(",", " ").split()))
        else:
            raise InvalidPlanError(f"line {number} is no step: {step}")
    return steps


def main() -> int:
    """Check the plan of the command line."""
    if len(sys.argv) != 4:
        sys.stderr.write("give domain.pddl problem.pddl plan.txt\n")
        return 2
    try:
        domain, problem, plan = (Path(word).read_text(encoding="utf-8") for word in sys.argv[1:])
    except (OSError, UnicodeDecodeError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    try:
        steps = read_steps(plan)
        cost = check(World.read(domain, problem), steps)
    except InvalidPlanError as error:
        sys.stdout.write(f"invalid: {error}\n")
        return 1
    sys.stdout.write(f"valid: {len(steps)} steps, cost {cost:.15g}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
