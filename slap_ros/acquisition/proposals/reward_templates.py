# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Dense rewards as they are written, checked against an operator; and rewards without a model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import permutations, product

from slap_ros.acquisition.proposals.complaints import Complaint, ComplaintClass, serious
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.errors import InvalidDomainError
from slap_ros.language.formats import RewardDraft, TermDraft, shown
from slap_ros.relational import (
    Column,
    LiftedAtom,
    LiftedOperator,
    Metric,
    RewardTemplate,
    RewardTerm,
    Variable,
)

DENSE_SUM = 0.8  # sum of composed weights: success itself, which is paid 1, stays the best
FULL = 0.99  # value of a normalised metric from which on it cannot pay more
METRES = "m"

Bound = tuple[Metric, tuple[Variable, ...]]


def check_rewards(
    draft: RewardDraft, operator: LiftedOperator, problem: AcquisitionProblem
) -> tuple[RewardTemplate | None, list[Complaint]]:
    """Check the dense reward of one operator.

    Args:
        draft: Draft of the reward, as it is written.
        operator: Operator of the reward.
        problem: Problem whose metrics the reward may use.

    Returns:
        The template, None where something serious is wrong, and complaints.
    """
    checker = _RewardChecker(operator, problem)
    for term in draft.terms:
        checker.check(term)
    checker.check_all(draft)
    if serious(checker.complaints):
        return None, checker.complaints
    return RewardTemplate(operator.name, tuple(checker.terms)), checker.complaints


def compose_reward(operator: LiftedOperator, problem: AcquisitionProblem) -> RewardTemplate:
    """A dense reward without a model: the metrics behind what the operator adds, equally weighed.

    Metrics between objects come before those of the hand, and last the hand's way to each object
    that the operator changes and that was not in the hand before. A metric that pays all it can
    from the start, as whether something lies still, leads nowhere, and all else would be paid less.
    So it is left out, unless the operator begins where it is another.

    Args:
        operator: Operator of the reward.
        problem: Problem whose metrics the reward may use.

    Raises:
        InvalidDomainError: No atom that it adds rests on a metric that grows towards it.
    """
    added = sorted(operator.add_effects, key=str)
    behind = _leading(added, operator, problem)
    chosen = [b for b in behind if not b[0].of_hand] + [b for b in behind if b[0].of_hand]
    chosen += _ways(operator, problem)
    terms = list(dict.fromkeys(chosen))
    if not terms:
        raise InvalidDomainError(
            f"no reward can be composed for {operator.name}: none of {', '.join(map(str, added))} "
            "rests on a metric that grows towards it; give conditions to the domain's predicates"
        )
    weight = DENSE_SUM / len(terms)
    return RewardTemplate(operator.name, tuple(RewardTerm(m, a, weight) for m, a in terms))


def _leading(
    added: Sequence[LiftedAtom], operator: LiftedOperator, problem: AcquisitionProblem
) -> list[Bound]:
    """The metrics behind added atoms that have a way to go; all of them where none has.

    Args:
        added: Atoms that the operator adds.
        operator: Operator, whose required and deleted atoms may rest on the same metrics.
        problem: Problem with the state that tasks start from.
    """
    before = operator.preconditions | operator.delete_effects
    changed = {bound for atom in before for bound in _behind(atom)}
    behind, leading = [], []
    for atom in added:
        for condition in atom.predicate.conditions:
            if condition.rewarded:
                bound = condition.metric, tuple(atom.variables[i] for i in condition.arguments)
                behind.append(bound)
                if bound in changed or not _is_full(condition.metric, problem):
                    leading.append(bound)
    return leading or behind


def _is_full(metric: Metric, problem: AcquisitionProblem) -> bool:
    """Whether a metric pays all it can at the start, whatever objects it is of.

    Args:
        metric: Metric of a condition.
        problem: Problem with the state that tasks start from, if there is one.
    """
    if problem.start is None:
        return False
    kinds = (problem.layout.of_type(kind) for kind in metric.types)
    choices = [choice for choice in product(*kinds) if len(set(choice)) == len(choice)]
    if not choices:
        return False
    columns = [Column(objects) for objects in zip(*choices, strict=True)]
    return bool((metric.normalised(problem.start, *columns) >= FULL).all())


def _behind(atom: LiftedAtom, rewarded: bool = False) -> list[Bound]:
    """The metrics that an atom rests on, bound to its variables."""
    return [
        (condition.metric, tuple(atom.variables[i] for i in condition.arguments))
        for condition in atom.predicate.conditions
        if condition.rewarded or not rewarded
    ]


def _ways(operator: LiftedOperator, problem: AcquisitionProblem) -> list[Bound]:
    """The hand's distance to the first object of each added atom that is not held before."""
    held = {
        variable
        for atom in operator.preconditions
        for metric, arguments in _behind(atom, rewarded=True)
        if metric.of_hand
        for variable in arguments
    }
    moved = [atom.variables[0] for atom in sorted(operator.add_effects, key=str) if atom.variables]
    ways: list[Bound] = []
    for variable in dict.fromkeys(moved):
        distances = (
            metric
            for metric in problem.metrics
            if metric.of_hand
            and metric.unit == METRES
            and len(metric.types) == 1
            and variable.type.is_a(metric.types[0])
        )
        nearest = next(distances, None)
        if nearest is not None and variable not in held:
            ways.append((nearest, (variable,)))
    return ways


