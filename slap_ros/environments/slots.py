# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Places for objects in observations of a fixed length.

Tasks of one preset may have more or fewer objects. There are as many slots for each kind as any
task of a census has; slots of objects that are not there are empty.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from slap_ros.errors import InvalidStateError
from slap_ros.relational import AtomSpace, Column, Object, Type
from slap_ros.shortcuts.signature import Kind, kinds


@dataclass(frozen=True)
class ObjectSlots:
    """As many slots for each kind of object as there can be objects.

    Args:
        counts: Number of slots of each kind.
        types: Type of the objects of each kind.
    """

    counts: Mapping[Kind, int]
    types: Mapping[Kind, Type]

    @classmethod
    def of(cls, spaces: Sequence[AtomSpace]) -> ObjectSlots:
        """The slots for every one of some tasks.

        Args:
            spaces: Atoms of each of the tasks.
        """
        counts: dict[Kind, int] = {}
        types: dict[Kind, Type] = {}
        for space in spaces:
            kind = kinds(space)
            types |= {kind[obj]: obj.type for obj in space.layout.objects}
            for name, count in Counter(kind.values()).items():
                counts[name] = max(count, counts.get(name, 0))
        return cls(dict(sorted(counts.items())), types)

    def columns(self, space: AtomSpace) -> Iterator[tuple[Kind, int, Column]]:
        """The slots of each kind, and a task's objects for them, in the order of their state.

        Args:
            space: Atoms of the task.

        Raises:
            InvalidStateError: There are more objects than slots.
        """
        found: dict[Kind, list[Object]] = {}
        for obj in space.layout.objects:
            found.setdefault(kinds(space)[obj], []).append(obj)
        for name, objects in found.items():
            if len(objects) > self.counts.get(name, 0):
                raise InvalidStateError(
                    f"the task has {len(objects)} objects of kind {name}, and observations have "
                    f"room for {self.counts.get(name, 0)}: make the environment with a preset "
                    "that has as many, or choose another task"
                )
        for name, count in self.counts.items():
            yield name, count, Column(tuple(found.get(name, ())))
