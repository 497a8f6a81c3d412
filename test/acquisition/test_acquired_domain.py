# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A library of skills in the place of a domain's own: commands, bags, digests, what is lacking."""

import json
import re
import shutil
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ensemble import encode
from ensemble.nodes import RunSettings, node_parameters
from slap_ros.bags import bag_info, evaluate_bag, read_bag, replay_bag
from slap_ros.bags.recording import Recording
from slap_ros.domains import get_domain
from slap_ros.errors import (
    ErrorCode,
    InvalidLibraryError,
    InvalidParameterError,
    SkillsChangedError,
    UnsolvableError,
)
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.evaluation.experiment import Experiment, run_with, solve
from slap_ros.learning.workers import local_workers
from slap_ros.messages.decode import decode_target
from slap_ros.messages.interfaces import PLAN
from slap_ros.planning.planner import PLANNERS, make_planner
from slap_ros.planning.problem import Problem
from slap_ros.policies import shipped_models
from slap_ros.report import read_report
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.skills.skill_library import SKILL
from support.bench import solved_by
from support.points import LOOSE, POINTS, PUT
from support.slap_command import slap
from support.steady_skills import PICKING, PUTTING, towards, write_library

SHARED = HealthCheck.function_scoped_fixture  # the library, which nothing changes
LIMIT_S = 120.0  # far more than anything here takes
pytestmark = pytest.mark.usefixtures("points_installed")
SOON = {"observation_timeout": 2.0}  # s, for a planner that will see no state
IN_PROCESS = ("--in-process", "--patience", "10")  # for a loaded machine


def said(ran):
    return " ".join(ran.stderr.split())


@pytest.fixture
def library(tmp_path):
    return write_library(tmp_path / "steady")


@pytest.fixture
def shipped(tmp_path, monkeypatch):
    """Where models ship, still without any."""
    models = tmp_path / "models"
    monkeypatch.setattr(shipped_models, "model_roots", lambda: iter([models]))
    return models / "skills" / "points"


@pytest.mark.parametrize("planner", PLANNERS)
def test_acquired_skills_are_planned_with_and_executed_like_any_others(library, planner):
    domain = open_domain(DomainChoice("points", skills=str(library)))
    assert list(domain.skills) == ["Pick", "Put"]
    for index in range(4):
        task = domain.task(3, index, "swapped")
        episode = solve(domain, task, PURE_PLANNING, planner)
        assert episode.success, episode.error
        again = solve(domain, task, PURE_PLANNING, planner)
        assert [s.key for s in again.states] == [s.key for s in episode.states]
    state = task.initial_state
    assert POINTS.atom_space(state).abstract(state) == domain.atom_space(state).abstract(state)


@settings(max_examples=60, deadline=None, suppress_health_check=[SHARED])
@given(st.integers(0, 10**6), st.lists(st.integers(0, 10**6), min_size=1, max_size=6))
def test_bounds_are_never_above_the_steps_that_skills_take(library, seed, choices):
    """From wherever other skills have left the robot."""
    domain = open_domain(DomainChoice("points", skills=str(library)))
    problem = Problem.of(domain, domain.task(seed).initial_state)
    model, state = problem.model, domain.task(seed).initial_state
    for choice in choices:
        abstract = model.space.abstract(state)
        applicable = [pair for pair in problem.operators if pair[0].applicable(abstract)]
        ground, option = applicable[choice % len(applicable)]
        rollout = model.roll_out(option, state, option.target(ground.apply(abstract)))
        assert option.skill.least_steps <= max(rollout.steps, 1)
        if rollout.reached:
            assert option.skill.lower_bound(state, option.objects) <= rollout.steps
        state = rollout.final


