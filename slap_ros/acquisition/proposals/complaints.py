# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Complaints about proposals: a class for each, words for people and for the model."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class ComplaintClass(StrEnum):
    """The classes of what can be wrong, as logs and studies count them."""

    # any answer
    SYNTAX = "syntax"
    EMPTY_ANSWER = "empty_answer"
    REFUSAL = "refusal"
    TOO_LARGE = "too_large"
    # names, types, arguments: of decompositions, operators and rewards
    UNKNOWN_PREDICATE = "unknown_predicate"
    UNKNOWN_TYPE = "unknown_type"
    WRONG_NAME = "wrong_name"
    WRONG_ARITY = "wrong_arity"
    WRONG_TYPE = "wrong_type"
    OBJECT_NAME = "object_name"
    UNBOUND_VARIABLE = "unbound_variable"
    UNUSED_VARIABLE = "unused_variable"
    REPEATED_ARGUMENT = "repeated_argument"
    DUPLICATE = "duplicate"
    # one operator
    CONTRADICTORY_EFFECT = "contradictory_effect"
    NO_EFFECT = "no_effect"
    DELETED_NOT_REQUIRED = "deleted_not_required"  # a warning
    IMPOSSIBLE_CHANGE = "impossible_change"
    # all operators together
    PRECONDITION_NEVER_TRUE = "precondition_never_true"
    CIRCULAR_PRECONDITIONS = "circular_preconditions"
    GOAL_UNREACHABLE = "goal_unreachable"
    GOALS_NEVER_TOGETHER = "goals_never_together"
    # what came of them
    NOT_LEARNED = "not_learned"
    # a plan of the model's own
    IMPOSSIBLE_STEP = "impossible_step"
    GOAL_NOT_REACHED = "goal_not_reached"
    # rewards
    UNKNOWN_METRIC = "unknown_metric"
    WEIGHT_OUT_OF_RANGE = "weight_out_of_range"
    WEIGHT_NOT_FINITE = "weight_not_finite"
    WEIGHT_SUM = "weight_sum"  # a warning
    WRONG_OBJECT = "wrong_object"
    AMBIGUOUS_BINDING = "ambiguous_binding"
    IRRELEVANT_METRICS = "irrelevant_metrics"

    @property
    def remedy(self) -> str:
        """The instruction to the model for complaints of this class."""
        return _REMEDIES[self]


class RewardErrorGroup(StrEnum):
    """The paper's four classes of wrong rewards (LG-SAIL Figure 7), as groups of ours."""

    ATTRIBUTE_MISUSE = "attribute misuse"
    HALLUCINATION = "hallucination"
    SYNTAX = "syntax"
    METRIC_SELECTION = "metric selection"


REWARD_ERROR_GROUPS = {
    RewardErrorGroup.ATTRIBUTE_MISUSE: frozenset(
        {
            ComplaintClass.WRONG_ARITY,
            ComplaintClass.WRONG_OBJECT,
            ComplaintClass.OBJECT_NAME,
            ComplaintClass.UNBOUND_VARIABLE,
            ComplaintClass.REPEATED_ARGUMENT,
            ComplaintClass.AMBIGUOUS_BINDING,
        }
    ),
    RewardErrorGroup.HALLUCINATION: frozenset({ComplaintClass.UNKNOWN_METRIC}),
    RewardErrorGroup.SYNTAX: frozenset(
        {
            ComplaintClass.SYNTAX,
            ComplaintClass.EMPTY_ANSWER,
            ComplaintClass.REFUSAL,
            ComplaintClass.WEIGHT_OUT_OF_RANGE,
            ComplaintClass.WEIGHT_NOT_FINITE,
            ComplaintClass.WEIGHT_SUM,
            ComplaintClass.DUPLICATE,
        }
    ),
    RewardErrorGroup.METRIC_SELECTION: frozenset({ComplaintClass.IRRELEVANT_METRICS}),
}

