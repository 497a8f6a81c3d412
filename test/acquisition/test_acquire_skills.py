# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Skills acquired over the network: announced, recorded, canceled and gone on with."""

import json
import os
import resource
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
from slap_msgs.msg import AcquisitionEvent, GroundAtom

from ensemble.launcher import ProcessLauncher
from slap_ros.bags import evaluate_bag, read_bag, replay_bag
from slap_ros.bags.recording import Recording
from slap_ros.errors import ErrorCode
from slap_ros.messages.interfaces import ACQUISITION_EVENT, SKILL_LIBRARY
from slap_ros.policies.library_files import ABOUT
from slap_ros.relational.pddl import parse_domain
from slap_ros.report.content import read_report
from slap_ros.report.page import render
from slap_ros.skills.skill_library import load_skill_library
from support.asking import (
    BRIEF,
    LEARNED,
    LIMIT,
    acquire,
    asking,
    begin_again,
    planner_parameters,
    send,
    solve,
)
from support.points import POINTS
from support.steady_skills import PICKING, write_library

pytestmark = pytest.mark.usefixtures("points_installed")


def children_of(launcher, name):
    """The processes that a node has started."""
    parent = launcher.processes[name].pid
    found = subprocess.run(["pgrep", "-P", str(parent)], capture_output=True, text=True)
    return [int(word) for word in found.stdout.split()]


@pytest.mark.slow
@pytest.mark.training
@pytest.mark.timeout(180)  # learns both skills
def test_skills_are_acquired_announced_recorded_and_acted_with(network, tmp_path):
    """Training needs no planner: one that is back takes on what is latched, and acts with it."""
    bag, output = tmp_path / "bag", tmp_path / "skills"
    parameters = {"output": str(output), "changes": LEARNED, "steps": 30_000}
    names = ("sim_node", "perception_node", "skill_server", "planner_node", "acquisition_node")
    with asking(bag, names=names, **parameters) as (asker, spinner, launcher):
        goal = {"proposer": "induced", "rewarder": "composed", "seed": 1}
        ended = send(asker, spinner, **goal).get_result_async()
        assert spinner.spin_until(lambda: any(one.skill for one in asker.feedback), LIMIT)
        launcher.processes["planner_node"].kill()
        assert spinner.spin_until(ended.done, LIMIT)
        result = ended.result().result
        assert result.success, result.error_msg
        assert spinner.spin_until(lambda: asker.libraries, LIMIT)
        # Until DDS has missed the killed one, a goal goes to it.
        assert spinner.spin_until(lambda: not asker.solver.server_is_ready(), LIMIT)
        with ProcessLauncher({"planner_node": planner_parameters(output)}):
            number = begin_again(asker, spinner)
            solved = solve(asker, spinner, number)
            assert solved.success, solved.error_msg
    operators = parse_domain(result.operators_pddl, "the result").operators
    assert {op.name for op in operators} == set(result.skills) == {"AchieveHolding", "AchieveAt"}
    assert (result.ended, result.progress) == ("nothing fails", 1.0)
    library = load_skill_library(Path(result.library), POINTS)
    assert library.digest == result.digest == asker.libraries[-1].digest
    assert asker.libraries[-1].folder == result.library and Path(result.library).parent == output
    assert asker.feedback[-1].steps == result.steps
    assert {one.skill for one in asker.feedback} == {"", *result.skills}
    recorded = list(read_bag(bag))
    events = [m.message for m in recorded if m.type_name == ACQUISITION_EVENT]
    assert [event.kind for event in events] == [event.kind for event in asker.events]
    assert [m.message.digest for m in recorded if m.type_name == SKILL_LIBRARY] == [result.digest]
    of = {kind: [e for e in events if e.kind == kind] for kind in {e.kind for e in events}}
    assert len(of[AcquisitionEvent.ROLLED_OUT]) % 12 == 0
    assert "R 0.8 parallel_dis" in of[AcquisitionEvent.FINISHED][0].operators[1]
    judged = of[AcquisitionEvent.JUDGED]
    steps = sum((len(event.success) - 1) * event.segment_steps for event in judged)
    assert steps == result.steps
    assert of[AcquisitionEvent.ACQUIRED][0].digest == result.digest


