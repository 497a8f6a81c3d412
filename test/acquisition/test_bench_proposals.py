# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Proposals for the domains at a bench: by hand, and from one demonstration in their world."""

from dataclasses import replace

import pytest

from slap_ros.acquisition.proposals.induction import InducedProposer, hold_steps_of
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.proposers import (
    ComposedRewarder,
    ManualProposer,
    ManualRewarder,
    propose,
)
from slap_ros.domains import get_domain
from slap_ros.skills.demonstrator import record_traces
from slap_ros.skills.scripted_skill import with_scripts

pytest.importorskip("pybullet")

# Operators in the paper's plans, by goal; of tasks that go by numbers, those of the first.
LENGTHS = {
    "stack_at_target": {"training": 4, "real": 4},
    "stow_hammer": {"training": 8, "test1": 8, "test2": 5},
    "peg_in_hole": {"training": 4, "test1": 4, "test2": 2},
    "make_coffee": {"training": 5},
    "groceries": {"task0": 2, "task9": 2},
    "bowls": {"task0": 2, "task9": 2},
}


def plans(domain, proposer, rewarder, shown=()):
    """Lengths of plans, by goal."""
    lengths = {}
    for goal in LENGTHS[domain.name]:
        problem = AcquisitionProblem.of_task(domain, domain.task(0, goal=goal))
        proposal = propose(replace(problem, shown=tuple(shown)), proposer, rewarder)
        assert set(proposal.rewards) == {operator.name for operator in proposal.operators}
        for template in proposal.rewards.values():
            assert 0.0 < sum(term.weight for term in template.terms) <= 1.0
        lengths[goal] = len(proposal.plan)
    return lengths


@pytest.mark.parametrize("name", LENGTHS)
def test_what_people_wrote_plans_as_the_paper_prints(name):
    domain = get_domain(name)
    by_hand = domain.acquisition
    rewarder = ManualRewarder(by_hand.rewards)
    assert plans(domain, ManualProposer(by_hand.operators), rewarder) == LENGTHS[name]


@pytest.mark.parametrize("name", LENGTHS)
def test_one_demonstration_is_enough_for_every_goal(name):
    domain = get_domain(name)
    training = next(iter(domain.goals))
    shown = record_traces(with_scripts(domain), 1, training)
    proposer = InducedProposer("one", hold_steps_of(domain.execution.control_period_s))
    assert plans(domain, proposer, ComposedRewarder(), shown) == LENGTHS[name]


def test_composed_rewards_do_not_pay_for_what_holds_anyway():
    """All things lie still from the start; lids and drawers have to be moved, away and back."""
    composed = {}
    for name in ("stack_at_target", "make_coffee"):
        domain = get_domain(name)
        problem = AcquisitionProblem.of_task(domain, domain.task(0))
        templates = ComposedRewarder().rewards(domain.acquisition.operators, problem)
        composed |= {
            (name, operator): {term.metric.name for term in template.terms}
            for operator, template in templates.items()
        }
    assert not any("at_rest" in metrics for metrics in composed.values())
    assert composed["stack_at_target", "Place"] == {"parallel_dis", "perpendicular_dis"}
    assert "closure" in composed["make_coffee", "Close"]  # closed at first, not where it begins