@pytest.mark.slow
def test_evaluation_records_the_library_and_is_the_same_in_other_processes(library, tmp_path):
    output = tmp_path / "evaluation.json"
    arguments = ["--goal", "swapped", "--tasks", 2, "--seeds", 1, "--output", output]
    ran = slap("evaluate", "points", "--skills", library, *arguments)
    assert ran.exit_code == 0, ran.output
    recorded = json.loads(output.read_text())["skills"]
    domain = open_domain(DomainChoice("points", skills=str(library)))
    digest = domain.configuration["skills_digest"]
    assert recorded == {"name": "steady", "digest": digest, "skills": ["Pick", "Put"]}
    experiment = Experiment(domain, 2, 1, skills=str(library))
    lengths = []
    for jobs in (1, 2):
        with local_workers(jobs) as workers:
            trials = run_with(workers, experiment, PURE_PLANNING)
            lengths.append(sorted((trial.index, trial.plan_length) for trial in trials))
    assert lengths[0] == lengths[1]


def test_a_bag_names_the_library_and_is_read_without_it(network, library, tmp_path):
    bag = tmp_path / "bag"
    ran = slap(
        "run", "points", "--goal", "swapped", "--skills", library, "--record", bag, *IN_PROCESS
    )
    assert ran.exit_code == 0, ran.output
    shutil.rmtree(library)
    about = bag_info(bag).metadata
    assert about["configuration.skills"] == "steady"
    assert len(about["configuration.skills_digest"]) == 16
    assert not any(str(tmp_path) in value for value in about.values())
    found = evaluate_bag(bag)
    assert found.runs[0].success and found.compared == found.states and not found.mismatches
    assert replay_bag(bag).identical
    assert Recording.of(read_bag(bag)).domain().skills == {}  # it takes the library to plan again


def test_a_bag_has_its_skills_where_the_library_ships(network, library, tmp_path, shipped):
    bag = tmp_path / "bag"
    ran = slap("run", "points", "--skills", library, "--record", bag, *IN_PROCESS)
    assert ran.exit_code == 0, ran.output
    shutil.copytree(library, shipped)
    assert list(Recording.of(read_bag(bag)).domain().skills) == ["Pick", "Put"]


def test_what_ships_is_used_unless_told_otherwise(library, shipped):
    assert not open_domain(DomainChoice("points")).skills
    shutil.copytree(library, shipped)
    domain = open_domain(DomainChoice("points"))
    assert list(domain.skills) == ["Pick", "Put"]
    assert not open_domain(DomainChoice("points", skills="none")).skills
    assert not get_domain("points").skills
    shown = json.loads(slap("domains", "points", "--json").stdout)
    assert shown["operators"] == ["Pick", "Put"]
    assert shown["configuration"]["skills"] == "points"
    again = DomainChoice.of(domain)
    assert open_domain(again).configuration == domain.configuration
    write_library(shipped, PICKING)
    with pytest.raises(SkillsChangedError, match=again.digest) as refused:
        open_domain(again)
    other = open_domain(DomainChoice("points")).configuration["skills_digest"]
    assert other in str(refused.value)


def test_the_choice_of_a_measured_domain_makes_a_measured_one_again():
    for choice in (DomainChoice("points"), DomainChoice("points", measured=True)):
        domain = open_domain(choice)
        for again in (DomainChoice.of(domain), DomainChoice.opened_as(domain)):
            assert again.make().is_measured == choice.measured


def test_a_library_is_known_by_its_digest_wherever_it_is(library, tmp_path):
    choice = DomainChoice.of(open_domain(DomainChoice("points", skills=str(library))), str(library))
    elsewhere = tmp_path / "elsewhere"
    shutil.copytree(library, elsewhere)
    announced = replace(choice, skills="")
    taken = announced.with_skills_of("planner", str(elsewhere))
    assert open_domain(taken).configuration["skills_digest"] == choice.digest
    slower = replace(PUTTING, horizon=PUTTING.horizon + 1)
    other = write_library(tmp_path / "other", PICKING, slower)
    with pytest.raises(
        SkillsChangedError, match=f"{choice.digest}, but .*other has [0-9a-f]{{16}}"
    ):
        open_domain(announced.with_skills_of("planner", str(other)))
    with pytest.raises(SkillsChangedError, match="no library of points ships"):
        open_domain(announced)
    for word in ("none", "demonstrator"):
        with pytest.raises(SkillsChangedError, match=f"planner was given {word}"):
            announced.with_skills_of("planner", word)
    with pytest.raises(SkillsChangedError, match="skills of its own, but planner was given"):
        DomainChoice("points").with_skills_of("planner", str(library))