def slap(*arguments):
    command = [sys.executable, "-m", "ensemble.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


@pytest.mark.slow
@pytest.mark.training
@pytest.mark.timeout(300)  # starts an ensemble, learns with it, and starts it again
def test_a_run_acquires_what_it_lacks_and_one_bag_tells_it_all(network, tmp_path):
    """With a library that lacks one of two skills, which keeps the other one."""
    bag, changes = tmp_path / "bag", LEARNED.replace("sac.net_arch=32,32 ", "")
    skills = ["--skills", write_library(tmp_path / "some", PICKING)]
    ran = slap(
        "run", "points", "--acquire", "--goal", "swapped", "--record", bag, *skills, "--json",
        "--patience", "10", "--in-process",
        "--acquisition", f"output={tmp_path / 'skills'},steps=30000,changes={changes}",
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    recording = Recording.of(read_bag(bag))
    assert sorted(recording.episodes) == [1, 2]
    judged = [e for e in recording.acquisition if e.kind == AcquisitionEvent.JUDGED]
    assert {event.subject for event in judged} == {"Put"}
    (library,) = (path for path in (tmp_path / "skills").iterdir() if (path / ABOUT).exists())
    made = load_skill_library(library, POINTS)
    assert [skill.operator.name for skill in made.skills] == ["Pick", "Put"]
    assert made.record.get("kept") == "some"
    *failed, solved = evaluate_bag(bag).runs
    assert solved.success
    assert solved.as_json() == json.loads(ran.stdout)
    assert [run.error_code for run in failed] == [ErrorCode.UNSOLVABLE]
    assert replay_bag(bag).identical
    page = render([read_report(bag)])
    assert "How skills were acquired" in page and "acquisition 1: skills acquired" in page
    assert f"best {max(judged[-1].success):.2f}" in page
    assert "proposal 1: accepted" in page and "proposal 2" not in page


def begin(asker, spinner):
    """A goal that was sent and of which something was learned since."""
    told = len(asker.feedback)
    handle = send(asker, spinner)
    assert spinner.spin_until(lambda: any(one.skill for one in asker.feedback[told:]), LIMIT)
    return handle


@contextmanager
def small_files(pid, limit=40_000):
    """As on a full disk: a process, and those that it starts, cannot write more into a file."""
    before = resource.prlimit(pid, resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
    try:
        yield
    finally:
        resource.prlimit(pid, resource.RLIMIT_FSIZE, before)


@pytest.mark.slow
@pytest.mark.training
@pytest.mark.timeout(240)  # a node and four trainings, each of which imports torch
def test_a_training_that_was_stopped_goes_on_with_the_same_goal(network, tmp_path):
    """A full disk and a kill are reported; canceled, its process ends; what was learned is read."""
    with asking(output=str(tmp_path), **BRIEF) as (asker, spinner, launcher):
        with small_files(launcher.processes["acquisition_node"].pid):
            result = acquire(asker, spinner)
        assert result.error_code in (ErrorCode.INPUT_OUTPUT, ErrorCode.STORAGE_FULL)
        assert not asker.libraries

        asker.events.clear()
        ended = begin(asker, spinner).get_result_async()
        for process in children_of(launcher, "acquisition_node"):
            os.kill(process, signal.SIGKILL)
        assert spinner.spin_until(ended.done, LIMIT)
        result = ended.result().result
        assert result.error_code == ErrorCode.TRAINER_DIED
        assert "killed by SIGKILL" in result.error_msg
        assert asker.events[-1].kind == AcquisitionEvent.FAILED

        begun = len(asker.events)
        handle = begin(asker, spinner)
        (trainer,) = children_of(launcher, "acquisition_node")
        assert acquire(asker, spinner).error_code == ErrorCode.BUSY
        handle.cancel_goal_async()
        ended = handle.get_result_async()
        assert spinner.spin_until(ended.done, LIMIT)
        assert ended.result().result.error_code == ErrorCode.GOAL_CANCELED
        assert not Path(f"/proc/{trainer}").exists()

        canceled = len(asker.events)
        result = acquire(asker, spinner)
        assert result.success, result.error_msg
        assert [e.kind for e in asker.events].count(AcquisitionEvent.CANCELED) == 1
        first, second, third = (
            next(list(e.success) for e in events if e.kind == AcquisitionEvent.JUDGED)
            for events in (asker.events, asker.events[begun:], asker.events[canceled:])
        )
        assert first == second == third  # read, not learned again


@pytest.mark.training
@pytest.mark.slow
@pytest.mark.timeout(180)  # a node and two trainings, each of which imports torch
def test_what_cannot_be_acquired_is_said(network, tmp_path):
    """Each with the code of its cause; the node serves the next goal."""
    file = tmp_path / "file"
    file.write_text("")
    with asking(output=str(tmp_path), steps=500) as (asker, spinner, _):
        holds = GroundAtom(predicate="Loose", objects=["thing0"])
        for goal, code in (
            ({"proposer": "oracle"}, ErrorCode.INVALID_PARAMETER),
            ({"proposer": "induced"}, ErrorCode.INVALID_DOMAIN),  # it has rewards for other names
            ({"goal": [holds]}, ErrorCode.NOTHING_LEARNED),
        ):
            result = acquire(asker, spinner, **goal)
            assert not result.success
            assert result.error_code == code, result.error_msg
        assert not asker.libraries
    with asking(output=str(file / "below")) as (asker, spinner, _):
        assert acquire(asker, spinner).error_code == ErrorCode.INPUT_OUTPUT