class _RewardChecker:
    """Collects terms and complaints about one operator's reward."""

    def __init__(self, operator: LiftedOperator, problem: AcquisitionProblem) -> None:
        self._operator = operator
        self._problem = problem
        self.terms: list[RewardTerm] = []
        self.complaints: list[Complaint] = []

    def _complain(self, kind: ComplaintClass, fact: str, warning: bool = False) -> None:
        subject = f"reward of {self._operator.name}"
        self.complaints.append(Complaint(kind, subject, fact, warning))

    def check(self, draft: TermDraft) -> None:
        """Check one term."""
        weighed = self._weight_is_sound(draft)
        metric = self._problem.metrics_by_name.get(draft.metric)
        if metric is None:
            known = ", ".join(self._problem.metrics_by_name)
            fact = f"there is no metric {shown(draft.metric)}; there are {known}"
            self._complain(ComplaintClass.UNKNOWN_METRIC, fact)
            return
        arguments = (
            self._bind(metric)
            if draft.arguments is None
            else self._arguments(metric, draft.arguments)
        )
        if arguments is None or not weighed:
            return
        if any((t.metric, t.arguments) == (metric, arguments) for t in self.terms):
            names = ", ".join(variable.name for variable in arguments)
            self._complain(ComplaintClass.DUPLICATE, f"{metric.name}({names}) occurs twice")
            return
        self.terms.append(RewardTerm(metric, arguments, draft.weight))

    def _weight_is_sound(self, draft: TermDraft) -> bool:
        if not math.isfinite(draft.weight):
            fact = f"the weight of {shown(draft.metric)} is {draft.weight}"
            self._complain(ComplaintClass.WEIGHT_NOT_FINITE, fact)
        elif not 0.0 <= draft.weight <= 1.0:
            fact = f"the weight of {shown(draft.metric)} is {draft.weight:g}"
            self._complain(ComplaintClass.WEIGHT_OUT_OF_RANGE, fact)
        else:
            return True
        return False

    def _bind(self, metric: Metric) -> tuple[Variable, ...] | None:
        """The only choice of parameters with the metric's types, where no arguments are written."""
        choices = [
            choice
            for choice in permutations(self._operator.parameters, len(metric.types))
            if all(v.type.is_a(t) for v, t in zip(choice, metric.types, strict=True))
        ]
        if len(choices) == 1:
            return choices[0]
        if choices:
            names = " or ".join(f"({', '.join(v.name for v in choice)})" for choice in choices[:4])
            fact = f"{metric.name} has no arguments; they may be {names}"
            self._complain(ComplaintClass.AMBIGUOUS_BINDING, fact)
        else:
            fact = f"no parameters of {self._operator} fit {metric.signature}"
            self._complain(ComplaintClass.WRONG_OBJECT, fact)
        return None

    def _arguments(self, metric: Metric, words: Sequence[str]) -> tuple[Variable, ...] | None:
        if len(words) != len(metric.types):
            fact = f"{metric.name} has {len(words)} arguments, but it is {metric.signature}"
            self._complain(ComplaintClass.WRONG_ARITY, fact)
            return None
        parameters = {variable.name: variable for variable in self._operator.parameters}
        for word in words:
            if not word.startswith("?"):
                fact = f"{shown(word)} in {metric.name} is no variable: those begin with '?'"
                self._complain(ComplaintClass.OBJECT_NAME, fact)
            elif word not in parameters:
                fact = f"{shown(word)} in {metric.name} is not among {', '.join(parameters)}"
                self._complain(ComplaintClass.UNBOUND_VARIABLE, fact)
        if any(word not in parameters for word in words):
            return None
        return self._typed(metric, tuple(parameters[word] for word in words))

    def _typed(self, metric: Metric, chosen: tuple[Variable, ...]) -> tuple[Variable, ...] | None:
        for variable, wanted in zip(chosen, metric.types, strict=True):
            if not variable.type.is_a(wanted):
                fact = f"{variable} is of the type {variable.type}, but it is {metric.signature}"
                self._complain(ComplaintClass.WRONG_OBJECT, fact)
                return None
        if len(set(chosen)) < len(chosen):
            fact = f"{metric.name} relates {chosen[0]} to itself"
            self._complain(ComplaintClass.REPEATED_ARGUMENT, fact)
            return None
        return chosen

    def check_all(self, draft: RewardDraft) -> None:
        """Check all terms together."""
        if not draft.terms:
            self._complain(ComplaintClass.EMPTY_ANSWER, "the reward has no terms")
        if serious(self.complaints):
            return
        total = sum(term.weight for term in self.terms)
        if total == 0.0:
            self._complain(ComplaintClass.WEIGHT_OUT_OF_RANGE, "all weights are 0")
            return
        if total >= 1.0:
            fact = f"the weights' sum is {total:g}: coming near is paid as much as succeeding"
            self._complain(ComplaintClass.WEIGHT_SUM, fact, warning=True)
        self._check_relevance()

    def _check_relevance(self) -> None:
        """Whether a metric leads to an effect: one behind it, or the hand's way to its objects."""
        behind = [bound for atom in self._operator.add_effects for bound in _behind(atom)]
        changed = {v for atom in self._operator.add_effects for v in atom.variables}
        weighed = [term for term in self.terms if term.weight > 0.0]
        for term in weighed:
            on_the_way = term.metric.of_hand and changed.issuperset(term.arguments)
            if (term.metric, term.arguments) in behind or on_the_way:
                return
        effects = ", ".join(sorted(map(str, self._operator.add_effects))) or "nothing"
        for term in weighed:
            if any(metric == term.metric for metric, _ in behind):
                names = ", ".join(variable.name for variable in term.arguments)
                fact = f"EFF+ ({effects}) rests on {term.metric.name}, but not of ({names})"
                self._complain(ComplaintClass.WRONG_OBJECT, fact)
                return
        fact = f"no metric of the reward is one that EFF+ ({effects}) rests on"
        self._complain(ComplaintClass.IRRELEVANT_METRICS, fact)
