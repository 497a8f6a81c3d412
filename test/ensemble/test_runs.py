# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whole runs: live, recorded and in one process tell the same; the same seed gives the same bag."""

import json
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import psutil
import pytest

from ensemble.cli.event_printer import EventPrinter
from ensemble.nodes import RunSettings
from ensemble.run import RunRequest, run
from slap_ros.bags import bag_digest, bag_info, evaluate_bag, read_bag, replay_bag
from slap_ros.domains import get_domain
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.evaluation.experiment import Experiment, solve
from slap_ros.messages.decode import stamp_ns
from slap_ros.messages.interfaces import ATOMS, MARKERS, STATE
from slap_ros.perception import NoisyPerceiver, Quality
from slap_ros.planning.execution import Executor
from slap_ros.planning.planner import make_planner
from slap_ros.skills.domain_choice import DomainChoice
from support.slap_command import slap

FRAMES = "tf2_msgs/msg/TFMessage"
PATIENCE = 5.0  # for a loaded machine
# Of `slap run obstacle2d --seed 3 --planner lazy`, whatever the machine, the Python and the numpy.
DIGEST_OF_SEED_3 = "d538363d5738338dbf0fab42edadf582fdd946453c1412bc45be5608c68ef610"


def ignore(type_name, message):
    pass


def request(record=None, seed=3, in_process=True, **options):
    settings = RunSettings(
        DomainChoice("obstacle2d", "fair"),
        seed,
        0,
        "lazy",
        record,
        shortcuts="none",
        patience=PATIENCE,
    )
    return RunRequest(settings, timeout_s=200, in_process=in_process, **options)


def slap_alone(*arguments, **options):
    command = [sys.executable, "-m", "ensemble.cli", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=200, **options)


def atoms_by_step(bag):
    return {
        message.step: {(a.predicate, tuple(a.objects)) for a in message.atoms}
        for _, type_name, _, message in read_bag(bag)
        if type_name == ATOMS
    }


def test_live_bag_in_process_and_offline_agree_to_the_digit(network, tmp_path):
    arguments = ["--seed", "3", "--shortcuts", "none", "--record", str(tmp_path / "a")]
    arguments += ["--planner", "lazy", "--patience", str(PATIENCE)]
    live = slap_alone("run", "obstacle2d", *arguments, "--json")
    assert live.returncode == 0, live.stderr
    from_bag = slap_alone("bag", "evaluate", str(tmp_path / "a"), "--json")
    assert from_bag.returncode == 0, from_bag.stderr
    live_numbers, bag_numbers = json.loads(live.stdout), json.loads(from_bag.stdout)
    assert bag_numbers["atom_mismatches"] == 0
    assert {key: bag_numbers[key] for key in live_numbers} == live_numbers
    assert live_numbers["success"]

    in_process = run(request(tmp_path / "b"), ignore)
    assert in_process.plan_length == live_numbers["plan_length"]
    assert [o.steps for o in in_process.options] == [o["steps"] for o in live_numbers["options"]]
    assert atoms_by_step(tmp_path / "a") == atoms_by_step(tmp_path / "b")
    assert bag_digest(tmp_path / "a") == bag_digest(tmp_path / "b") == DIGEST_OF_SEED_3

    domain = get_domain("obstacle2d")
    offline = Experiment(domain, tasks=1, seeds=1, first_seed=3).run(3, 0)
    assert offline.plan_length == live_numbers["plan_length"]
    assert offline.edges_rolled_out == live_numbers["edges_rolled_out"]
    assert offline.bound == live_numbers["bound"] == 1.0


def test_a_bag_replays_bit_for_bit_and_says_what_made_it(network, tmp_path):
    run(request(tmp_path / "bag", seed=5), ignore)
    result = replay_bag(tmp_path / "bag")
    assert result.identical
    assert result.compared == evaluate_bag(tmp_path / "bag").states
    metadata = bag_info(tmp_path / "bag").metadata
    assert metadata["domain"] == "obstacle2d"
    assert metadata["seed"] == "5"
    assert {"python", "numpy", "slap_ros", "revision", "configuration.bystanders"} <= set(metadata)


