# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A prompt says all that its rules refer to."""

import re

import pytest

from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.questions import (
    about_decomposition,
    about_operator,
    about_reward,
)
from slap_ros.domains import get_domain

STOW = get_domain("stow_hammer")
PROBLEM = AcquisitionProblem.of_task(STOW, STOW.task(1))
ACTIONS = tuple(
    f"{op.name}({', '.join(f'{v.name}: {v.type}' for v in op.parameters)})"
    for op in STOW.acquisition.operators
)
REWARDED = {op.name: about_reward(op, PROBLEM).text for op in STOW.acquisition.operators}


def test_types_are_those_that_predicates_take_with_what_they_are_besides():
    """A hammer is a thing, so that metrics of things fit; no predicate takes the robot."""
    said = "Types: hammer (a thing, a place), cabinet (a drawer, a place)\n"
    assert said in about_decomposition(PROBLEM).text
    assert said in about_operator(ACTIONS[0], ACTIONS, PROBLEM).text
    assert said in REWARDED["Place"]


def test_an_operator_is_asked_for_with_what_holds_at_first_and_what_others_do():
    first, *others = STOW.acquisition.operators
    alone = about_operator(ACTIONS[0], ACTIONS, PROBLEM).text
    assert "At first this holds: HandEmpty(), HasFreeSpace()" in alone
    assert "Described so far" not in alone
    beside = about_operator(ACTIONS[0], ACTIONS, PROBLEM, others).text
    told = beside.partition("Described so far:")[2]
    assert all(f"\n{operator}\nPRE: " in told for operator in others)
    assert f"\n{first}\n" not in told


@pytest.mark.parametrize("operator", STOW.acquisition.operators, ids=str)
def test_a_reward_is_asked_for_with_each_predicate_of_its_operator(operator):
    text = REWARDED[operator.name]
    atoms = operator.preconditions | operator.add_effects | operator.delete_effects
    for predicate in {atom.predicate for atom in atoms}:
        assert f"- {predicate.signature}: " in text


def test_what_no_metric_measures_is_said():
    assert "No metric measures HandEmpty: success pays for that." in REWARDED["Place"]
    assert "No metric measures" not in REWARDED["Pick"]


def test_each_metric_is_shown_with_a_definition_of_its_name():
    """`closure` shares its function with `joint_dis`."""
    for text in REWARDED.values():
        named = re.findall(r"^- (\w+)\(", text.partition("Metrics, each")[2], re.MULTILINE)
        assert "closure" in named
        assert named == re.findall(r"^  def (\w+)\(", text, re.MULTILINE)
