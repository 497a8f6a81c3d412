# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The relational layer: typed objects, states, predicates, atoms as bits, operators, PDDL."""

from slap_ros.relational.atom_space import AtomSpace
from slap_ros.relational.grounding import ground_operator, ground_operators
from slap_ros.relational.metrics import Condition, Metric, NormalisedForm
from slap_ros.relational.objects import Column, Feature, Object, Type
from slap_ros.relational.operators import (
    GroundOperator,
    LiftedAtom,
    LiftedOperator,
    Variable,
    static_predicates,
)
from slap_ros.relational.predicates import GroundAtom, Predicate
from slap_ros.relational.rewards import RewardTemplate, RewardTerm
from slap_ros.relational.state import Layout, State
from slap_ros.relational.target import Target, list_atoms

__all__ = [
    "AtomSpace",
    "Column",
    "Condition",
    "Feature",
    "GroundAtom",
    "GroundOperator",
    "Layout",
    "LiftedAtom",
    "LiftedOperator",
    "Metric",
    "NormalisedForm",
    "Object",
    "Predicate",
    "RewardTemplate",
    "RewardTerm",
    "State",
    "Target",
    "Type",
    "Variable",
    "ground_operator",
    "ground_operators",
    "list_atoms",
    "static_predicates",
]
