# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every class of complaint, by the smallest example; and who is asked again."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from slap_ros.acquisition.proposals.complaints import (
    REWARD_ERROR_GROUPS,
    Complaint,
    ComplaintClass,
    serious,
)
from slap_ros.acquisition.proposals.drafts import check_decomposition, check_operator
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.proposers import ComposedRewarder, ManualProposer, propose
from slap_ros.acquisition.proposals.questions import check_plan
from slap_ros.acquisition.proposals.reward_templates import check_rewards
from slap_ros.acquisition.proposals.verification import verify
from slap_ros.errors import ProposalRejectedError
from slap_ros.language.formats import parse_decomposition, parse_operator, parse_plan, parse_rewards
from slap_ros.relational import Layout, LiftedOperator
from slap_ros.relational.pddl import parse_domain, parse_problem
from support.model_answers import operator_data
from support.paper_problems import (
    ALL,
    METRICS,
    Printed,
    make_coffee,
    peg_in_hole,
    printed_insert,
    stow_hammer,
)

ROOT = Path(__file__).parents[2]
PEGS = peg_in_hole()
PICK, INSERT = PEGS.operators


def block(
    par: str, pre: str, minus: str, plus: str, problem: AcquisitionProblem
) -> list[Complaint]:
    text = f"PAR: {{{par}}}\nPRE: {{{pre}}}\nEFF-: {{{minus}}}\nEFF+: {{{plus}}}"
    return check_operator(parse_operator(text).draft, "Act", problem)[1]


def of_operator(par: str, pre: str, minus: str, plus: str) -> list[Complaint]:
    return block(par, pre, minus, plus, PEGS.problem)


def named(name: str) -> list[Complaint]:
    draft = parse_operator(json.dumps(operator_data(PICK))).draft
    return check_operator(draft, name, PEGS.problem)[1]


def of_decomposition(text: str) -> list[Complaint]:
    return check_decomposition(parse_decomposition(text).draft, PEGS.problem)[1]


def of_reward(text: str) -> list[Complaint]:
    return check_rewards(parse_rewards(text).draft, INSERT, PEGS.problem)[1]


def of_set(*operators: LiftedOperator) -> list[Complaint]:
    return list(verify(operators, PEGS.problem).complaints)


def of_plan(text: str) -> list[Complaint]:
    return check_plan(parse_plan(text).draft, PEGS.operators, PEGS.problem)[1]


def operator(pre: str, minus: str, plus: str, name: str = "Act") -> LiftedOperator:
    return PEGS.words.operator(name, "?peg ?hole", pre, minus, plus)


STATIC = replace(
    PEGS.problem, static=frozenset(p for p in PEGS.problem.predicates if p.name == "IsClear")
)
SHOWN = replace(
    PEGS.problem, shown=((PEGS.problem.init, PEGS.words.ground("Holding(peg1) OnTable(peg2)")),)
)
COFFEE = make_coffee()
NO_LID = replace(
    COFFEE.problem, layout=type(COFFEE.problem.layout).of(COFFEE.problem.layout.objects[:-1])
)