@pytest.mark.parametrize("planner", PLANNERS)
def test_atoms_that_no_operator_mentions_may_appear(tmp_path, planner):
    """`Loose` holds again after Put, and this operator does not say so."""
    unsaid = frozenset(atom for atom in PUT.add_effects if atom.predicate is not LOOSE)
    putting = replace(PUTTING, operator=replace(PUT, add_effects=unsaid))
    library = write_library(tmp_path / "silent", PICKING, putting)
    domain = open_domain(DomainChoice("points", skills=str(library)))
    task = domain.task(3, 0, "swapped")
    episode = solve(domain, task, PURE_PLANNING, planner)
    assert episode.success and episode.replans == 0
    assert [edge.option for edge in episode.edges] == ["Pick", "Put"] * 2
    exact = solve(replace(domain, exact=True), task, PURE_PLANNING, planner)
    if planner == "astar":  # what it does not try in a model fails in the world
        assert exact.replans > 0
        return
    assert not exact.success
    assert re.search(r"Loose\(thing\d\) too many: something else disturbed", exact.error.reason)


def test_what_an_edge_asks_for_goes_through_messages_and_bags(network, tmp_path):
    library = write_library(tmp_path / "steady")
    domain = open_domain(DomainChoice("points", skills=str(library)))
    state = domain.task(3).initial_state
    space = domain.atom_space(state)
    goal = space.mask(domain.task(3).goal)
    for asked in (domain, replace(domain, exact=True)):
        for edge in make_planner("lazy", asked, state).plan(state, goal).plan.edges:
            message = encode.plan_edge(edge, space)
            assert decode_target(message, space) == edge.target
            assert message.others_may_appear == (asked is domain)
            assert bool(message.forbidden_atoms) == (asked is domain)
    bag = tmp_path / "bag"
    ran = slap("run", "points", "--skills", library, "--record", bag, *IN_PROCESS)
    assert ran.exit_code == 0, ran.output
    (plan,) = (message for _, kind, _, message in read_bag(bag) if kind == PLAN)
    for edge in plan.edges:
        deleted = {"Pick": {"HandEmpty", "Loose"}, "Put": {"Holding"}}[edge.name]
        assert edge.others_may_appear
        assert {atom.predicate for atom in edge.forbidden_atoms} == deleted
    (chain,) = read_report(bag).runs[0].chains
    assert [edge.outcome for edge in chain.edges] == ["reached"] * 4
    assert all(edge.added and edge.removed for edge in chain.edges)


def test_a_skill_that_fails_in_the_model_is_tried_and_planned_with_again(tmp_path):
    """Within two steps, this hand arrives from some sides and from others it does not."""
    weak = replace(PICKING, policy=towards(0, False, gain=1.7), horizon=2)
    library = write_library(tmp_path / "weak", weak, PUTTING)
    domain = open_domain(DomainChoice("points", skills=str(library)))
    failing = []
    for index in range(14):
        task = domain.task(5, index)
        goal = domain.atom_space(task.initial_state).mask(task.goal)
        planner = make_planner("lazy", domain, task.initial_state)
        result = planner.plan(task.initial_state, goal)
        episode = solve(domain, task, PURE_PLANNING)
        assert episode.success
        assert bool(result.fails) == (episode.replans > 0)
        if result.fails:
            failing.append(index)
            assert "effect not reached" in result.fails and result.edges_rolled_out > 0
    assert 0 < len(failing) < 14
    ran = slap("plan", "points", "--skills", library, "--seed", 5, "--index", failing[0])
    assert ran.exit_code == 0
    assert "this plan fails in the model, near the goal: no path through" in said(ran)


@pytest.mark.parametrize("planner", PLANNERS)
def test_an_operator_without_a_skill_is_named(tmp_path, planner):
    library = write_library(tmp_path / "half", PICKING)
    domain = open_domain(DomainChoice("points", skills=str(library)))
    task = domain.task(0)
    space = domain.atom_space(task.initial_state)
    with pytest.raises(UnsolvableError, match=r"lacks a skill for Put\(thing\d, place\d\)"):
        make_planner(planner, domain, task.initial_state).plan(
            task.initial_state, space.mask(task.goal)
        )