def test_what_is_shown_of_a_state_has_its_stamp(network, tmp_path):
    run(request(tmp_path / "bag"), ignore)
    stamps = {kind: [] for kind in (STATE, MARKERS, FRAMES)}
    for _, kind, _, message in read_bag(tmp_path / "bag"):
        if kind == STATE:
            stamps[kind].append(stamp_ns(message.header))
        elif kind in stamps:
            (shown,) = {stamp_ns(part.header) for part in parts(message)}
            stamps[kind].append(shown)
    assert stamps[STATE] == stamps[MARKERS]
    assert len(stamps[FRAMES]) > 20
    assert set(stamps[FRAMES]) <= set(stamps[STATE])  # they do not wait for a recorder


def parts(message):
    """The markers or frames of a message."""
    return message.markers if hasattr(message, "markers") else message.transforms


@pytest.mark.parametrize(("seed", "replans"), [(2, True), (3, False)])
def test_with_noise_the_ensemble_errs_as_an_experiment_does(network, tmp_path, seed, replans):
    """The same looks, plans and replans, whoever runs them; bags tell what cannot be checked."""
    noise = {"position_noise": 0.005, "threshold_noise": 0.002, "noise_seed": 2}
    settings = RunSettings(
        DomainChoice("obstacle2d", "fair"),
        seed,
        0,
        "lazy",
        tmp_path / "bag",
        shortcuts="none",
        perception=noise,
        patience=PATIENCE,
    )
    live = run(RunRequest(settings, max_replans=10, timeout_s=200, in_process=True), ignore)
    (recorded,) = evaluate_bag(tmp_path / "bag").runs
    assert recorded == live
    assert evaluate_bag(tmp_path / "bag").compared == 0
    assert replay_bag(tmp_path / "bag").identical  # what happened is exact, whatever was seen

    domain = get_domain("obstacle2d")
    task = domain.task(seed)
    space = domain.atom_space(task.initial_state)
    quality = Quality(position_noise_m=0.005, threshold_noise=0.002)
    rng = np.random.default_rng([2, 1])  # of the first episode
    offline = Executor(
        domain,
        make_planner("lazy", domain, task.initial_state),
        domain.make_world(task.initial_state),
        space,
        space.mask(task.goal),
        task.step_limit,
        10,
        NoisyPerceiver.of(domain, space, task.initial_state, quality, rng),
    ).run()
    assert (live.success, live.plan_length, live.replans, live.error_code) == (
        offline.success,
        offline.plan_length,
        offline.replans,
        offline.error.code,
    )
    assert (live.replans > 0) == replans


def test_planning_goes_on_while_the_robot_moves_as_in_an_experiment(network, tmp_path):
    choice = DomainChoice("obstacle_tower", "fair:obstacles=4")
    settings = RunSettings(
        choice, 302, 0, "anytime", tmp_path / "bag", shortcuts="none", patience=PATIENCE
    )
    live = run(RunRequest(settings, timeout_s=200, in_process=True), ignore)
    evaluation = evaluate_bag(tmp_path / "bag")
    assert (evaluation.runs, evaluation.damage) == ([live], None)
    domain = get_domain(choice.name, choice.preset)
    offline = solve(domain, domain.task(302), PURE_PLANNING, "anytime")
    assert offline.plan_length < offline.plans[0].planned.steps
    assert (live.success, live.plan_length, live.replans, live.edges_rolled_out) == (
        True,
        offline.plan_length,
        0,
        offline.edges_rolled_out,
    )


def test_an_object_that_nobody_sees_ends_a_run_with_its_own_code(network):
    arguments = ["--seed", "3", "--shortcuts", "none", "--in-process"]
    arguments += ["--patience", str(PATIENCE)]
    live = slap_alone("run", "obstacle2d", *arguments, "--perception", "hidden=block1,memory=5")
    assert live.returncode == 77, live.stderr
    assert "the goal is about what is not detected: block1" in live.stderr


