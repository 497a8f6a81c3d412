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
        improve: Options simulated per environment step of the robot, by which the rest of a plan is
            improved while it moves; 0: none.

    Raises:
        InvalidParameterError: No plan comes of so little, or none is so good.
    """

    rollouts: int = 400
    tests: int = 500_000
    within: float = 1.0
    improve: int = 4  # some 30 ms in a tower, and a step takes 125

    def __post_init__(self) -> None:
        if min(self.rollouts, self.tests) < 1:
            raise InvalidParameterError(f"no plan comes of so little effort: {self}")
        if not self.within >= 1.0:
            raise InvalidParameterError(
                f"within must be 1 at least, got {self.within}: 1 asks for a plan that is proven "
                "to be the shortest, 1.25 for one that is at most a quarter longer"
            )
        if self.improve < 0:
            raise InvalidParameterError(
                f"improve must be 0 at least, got {self.improve}: so many options are simulated "
                "per step of the robot to improve the rest of its plan"
            )

    @classmethod
    def times(cls, factor: int, within: float = 1.0, improve: int | None = None) -> Effort:
        """The usual effort, so many times.

        Args:
            factor: How many times.
            within: See the class.
            improve: See the class; None for the usual number, so many times.

        Raises:
            InvalidParameterError: The factor or ``within`` is less than 1, or ``improve`` than 0.
        """
        if factor < 1:
            raise InvalidParameterError(f"the effort of planning must be 1 at least, got {factor}")
        usual = cls()
        improve = factor * usual.improve if improve is None else improve
        return cls(factor * usual.rollouts, factor * usual.tests, within, improve)

    def abstract_states(self, operators: int) -> int:
        """Number of abstract states of a graph that is searched as a whole, at most.

        Args:
            operators: Number of ground operators.
        """
        return self.tests // max(1, operators)
