# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What exploration finds: a change of atoms that rollouts made, and what it is expected to save."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from slap_ros.learning.stored_keys import restored, stored
from slap_ros.shortcuts.exploration_policies import RANDOM
from slap_ros.shortcuts.signature import Signature

OperatorPath = tuple[str, ...]  # operators by which a shortcut's source was reached


@dataclass(frozen=True)
class ShortcutCandidate:
    """A pair of abstract states, up to objects, that rollouts joined.

    Args:
        signature: Lifted change from the first abstract state to the second.
        operator_path: Names of the operators by which the source was reached.
        hits: Number of rollouts that reached the target.
        steps: Environment steps of the shortest of these rollouts, and of the options before it
            that the shortcut would replace.
        plan_steps: Environment steps of the plan without the shortcut.
        expected_saving: Environment steps by which the shortcut is expected to shorten the plan.
        beyond: Whether operators alone reach the second abstract state in no plan, so that it is
            no node of the abstract planning graph.
        found_by: Names of the exploration policies whose rollouts reached the target.
        replaced: Names of the skills that show it; none where something else found it.
    """

    signature: Signature
    operator_path: OperatorPath
    hits: int
    steps: int
    plan_steps: int
    expected_saving: float
    beyond: bool = False
    found_by: tuple[str, ...] = (RANDOM,)
    replaced: OperatorPath = ()

    def as_json(self) -> dict[str, Any]:
        """A JSON object, under the keys of :mod:`slap_ros.learning.stored_keys`.

        What random actions found within the graph says no more than in work folders from when
        there was nothing else.
        """
        data = stored(self)
        if not self.beyond:
            del data["beyond"]
        if self.found_by == (RANDOM,):
            del data["found_by"]
        if not self.replaced:
            del data["replaced"]
        return data

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> ShortcutCandidate:
        """The candidate of :meth:`as_json`.

        Raises:
            KeyError, TypeError, ValueError: The data is no candidate.
        """
        values = restored(cls, data)
        names = ("hits", "steps", "plan_steps", "expected_saving")
        numbers = {name: values[name] for name in names}
        if not all(isinstance(value, int | float) for value in numbers.values()):
            raise TypeError(f"{numbers} are not all numbers")
        operator_path = tuple(str(name) for name in values["operator_path"])
        found_by = tuple(str(name) for name in values.get("found_by", (RANDOM,)))
        replaced = tuple(str(name) for name in values.get("replaced", ()))
        signature, beyond = Signature.from_json(values["signature"]), bool(values.get("beyond"))
        return cls(
            signature, operator_path, **numbers, beyond=beyond, found_by=found_by, replaced=replaced
        )