@pytest.mark.parametrize(
    ("perception", "words"),
    [
        ("debounce=0", "debounce is at least 1"),
        ("hidden=block9", "block9 cannot be hidden"),
        ("noise_seed=-1", "noise_seed is -1; it must be from 0"),
        ("acuity=6", "perception has no parameter"),
        ("dropout=often", "dropout must be a number"),
    ],
)
def test_perception_that_cannot_be_is_refused_before_anything_starts(perception, words):
    result = slap("run", "obstacle2d", "--perception", perception)
    assert result.exit_code == 15
    assert words in " ".join(result.stderr.split())


def test_a_goal_of_ones_own_is_reached_and_recognised(network, tmp_path):
    domain = get_domain("obstacle2d")
    space = domain.atom_space(domain.task(3).initial_state)
    goal = [space.atom("Holding", ["robot", "block2"])]
    live = run(request(tmp_path / "bag", goal=goal), ignore)
    assert live.success
    assert [option.name for option in live.options] == ["PickFromTarget"]
    (recorded,) = evaluate_bag(tmp_path / "bag").runs
    assert recorded == live


def test_an_unsolvable_goal_says_so_live_and_in_the_bag(network, tmp_path):
    goal = "(and (Holding robot block1) (Holding robot block2))"
    live = slap_alone(
        "run", "obstacle2d", "--goal", goal, "--record", str(tmp_path / "bag"), "--in-process"
    )
    assert live.returncode == 30, live.stderr
    assert "the goal holds in none of" in live.stderr
    (recorded,) = evaluate_bag(tmp_path / "bag").runs
    assert recorded.error_code == 30


def test_running_out_of_steps_says_so(network):
    metrics = run(request(step_limit=10), ignore)
    assert not metrics.success
    assert metrics.error_code == 33
    assert metrics.plan_length == 10


def test_the_story_of_a_run_is_told(network, capsys):
    assert run(request(), EventPrinter()).success
    told = capsys.readouterr().err
    assert "plan 0:" in told
    assert "PlaceInTarget(robot, block1, target): reached" in told


@pytest.mark.slow
@pytest.mark.timeout(180)  # waits for threads, of which the kernel may tell too long
def test_10_runs_leave_no_thread_no_file_and_no_process(network, tmp_path):
    def left():
        return (
            threading.active_count(),
            sum(1 for _ in Path("/proc/self/fd").iterdir()),
            sum(1 for _ in Path("/proc/self/task").iterdir()),
        )

    run(request(tmp_path / "first"), ignore)
    before, children = left(), set(psutil.Process().children())
    for number in range(10):
        bag = tmp_path / str(number) if number % 5 == 0 else None
        assert run(request(bag, seed=number), ignore).success
    # The kernel lists a thread for a moment after it was joined.
    end = time.monotonic() + 60.0
    while any(now > then for now, then in zip(left(), before, strict=True)):
        assert time.monotonic() < end, (before, left())
        time.sleep(0.02)
    assert set(psutil.Process().children()) <= children


@pytest.mark.slow
@pytest.mark.timeout(180)  # starts an ensemble, each node a process, and plans for a tower
def test_a_tower_is_taken_apart_by_the_ensemble_and_replayed_bit_for_bit(network, tmp_path):
    settings = RunSettings(
        DomainChoice("obstacle_tower", "fair"),
        1,
        0,
        "lazy",
        tmp_path / "bag",
        shortcuts="none",
        patience=PATIENCE,
    )
    live = run(RunRequest(settings, timeout_s=500), ignore)
    assert live.success, live.error_msg
    assert replay_bag(tmp_path / "bag").identical
    found = evaluate_bag(tmp_path / "bag")
    assert found.mismatches == []
    assert found.runs == [live]
