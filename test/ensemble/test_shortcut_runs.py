# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Runs with shortcuts: planned, requested, executed, attributed, replayed."""

import json
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from slap_msgs.srv import ListSkills

from ensemble import encode
from ensemble.client import RunClient
from ensemble.interfaces import LIST_SKILLS
from ensemble.launcher import InProcessLauncher
from ensemble.nodes import RunSettings, node_parameters
from ensemble.observation import Episode, Observation
from ensemble.run import RunRequest, run
from ensemble.shortcuts import ShortcutParameters, ShortcutProvider
from ensemble.spinner import temporary_node
from skill_server.requested_option import requested_option
from slap_ros.bags import evaluate_bag, replay_bag
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidLibraryError, SkillNotApplicableError, UnknownSkillError
from slap_ros.evaluation.approaches import approaches
from slap_ros.evaluation.experiment import Experiment
from slap_ros.planning.model import Model
from slap_ros.planning.option_execution import OptionExecution
from slap_ros.planning.options import OptionKind
from slap_ros.planning.plan import PlanEdge
from slap_ros.planning.problem import Problem
from slap_ros.relational import Target
from slap_ros.shortcuts.sampling import DEFAULT
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.skills.domain_choice import DomainChoice

DATA = Path(__file__).parent.parent / "shortcuts" / "data" / "obstacle2d"
SHORTCUT = "Clear_On-e41568a9"
SEED = 1
PATIENCE = 5.0  # for a loaded machine
LIMIT = 120.0  # s, far more than anything here takes


def request(record=None, shortcuts=DATA, seed=SEED):
    settings = RunSettings(
        DomainChoice("obstacle2d", "fair"),
        seed,
        0,
        "lazy",
        record,
        shortcuts=str(shortcuts),
        patience=PATIENCE,
    )
    return RunRequest(settings, timeout_s=200, in_process=True)


def ignore(type_name, message):
    pass


def test_a_shortcut_is_executed_attributed_and_replayed(network, tmp_path):
    live = run(request(tmp_path / "bag"), ignore)
    assert live.success
    used = [option for option in live.options if option.kind == "shortcut"]
    assert [(o.name, o.outcome) for o in used] == [(SHORTCUT, "reached")]
    assert 0 < live.shortcut_steps == used[0].steps < live.plan_length
    found = evaluate_bag(tmp_path / "bag")
    assert found.runs == [live]
    assert found.mismatches == []
    assert replay_bag(tmp_path / "bag").identical

    domain = get_domain("obstacle2d")
    library = load_library(DATA, domain)
    assert (live.planner, live.library, live.samples) == ("lazy", library.digest, 16)
    slap = approaches(library, DEFAULT)[-1]
    offline = Experiment(domain, tasks=1, seeds=1).run(SEED, 0, slap)
    assert offline.plan_length == live.plan_length
    assert offline.shortcut_steps == live.shortcut_steps
    assert offline.edges_rolled_out == live.edges_rolled_out
    pure = Experiment(domain, tasks=1, seeds=1).run(SEED, 0)
    assert live.plan_length < pure.plan_length


@pytest.mark.slow
def test_processes_tell_the_same_live_and_from_the_bag(network, tmp_path):
    def slap(*arguments):
        command = [sys.executable, "-m", "ensemble.cli", *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=2 * LIMIT)
        assert done.returncode == 0, done.stderr
        return done.stdout

    bag = tmp_path / "bag"
    arguments = ("--seed", SEED, "--shortcuts", DATA, "--samples", 8, "--record", bag, "--json")
    arguments += ("--patience", PATIENCE)
    live = json.loads(slap("run", "obstacle2d", *arguments))
    from_bag = json.loads(slap("bag", "evaluate", bag, "--json"))
    assert {key: from_bag[key] for key in live} == live
    assert live["shortcut_steps"] > 0


def test_a_damaged_shortcut_costs_nothing_but_itself(network, tmp_path):
    library = shutil.copytree(DATA, tmp_path / "library")
    (library / SHORTCUT / "policy.safetensors").write_bytes(b"no tensors")
    metrics = run(request(shortcuts=library), ignore)
    pure = run(request(shortcuts="none"), ignore)
    assert metrics.success
    assert metrics.options == pure.options
    assert metrics.shortcut_steps == 0


def test_a_foreign_library_ends_the_run_before_it_begins(network, tmp_path):
    library = shutil.copytree(DATA, tmp_path / "library")
    about = json.loads((library / "library.json").read_text()) | {"domain": "obstacle_tower"}
    (library / "library.json").write_text(json.dumps(about))
    with pytest.raises(InvalidLibraryError, match="'obstacle_tower', not of 'obstacle2d'"):
        run(request(shortcuts=library), ignore)