def test_skills_that_are_left_out_are_named_with_the_reason(network, library):
    (folder,) = library.glob("Put-*")
    about = json.loads((folder / SKILL).read_text())
    (folder / SKILL).write_text(json.dumps(about | {"sha256": "0"}))
    for command in (("plan",), ("run", *IN_PROCESS)):
        ran = slap(*command, "points", "--skills", library)
        assert ran.exit_code == ErrorCode.UNSOLVABLE
        assert "a skill is left out" in said(ran) and "checksum" in said(ran)
        assert "lacks a skill for Put(" in said(ran)
    shutil.rmtree(next(library.glob("Pick-*")))
    with pytest.raises(InvalidLibraryError, match=r"no skill of it can be used: .*checksum"):
        open_domain(DomainChoice("points", skills=str(library)))


def test_folders_that_are_no_library_are_refused(library, tmp_path):
    with pytest.raises(InvalidParameterError, match=r"unknown skills '.*nowhere'"):
        DomainChoice("points", skills=str(tmp_path / "nowhere"))
    about = json.loads((library / "library.json").read_text())
    (library / "library.json").write_text(json.dumps(about | {"format": 2}))
    assert "format 2" in said(slap("plan", "points", "--skills", library))
    (library / "library.json").write_text(json.dumps(about | {"domain": "other"}))
    ran = slap("evaluate", "points", "--skills", library)
    assert "skills of domain 'other', not of 'points'" in said(ran)
    (library / "library.json").unlink()
    assert slap("run", "points", "--skills", library).exit_code == ErrorCode.INVALID_LIBRARY


def test_learned_skills_are_judged_beside_policies_that_see_nothing(library, tmp_path):
    pytest.importorskip("matplotlib")
    ran = slap(
        "study", "vacuity", "points", "--starts", 6, "--skills", library, "--output", tmp_path
    )
    assert ran.exit_code == 0, ran.output
    data = json.loads((tmp_path / "vacuity_points.json").read_text())
    assert data["skills"]["name"] == "steady"
    assert [one["learned"]["rate"] for one in data["found"]["operators"]] == [1.0, 1.0]
    assert "| learned |" in (tmp_path / "vacuity_points.md").read_text()


@pytest.mark.slow
@pytest.mark.timeout(180)  # runs an ensemble three times, and waits for one that refuses
def test_nodes_with_another_library_refuse_and_those_with_a_copy_do_not(network, library, tmp_path):
    run = RunSettings(DomainChoice("points", "two", str(library)), 0, 0, "lazy", None, patience=5.0)
    nodes = {name: dict(given) for name, given in node_parameters(run).items()}
    elsewhere = shutil.copytree(library, tmp_path / "elsewhere")
    nodes["planner_node"]["skills"] = str(elsewhere)
    assert solved_by(nodes).success
    other = write_library(tmp_path / "other", replace(PICKING, horizon=40), PUTTING)
    nodes["planner_node"] |= {"skills": str(other), **SOON}
    refused = solved_by(nodes)
    assert refused.error_code == ErrorCode.SKILLS_CHANGED
    for path in (library, other):
        domain = open_domain(DomainChoice("points", skills=str(path)))
        assert domain.configuration["skills_digest"] in refused.error_msg


@pytest.mark.timeout(180)  # runs an ensemble twice, and waits for one that refuses
def test_nodes_that_were_given_none_need_the_library_that_is_announced(network, library, shipped):
    run = RunSettings(DomainChoice("points", "two", str(library)), 0, 0, "lazy", None, patience=5.0)
    nodes = {name: dict(given) for name, given in node_parameters(run).items()}
    for name in ("perception_node", "skill_server", "planner_node"):
        nodes[name] |= {"skills": "", "domain": ""}
    refused = solved_by(nodes | {"planner_node": nodes["planner_node"] | SOON})
    assert refused.error_code == ErrorCode.SKILLS_CHANGED
    assert "no library of points ships: give the folder" in refused.error_msg
    shutil.copytree(library, shipped)
    assert solved_by(nodes).success