_REMEDIES = {
    ComplaintClass.SYNTAX: "Answer in the form that was asked for, complete, and nothing else.",
    ComplaintClass.EMPTY_ANSWER: "Give an answer that is not empty.",
    ComplaintClass.REFUSAL: "Nothing but a description for a planner is asked for; please give it.",
    ComplaintClass.TOO_LARGE: "Use fewer variables or actions.",
    ComplaintClass.UNKNOWN_PREDICATE: "Use the listed predicates only.",
    ComplaintClass.UNKNOWN_TYPE: "Use the listed types only, and name variables after them.",
    ComplaintClass.WRONG_NAME: "Use the name that was asked for.",
    ComplaintClass.WRONG_ARITY: "Give exactly the arguments of the listed signature.",
    ComplaintClass.WRONG_TYPE: "Give variables of the types in the listed signature.",
    ComplaintClass.OBJECT_NAME: "Use variables, which begin with a question mark.",
    ComplaintClass.UNBOUND_VARIABLE: "List every variable that an atom uses among the parameters.",
    ComplaintClass.UNUSED_VARIABLE: "Leave out parameters that no atom is about.",
    ComplaintClass.REPEATED_ARGUMENT: "Different arguments are different objects.",
    ComplaintClass.DUPLICATE: "Give each only once.",
    ComplaintClass.CONTRADICTORY_EFFECT: "An effect is either in EFF- or in EFF+.",
    ComplaintClass.NO_EFFECT: "Say what holds afterwards that did not hold before.",
    ComplaintClass.DELETED_NOT_REQUIRED: "What is in EFF- belongs into PRE as well.",
    ComplaintClass.IMPOSSIBLE_CHANGE: "Use effects that this task's objects can show.",
    ComplaintClass.PRECONDITION_NEVER_TRUE: (
        "Require only what holds at first or is in the EFF+ of an action that can come before."
    ),
    ComplaintClass.CIRCULAR_PRECONDITIONS: (
        "Break the circle: one of these actions must be possible without the others."
    ),
    ComplaintClass.GOAL_UNREACHABLE: "The actions' effects must chain to the goal.",
    ComplaintClass.GOALS_NEVER_TOGETHER: (
        "What an action takes away and others need must be given back in the EFF+ of an action."
    ),
    ComplaintClass.NOT_LEARNED: "Change what may have kept it from being learned.",
    ComplaintClass.IMPOSSIBLE_STEP: "Before each step its PRE must hold.",
    ComplaintClass.GOAL_NOT_REACHED: "After the last step all of the goal must hold.",
    ComplaintClass.UNKNOWN_METRIC: "Use the listed metrics only.",
    ComplaintClass.WEIGHT_OUT_OF_RANGE: "Weights are from 0 to 1.",
    ComplaintClass.WEIGHT_NOT_FINITE: "Weights are numbers from 0 to 1.",
    ComplaintClass.WEIGHT_SUM: "The weights' sum should be below 1.",
    ComplaintClass.WRONG_OBJECT: "Give each metric variables of its types.",
    ComplaintClass.AMBIGUOUS_BINDING: "Write the metric's arguments.",
    ComplaintClass.IRRELEVANT_METRICS: "Use at least one metric that an atom of EFF+ rests on.",
}


@dataclass(frozen=True)
class Complaint:
    """A complaint: something that is wrong with a proposal.

    Args:
        kind: Class of the complaint.
        subject: Subject of the complaint, as ``operator Insert``.
        fact: Description of what is wrong.
        warning: Whether the proposal can be used in spite of the complaint.
        advice: Words for people alone: what they can change, and the model cannot.
    """

    kind: ComplaintClass
    subject: str
    fact: str
    warning: bool = False
    advice: str = ""

    @property
    def for_people(self) -> str:
        """One line for people, with the class."""
        told = f"{self.fact}{self.advice and '; '}{self.advice}"
        return f"{self.subject}: {told} [{self.kind}{', a warning' if self.warning else ''}]"

    @property
    def for_model(self) -> str:
        """A text for the model: what is wrong, and what to do."""
        return f"{self.fact[:1].upper()}{self.fact[1:]}. {self.kind.remedy}"

    def __str__(self) -> str:
        return self.for_people


def serious(complaints: Iterable[Complaint]) -> list[Complaint]:
    """The complaints that are no warnings."""
    return [complaint for complaint in complaints if not complaint.warning]