def test_learned_shortcuts_are_listed(network):
    nodes = node_parameters(request().settings)
    two = {name: nodes[name] for name in ("sim_node", "skill_server")}
    with (
        temporary_node(lambda: RunClient(ignore)) as (client, spinner),
        InProcessLauncher(two, spinner.executor),
    ):
        service = client.create_client(LIST_SKILLS.type, LIST_SKILLS.name)
        assert spinner.spin_until(service.service_is_ready, LIMIT)

        def skills():
            answer = service.call_async(ListSkills.Request())
            assert spinner.spin_until(answer.done, LIMIT)
            return answer.result().skills

        assert spinner.spin_until(skills, LIMIT)  # once the skill server knows the domain
        (learned,) = [skill for skill in skills() if skill.kind == OptionKind.SHORTCUT.value]
    assert learned.name == SHORTCUT
    assert list(learned.parameters) == ["block", "surface", "surface"]
    assert learned.step_limit == DEFAULT.horizon
    assert {pair.key for pair in learned.training} == {"steps", "success", "length"}


# -- requests to the skill server ---------------------------------------------------------------


@pytest.fixture
def observed():
    """What the skill server sees with block1 in the hand, and the obstacle out of the way."""
    domain = get_domain("obstacle2d")
    task = domain.task(SEED)
    space = domain.atom_space(task.initial_state)
    episode = Episode(1, 0, domain, task, space)
    problem = Problem.of(domain, task.initial_state)
    ground, pick = next(o for o in problem.operators if str(o[0]) == "Pick(robot, block1, table)")
    start = ground.apply(space.abstract(task.initial_state))
    state = problem.model.roll_out(pick, task.initial_state, Target.exactly(start)).final
    target = start | space.mask(
        [space.atom("Clear", ["target"]), space.atom("On", ["block2", "table"])]
    )
    target &= ~space.mask([space.atom("Overlap", ["block2", "target"])])
    return Observation(episode, 6, state, start), target


def provider(observation, choice=DATA):
    node = SimpleNamespace(get_logger=lambda: None)
    made = ShortcutProvider(node, ShortcutParameters(shortcuts=str(choice)))
    made.prepare(observation.episode.domain)
    return made


def goal(observation, target, name=SHORTCUT, objects=("block2", "target", "table"), attempt=0):
    space = observation.episode.space
    option = SimpleNamespace(
        kind=OptionKind.SHORTCUT,
        skill=SimpleNamespace(name=name),
        objects=[space.layout.object(o) for o in objects],
        attempt=attempt,
    )
    edge = encode.plan_edge(PlanEdge(option, Target.exactly(target), 0), space)
    return SimpleNamespace(episode=1, edge=edge)


def test_a_fitting_request_is_the_shortcut_itself(observed):
    observation, target = observed
    shortcuts = provider(observation)
    option, wanted = requested_option(goal(observation, target), observation, shortcuts)
    assert (option.kind, option.skill.name) == (OptionKind.SHORTCUT, SHORTCUT)
    assert wanted == Target.exactly(target)
    again, _ = requested_option(goal(observation, target), observation, shortcuts)
    assert again == option
    actions = observation.episode.domain.action_space
    execution = OptionExecution(
        option, wanted, observation.episode.space, actions, observation.state
    )
    assert len(execution.advance(observation.state, observation.abstract)) == len(actions.axes)


def test_the_attempt_that_was_planned_is_the_one_that_runs(observed):
    """Each ends elsewhere, and the rest of the plan counts on where."""
    observation, target = observed
    model, rollouts = Model.of(observation.episode.domain, observation.state), []
    for attempt in range(3):
        asked = goal(observation, target, attempt=attempt)
        option, wanted = requested_option(asked, observation, provider(observation))
        rollouts.append(model.roll_out(option, observation.state, wanted))
    assert all(rollout.reached for rollout in rollouts)
    assert len({rollout.final.key for rollout in rollouts}) == 3
    steps = [rollout.steps for rollout in rollouts]
    assert steps == sorted(steps)


def test_an_attempt_that_never_was_is_refused(observed):
    observation, target = observed
    asked = goal(observation, target, attempt=50)
    option, _ = requested_option(asked, observation, provider(observation))
    with pytest.raises(SkillNotApplicableError, match="attempt 51 was asked for"):
        option.skill.start(observation.state, option.objects)


def test_a_request_that_does_not_fit_says_why(observed):
    observation, target = observed
    shortcuts = provider(observation)
    space = observation.episode.space
    refused = {
        f"unknown shortcut 'Fly': there are {SHORTCUT}": goal(observation, target, "Fly"),
        "does not lead from here": goal(
            observation, target & ~space.mask([space.atom("Holding", ["robot", "block1"])])
        ),
        "is about (block2, target, table), not (block1, target, table)": goal(
            observation, target, objects=("block1", "target", "table")
        ),
    }
    for words, wrong in refused.items():
        with pytest.raises(UnknownSkillError) as error:
            requested_option(wrong, observation, shortcuts)
        assert words in str(error.value)


def test_without_a_library_a_shortcut_is_unknown(observed):
    observation, target = observed
    with pytest.raises(UnknownSkillError, match="no shortcut library is loaded"):
        requested_option(goal(observation, target), observation, provider(observation, "none"))
