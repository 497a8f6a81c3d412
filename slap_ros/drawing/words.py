# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Short names for abstract states and options in drawings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from slap_ros.planning.options import Option, OptionKind
from slap_ros.relational import AtomSpace, GroundAtom, Object, Type

ADDED, REMOVED = "+ ", "\N{MINUS SIGN} "


class AtomNaming:
    """Names for the atoms and options of one task.

    An object that is the only one of its kind (the robot, mostly) is understood and left out.
    """

    def __init__(self, space: AtomSpace) -> None:
        self._space = space
        kinds = Counter(_kind(obj.type) for obj in space.layout.objects)
        self._understood = {obj for obj in space.layout.objects if kinds[_kind(obj.type)] == 1}

    def atoms(self, mask: int) -> list[str]:
        """The fluent atoms of a mask."""
        return [self._atom(atom) for atom in self._space.decode(mask & ~self._space.static)]

    def differences(self, start: int, node: int) -> list[str]:
        """What holds in a node and not in the start node, then the other way round."""
        added, removed = self.atoms(node & ~start), self.atoms(start & ~node)
        return [ADDED + atom for atom in added] + [REMOVED + atom for atom in removed]

    def sentence(self, mask: int) -> str:
        """All fluent atoms in one sentence, for a title."""
        return self._space.describe(mask) or "no fluent atom holds"

    def option(self, option: Option) -> list[str]:
        """An option's name, and its objects, in one line each."""
        lines = [option.skill.name]
        if objects := self._objects(option.objects):
            lines.append(objects)
        if option.kind is OptionKind.SHORTCUT:
            lines.append("learned shortcut")
        return lines

    def _atom(self, atom: GroundAtom) -> str:
        objects = self._objects(atom.objects)
        return f"{atom.predicate.name}({objects})" if objects else atom.predicate.name

    def _objects(self, objects: Sequence[Object]) -> str:
        return ", ".join(obj.name for obj in objects if obj not in self._understood)


def _kind(type_: Type) -> str:
    """The topmost type: what takes a ``surface`` may take a table, even the only table."""
    return type_.name if type_.parent is None else _kind(type_.parent)
