# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Dense rewards as data: weighted metrics of an operator's parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from slap_ros.relational.metrics import Metric
from slap_ros.relational.objects import Column, Object
from slap_ros.relational.operators import Variable
from slap_ros.relational.state import State


@dataclass(frozen=True)
class RewardTerm:
    """A weighted metric of the operator's parameters."""

    metric: Metric
    arguments: tuple[Variable, ...]  # one per type of the metric
    weight: float  # in [0, 1]

    def value(self, state: State, objects: Mapping[Variable, Object]) -> float:
        """The normalised metric in a single state, not weighted.

        Args:
            state: A single state.
            objects: Object of each of the operator's parameters.
        """
        columns = [Column.of(objects[variable]) for variable in self.arguments]
        return float(self.metric.normalised(state, *columns)[0])

    def __str__(self) -> str:
        names = ", ".join(variable.name for variable in self.arguments)
        return f"{self.weight:g} {self.metric.name}({names})"


@dataclass(frozen=True)
class RewardTemplate:
    """The dense part of an operator's reward, for all its groundings: Σ weight · normalised metric.

    The sparse part is no template's: 1 where all of EFF+ hold and none of EFF- (LG-SAIL Eq. 4).
    """

    operator: str
    terms: tuple[RewardTerm, ...]

    def __str__(self) -> str:
        return f"{self.operator}: {' + '.join(map(str, self.terms))}"
