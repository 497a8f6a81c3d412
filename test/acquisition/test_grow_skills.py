# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Skills and shortcuts that grow over the network: followed, canceled, and gone on with."""

import subprocess
from dataclasses import replace

import pytest
from slap_msgs.msg import AcquisitionEvent

from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode
from slap_ros.relational.pddl import parse_domain
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.skills.skill_library import load_skill_library
from support.asking import LIMIT, SETTINGS, asking, grow, send_growth
from support.points_training import SMALL
from support.steady_skills import write_library

pytestmark = [pytest.mark.usefixtures("points_installed"), pytest.mark.training]


def trainers(launcher):
    """The processes that the node has started."""
    parent = launcher.processes["acquisition_node"].pid
    return subprocess.run(["pgrep", "-P", str(parent)], capture_output=True, text=True).stdout


@pytest.mark.slow  # starts nodes and three trainings, each of which imports torch
@pytest.mark.timeout(600)
def test_skills_and_shortcuts_grow_and_go_on_after_a_goal_was_canceled(network, tmp_path):
    """The skills work already, so a shortcut over them is all that there is to learn."""
    skills = write_library(tmp_path / "steady")
    choice = DomainChoice("points", "line", str(skills))
    parameters = {
        "output": str(tmp_path / "grown"), "skills": str(skills),
        "changes": "rollouts=2 validation=2",
        "shortcut_settings": "ours", "shortcut_changes": " ".join(SMALL), "growth_steps": 100_000,
    }  # fmt: skip
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