Example = Callable[[], list[Complaint]]
C = ComplaintClass
EXAMPLES: list[tuple[ComplaintClass, Example]] = [
    (C.SYNTAX, lambda: of_operator("?1peg", "", "", "HandEmpty()")),
    (C.SYNTAX, lambda: of_decomposition("[Not(?peg)]")),
    (C.EMPTY_ANSWER, lambda: of_decomposition("[]")),
    (C.EMPTY_ANSWER, lambda: of_reward('{"terms": []}')),
    (C.TOO_LARGE, lambda: of_operator(", ".join(f"?peg{i}" for i in range(15)), "", "", "")),
    (C.UNKNOWN_PREDICATE, lambda: of_operator("?peg", "", "", "Gripped(?peg)")),
    (C.UNKNOWN_TYPE, lambda: of_operator("?rod", "", "", "Holding(?rod)")),
    (C.UNKNOWN_TYPE, lambda: of_operator("?peg: rod", "", "", "Holding(?peg)")),
    (C.WRONG_NAME, lambda: named("Grasp")),
    (C.WRONG_ARITY, lambda: of_operator("?peg", "", "", "In(?peg)")),
    (C.WRONG_TYPE, lambda: of_operator("?hole", "", "", "Holding(?hole)")),
    (C.OBJECT_NAME, lambda: of_operator("?peg", "OnTable(?peg)", "", "Holding(peg1)")),
    (C.OBJECT_NAME, lambda: of_decomposition("[Pick(peg1)]")),
    (C.UNBOUND_VARIABLE, lambda: of_operator("?peg", "OnTable(?peg)", "", "Holding(?other)")),
    (C.UNUSED_VARIABLE, lambda: of_operator("?peg, ?hole", "", "", "Holding(?peg)")),
    (C.REPEATED_ARGUMENT, lambda: of_reward("R = 0.1 * parallel_dis(?peg, ?peg)")),
    (C.DUPLICATE, lambda: of_operator("?peg", "", "", "Holding(?peg), Holding(?peg)")),
    (C.DUPLICATE, lambda: of_operator("?peg, ?peg", "", "", "Holding(?peg)")),
    (C.DUPLICATE, lambda: of_decomposition("[Pick(?peg), Pick(?peg)]")),
    (C.DUPLICATE, lambda: of_set(PICK, replace(PICK, name="Grasp"))),
    (C.DUPLICATE, lambda: of_set(PICK, PICK)),
    (C.CONTRADICTORY_EFFECT, lambda: of_operator("?peg", "", "Holding(?peg)", "Holding(?peg)")),
    (C.NO_EFFECT, lambda: of_operator("?peg", "Holding(?peg)", "", "")),
    (C.NO_EFFECT, lambda: of_operator("?peg", "Holding(?peg)", "", "Holding(?peg)")),
    (C.NO_EFFECT, lambda: of_operator("?peg", "OnTable(?peg)", "OnTable(?peg)", "")),
    (C.DELETED_NOT_REQUIRED, lambda: of_operator("?peg", "", "OnTable(?peg)", "Holding(?peg)")),
    (C.IMPOSSIBLE_CHANGE, lambda: block("?hole", "", "", "IsClear(?hole)", STATIC)),
    (C.IMPOSSIBLE_CHANGE, lambda: block("?lid", "", "", "IsLidOpen(?lid)", NO_LID)),
    (C.IMPOSSIBLE_CHANGE, lambda: block("?peg, ?hole", "", "", "In(?peg, ?hole)", SHOWN)),
    (C.PRECONDITION_NEVER_TRUE,
     lambda: of_set(PICK, operator("Holding(?peg) OnTable(?peg)", "", "IsClear(?hole)"))),
    (C.CIRCULAR_PRECONDITIONS,
     lambda: of_set(operator("In(?peg, ?hole)", "", "In(?peg, ?hole) HandEmpty()"))),
    (C.GOAL_UNREACHABLE, lambda: of_set(PICK)),
    (C.GOALS_NEVER_TOGETHER, lambda: of_set(PICK, printed_insert())),
    (C.IMPOSSIBLE_STEP, lambda: of_plan("[Insert(peg1, hole1)]")),
    (C.IMPOSSIBLE_STEP, lambda: of_plan("[Fly(peg1)]")),
    (C.GOAL_NOT_REACHED, lambda: of_plan("[Pick(peg1), Insert(peg1, hole1)]")),
    (C.UNKNOWN_METRIC, lambda: of_reward('{"depth": 0.2}')),
    (C.WEIGHT_OUT_OF_RANGE, lambda: of_reward("R = 2 * parallel_dis(?peg, ?hole)")),
    (C.WEIGHT_NOT_FINITE, lambda: of_reward("R = nan * parallel_dis(?peg, ?hole)")),
    (C.WEIGHT_SUM, lambda: of_reward("R = 1 * parallel_dis(?peg, ?hole)")),
    (C.WRONG_OBJECT, lambda: of_reward('{"parallel_dis(?hole, ?peg)": 0.2}')),
    (C.AMBIGUOUS_BINDING, lambda: of_reward('{"parallel_dis": 0.2}')),
    (C.IRRELEVANT_METRICS, lambda: of_reward("R = 0.1 * joint_dis(?peg)")),
]  # fmt: skip
# No draft comes of them: test/language/test_scripts.py, test_revisions.py.
BY_THE_LOOP = {C.REFUSAL, C.NOT_LEARNED}


