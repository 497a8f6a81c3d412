# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The generator of random numbers as an object of a state.

It has a seed, and counts the environment steps that have drawn from it. What a step draws is a
function of both. So a disturbed world is Markov: the same state and action give the same next
state, and a recorded run can be replayed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from slap_ros.errors import InvalidStateError
from slap_ros.relational import Feature, Layout, Object, State, Type

GENERATOR = Type("generator", (Feature("seed", "1"), Feature("step", "1")))
LARGEST = 2**53  # up to here, floats are exact integers


def with_generator(state: State, seed: int) -> State:
    """The state with a generator that has drawn nothing yet.

    Args:
        state: State without a generator.
        seed: Seed of the generator, at least 0 and below 2**53.
    """
    layout = Layout.of((*state.objects, Object("generator", GENERATOR)))
    return State(layout, np.append(state.data, (float(seed), 0.0)))


@dataclass(frozen=True)
class GeneratorIndex:
    """Where the features of a layout's generator are.

    Args:
        seed: Index of the seed in the state's array.
        step: Index of the number of steps in the state's array.
    """

    seed: int
    step: int

    @staticmethod
    @lru_cache(maxsize=256)
    def of(layout: Layout) -> GeneratorIndex:
        """The index of a layout.

        Raises:
            InvalidStateError: It has no generator, or several.
        """
        found = layout.of_type(GENERATOR)
        if len(found) != 1:
            raise InvalidStateError(
                f"a state of a disturbed world needs one object of type {GENERATOR}, and this has "
                f"{len(found)}: begin with a task of the domain, which has one"
            )
        return GeneratorIndex(*(layout.column(found[0], name) for name in ("seed", "step")))

    def require_valid(self, state: State) -> None:
        """Refuse what no generator can be.

        Raises:
            InvalidStateError: Seed or step is not a whole number from 0 on.
        """
        for name, at in (("seed", self.seed), ("step", self.step)):
            value = float(state.data[at])
            if not (value.is_integer() and 0.0 <= value < LARGEST):
                raise InvalidStateError(
                    f"the generator's {name} is {value}; it must be a whole number from 0 to 2**53"
                )

    def random(self, state: State) -> np.random.Generator:
        """The source of what the next step draws."""
        return np.random.default_rng([int(state.data[self.seed]), int(state.data[self.step])])
