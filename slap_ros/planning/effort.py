# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How much planning may cost: counts, never seconds, so that plans do not depend on the machine."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.errors import InvalidParameterError


@dataclass(frozen=True)
class Effort:
    """How much a plan may cost, and how good it has to be.

    Args:
        rollouts: Options simulated, after which the best plan so far is taken; the first plan for
            a graph that is too large is made anyway.
        tests: How often it may be looked whether an operator is applicable, to make a graph that is
            searched as a whole: abstract states times ground operators.
        within: Factor of the bound at which a plan is good enough, at least 1.

    Raises:
        InvalidParameterError: No plan comes of so little, or none is so good.
    """

    rollouts: int = 400
    tests: int = 500_000
    within: float = 1.0

    def __post_init__(self) -> None:
        if min(self.rollouts, self.tests) < 1:
            raise InvalidParameterError(f"no plan comes of so little effort: {self}")
        if not self.within >= 1.0:
            raise InvalidParameterError(
                f"within must be 1 at least, got {self.within}: 1 asks for a plan that is proven "
                "to be the shortest, 1.25 for one that is at most a quarter longer"
            )

    @classmethod
    def times(cls, factor: int, within: float = 1.0) -> Effort:
        """The usual effort, so many times.

        Raises:
            InvalidParameterError: The factor is less than 1, or ``within`` is.
        """
        if factor < 1:
            raise InvalidParameterError(f"the effort of planning must be 1 at least, got {factor}")
        usual = cls()
        return cls(factor * usual.rollouts, factor * usual.tests, within)