@pytest.mark.parametrize(("kind", "example"), EXAMPLES, ids=[kind.value for kind, _ in EXAMPLES])
def test_the_smallest_example_gets_its_class(kind: ComplaintClass, example: Example) -> None:
    complaints = example()
    found = [c for c in complaints if c.kind is kind]
    assert found, complaints
    for complaint in found:
        assert complaint.warning == (kind in (C.DELETED_NOT_REQUIRED, C.WEIGHT_SUM))
        assert kind.value in complaint.for_people and complaint.subject in complaint.for_people
        assert complaint.for_model.endswith(kind.remedy)


def test_every_class_has_an_example() -> None:
    assert {kind for kind, _ in EXAMPLES} | BY_THE_LOOP == set(ComplaintClass)


def test_the_page_lists_every_class() -> None:
    page = (ROOT / "docs" / "language.md").read_text(encoding="utf-8")
    assert not [kind for kind in ComplaintClass if f"`{kind.value}`" not in page]


def test_the_papers_groups_are_disjoint() -> None:
    grouped = [kind for group in REWARD_ERROR_GROUPS.values() for kind in group]
    assert len(grouped) == len(set(grouped))
    of_rewards = {kind for kind, example in EXAMPLES if "reward" in str(example()[0].subject)}
    assert of_rewards <= set(grouped)


# -- verification ----------------------------------------------------------------------------------


@pytest.mark.parametrize("printed", [make() for make in ALL], ids=[make.__name__ for make in ALL])
def test_the_papers_plans_are_found(printed: Printed) -> None:
    for name, (_, length) in printed.goals.items():
        problem = printed.with_goal(name)
        verification = verify(printed.operators, problem)
        assert verification.plan is not None and not verification.complaints
        assert len(verification.plan) == length
        state = problem.start_mask
        for step in verification.plan:
            assert step.applicable(state)
            state = step.apply(state)
        assert state & problem.goal_mask == problem.goal_mask


def test_the_printed_operators_of_peg_in_hole_do_not_chain() -> None:
    """Each goal atom can be reached, and no operator is unreachable: the paper feeds back none."""
    verification = verify([PICK, printed_insert()], PEGS.problem)
    assert verification.plan is None
    (complaint,) = verification.complaints
    assert complaint.kind is C.GOALS_NEVER_TOGETHER
    assert complaint.fact == (
        "In(peg1, hole1), In(peg2, hole2) can be reached each, but never together; at most "
        "In(peg2, hole2); HandEmpty is deleted by Pick and never added again; if it were, there "
        "would be a plan"
    )
    assert verification.culprits == ("Insert",)
    single = PEGS.with_goal("test2")  # one peg can be inserted without giving HandEmpty back
    assert len(verify([PICK, printed_insert()], single).plan or ()) == 2


def test_both_operators_of_a_circle_are_blamed() -> None:
    needs_in = operator("In(?peg, ?hole)", "", "Holding(?peg)", name="Pick")
    verification = verify([needs_in, INSERT], PEGS.problem)
    assert verification.culprits == ("Pick", "Insert")
    assert {c.kind for c in verification.complaints} == {
        C.CIRCULAR_PRECONDITIONS,
        C.GOAL_UNREACHABLE,
    }


def test_an_operator_that_is_never_possible_is_a_warning_beside_a_plan() -> None:
    idle = operator("In(?peg, ?hole) Holding(?peg)", "In(?peg, ?hole)", "IsClear(?hole)", "Pull")
    verification = verify([PICK, INSERT, idle], PEGS.problem)
    assert verification.plan is not None
    (complaint,) = verification.complaints
    assert complaint.warning and complaint.kind is C.PRECONDITION_NEVER_TRUE
    assert "never true together" in complaint.fact
    assert not serious(verification.complaints)


