# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Skills and shortcuts that grow over the network: followed, canceled, and gone on with."""

import json
import subprocess
import sys
from dataclasses import replace

import pytest
from slap_msgs.msg import AcquisitionEvent

from slap_ros.bags import evaluate_bag
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode
from slap_ros.relational.pddl import parse_domain
from slap_ros.report.content import read_report
from slap_ros.report.page import render
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.skills.skill_library import load_skill_library
from support.asking import GROWTH_LIMIT, LIMIT, SETTINGS, asking, grow, send_growth
from support.points_training import SMALL
from support.steady_skills import write_library

pytestmark = [pytest.mark.usefixtures("points_installed"), pytest.mark.training]


def trainers(launcher):
    """The processes that the node has started."""
    parent = launcher.processes["acquisition_node"].pid
    return subprocess.run(["pgrep", "-P", str(parent)], capture_output=True, text=True).stdout


def growing(folder, skills):
    """Parameters of the acquisition node with which a shortcut over skills is found in seconds."""
    return {
        "output": str(folder / "grown"), "skills": str(skills),
        "changes": "rollouts=2 validation=2",
        "shortcut_settings": "ours", "shortcut_changes": " ".join(SMALL), "growth_steps": 100_000,
    }  # fmt: skip


@pytest.mark.slow  # starts nodes and three trainings, each of which imports torch
@pytest.mark.timeout(600)
def test_skills_and_shortcuts_grow_and_go_on_after_a_goal_was_canceled(network, tmp_path):
    """The skills work already, so a shortcut over them is all that there is to learn."""
    skills = write_library(tmp_path / "steady")
    choice = DomainChoice("points", "line", str(skills))
    parameters = growing(tmp_path, skills)
    settings = replace(SETTINGS, domain=choice)
    with asking(settings=settings, **parameters) as (asker, spinner, launcher):
        refused = grow(asker, spinner, step_budget=6000)
        assert refused.error_code == ErrorCode.INVALID_PARAMETER
        assert "too few for a round" in refused.error_msg

        handle = send_growth(asker, spinner)
        assert spinner.spin_until(lambda: any(one.shortcut for one in asker.feedback), LIMIT)
        assert grow(asker, spinner).error_code == ErrorCode.BUSY
        handle.cancel_goal_async()
        ended = handle.get_result_async()
        assert spinner.spin_until(ended.done, LIMIT)
        canceled = ended.result().result
        assert canceled.error_code == ErrorCode.GOAL_CANCELED
        assert not trainers(launcher)
        (explored,) = (tmp_path / "grown").rglob("explored.json")
        folder, kept = explored.parents[2], explored.stat()
        assert f"stays in {folder}," in canceled.error_msg

        told = len(asker.feedback)
        result = grow(asker, spinner)
        assert result.success, result.error_msg
        assert (explored.stat().st_ino, explored.stat().st_mtime_ns) == (
            kept.st_ino, kept.st_mtime_ns
        )  # fmt: skip
        assert spinner.spin_until(lambda: asker.libraries, LIMIT)
    require_grown(result, folder, choice)
    assert asker.libraries[-1].digest == result.digest
    feedback = asker.feedback[told:]
    assert {one.round for one in feedback} >= {1, 2}
    assert "carrying out plans" in {one.phase for one in feedback}
    assert feedback[-1].steps == result.steps > 0 and feedback[-1].length == result.length
    kinds = [event.kind for event in asker.events]
    assert kinds.count(AcquisitionEvent.CANCELED) == kinds.count(AcquisitionEvent.ACQUIRED) == 1


@pytest.mark.slow  # starts an ensemble, in which three processes import torch, and acts twice
@pytest.mark.timeout(600)
def test_one_bag_has_the_proposal_the_skills_and_the_plan_that_a_shortcut_makes_shorter(
    network, tmp_path
):
    """The same task twice: with skills alone, and with what has grown over them meanwhile."""
    bag, skills = tmp_path / "bag", write_library(tmp_path / "steady")
    given = growing(tmp_path, skills)
    del given["skills"]  # all nodes have them
    run = subprocess.run(
        [
            sys.executable, "-m", "ensemble.cli", "run", "points", "--preset", "line",
            "--skills", skills, "--grow", "--patience", "5", "--in-process",
            "--acquisition", ",".join(f"{name}={value}" for name, value in given.items()),
            "--record", bag, "--json",
        ],
        capture_output=True, text=True, timeout=GROWTH_LIMIT,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    first, second = evaluate_bag(bag).runs
    assert first.success and second.success and second.as_json() == json.loads(run.stdout)
    assert second.plan_length < 0.7 * first.plan_length
    assert first.shortcut_steps == 0 and second.shortcut_steps == second.plan_length
    (growth,) = read_report(bag).acquisitions
    (kept,) = (one for one in growth.shortcuts if one.kept)
    assert f"{kept.name}: {kept.without:.1f} steps" in run.stderr
    page, (grown,) = render([read_report(bag)]), (tmp_path / "grown").glob("*/shortcuts")
    assert "proposal 1: accepted" in page and "acquisition 1: skills acquired" in page
    assert f'<th scope="row"><code>{kept.name}</code></th>' in page
    shortcuts = load_library(grown, get_domain("points", "line"))
    assert (first.library, second.library) == ("", shortcuts.digest)


def require_grown(result, folder, choice):
    """Both libraries are in the folder and belong together, and plans are shorter."""
    assert (result.rounds, result.best_round) == (2, 1)
    assert result.ended == "no skill learns from where shortcuts have led"
    assert result.length < 0.6 * result.length_alone and result.progress == 1.0
    points = get_domain("points", "line")
    skills = load_skill_library(folder / "skills", points)
    assert (result.library, result.digest) == (str(folder / "skills"), skills.digest)
    assert result.digest == open_domain(choice).configuration["skills_digest"]
    operators = parse_domain(result.operators_pddl, "the result").operators
    assert {op.name for op in operators} == set(result.skills) == {"Pick", "Put"}
    shortcuts = load_library(folder / "shortcuts", points)
    assert result.shortcuts == [one.name for one in shortcuts.shortcuts] != []
    assert (result.shortcut_library, result.shortcut_digest) == (
        str(folder / "shortcuts"), shortcuts.digest
    )  # fmt: skip
    assert shortcuts.usable_over(result.digest)