def test_nothing_that_adds_the_goal_blames_everyone() -> None:
    forgetful = operator("Holding(?peg) IsClear(?hole)", "Holding(?peg)", "HandEmpty()", "Insert")
    verification = verify([PICK, forgetful], PEGS.problem)
    assert verification.culprits == ("Pick", "Insert")
    assert "no action adds In" in verification.complaints[0].fact


@pytest.mark.slow
def test_operators_that_would_keep_the_planner_busy_are_too_large() -> None:
    """Thousands of groundings, each possible in nearly every state of astronomically many."""
    peg, hole = (PEGS.problem.types_by_name[name] for name in ("peg", "hole"))
    objects = [peg(f"p{i}") for i in range(15)] + [hole(f"h{i}") for i in range(15)]
    goal = frozenset({PEGS.problem.predicates_by_name["Holding"](objects[0])})
    problem = replace(PEGS.problem, layout=Layout.of(tuple(objects)), init=frozenset(), goal=goal)
    fill = PEGS.words.operator(
        "Fill", "?peg1 ?peg2 ?hole", "", "IsClear(?hole)", "In(?peg1, ?hole) OnTable(?peg2)"
    )
    clear = PEGS.words.operator(
        "Clear", "?hole ?peg", "In(?peg, ?hole)", "In(?peg, ?hole)", "IsClear(?hole)"
    )
    take = PEGS.words.operator(
        "Take", "?peg ?hole", "In(?peg, ?hole) IsClear(?hole)", "", "Holding(?peg)"
    )
    (complaint,) = verify([fill, clear, take], problem).complaints
    assert complaint.kind is C.TOO_LARGE


# -- proposers that ask nobody ---------------------------------------------------------------------


def test_manual_operators_are_checked_too() -> None:
    proposal = propose(PEGS.problem, ManualProposer(PEGS.operators), ComposedRewarder())
    assert proposal.plan is not None and len(proposal.plan) == 4
    assert proposal.provenance.proposer == "manual" and proposal.provenance.rewarder == "composed"
    with pytest.raises(ProposalRejectedError, match="HandEmpty is deleted by Pick"):
        propose(PEGS.problem, ManualProposer([PICK, printed_insert()]))


def test_composed_rewards_pass_the_checks() -> None:
    for make in ALL:
        printed = make()
        for operator in printed.operators:
            template = ComposedRewarder().rewards([operator], printed.problem)[operator.name]
            terms = [
                {
                    "metric": term.metric.name,
                    "arguments": [v.name for v in term.arguments],
                    "weight": term.weight,
                }
                for term in template.terms
            ]
            draft = parse_rewards(json.dumps({"terms": terms})).draft
            checked, complaints = check_rewards(draft, operator, printed.problem)
            assert not complaints and checked == template
            assert sum(term.weight for term in template.terms) == pytest.approx(0.8)


def test_composed_rewards_put_objects_before_the_hand() -> None:
    stow = stow_hammer()
    rewards = ComposedRewarder().rewards(stow.operators, stow.problem)
    names = {name: [t.metric.name for t in template.terms] for name, template in rewards.items()}
    assert names["Open"] == ["joint_dis", "dis_to_obj"]
    assert names["Pick"] == ["is_grasped", "dis_to_obj"]
    assert names["Place"] == ["parallel_dis", "perpendicular_dis", "norm_angle"]  # held already
    assert names["Close"] == ["closure", "dis_to_obj"]
    assert METRICS[0].name == "is_grasped"


def test_a_proposal_is_pddl_that_can_be_read_again() -> None:
    proposal = propose(PEGS.problem, ManualProposer(PEGS.operators))
    domain_text, problem_text = proposal.to_pddl(PEGS.problem)
    domain = parse_domain(domain_text)
    problem = parse_problem(problem_text, domain)
    again = AcquisitionProblem.of_pddl(domain, problem)
    assert again.static == frozenset()
    assert len(verify(domain.operators, again).plan or ()) == 4
    assert json.loads(proposal.to_json())["plan"] == list(proposal.plan or ())
