# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans of one physics executed in another: what counts as solved, and what is said of the rest."""

import json
import sys

import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.comparison import PlanningSetup
from slap_ros.studies.slap.transfer import OTHER, OWN, solve_in_mujoco
from support.slap_command import slap

pytest.importorskip("pybullet")
pytest.importorskip("mujoco")

# A block on the table and a free target: the shortest plans that there are.
SMALL = ["--preset", "fair:obstacles=0,distractors=0", "--tasks", "1", "--seeds", "1"]
SMALL += ["--first-seed", "1", "--samples", "1"]


def study(output, *more):
    return slap("study", "transfer", "obstacle_tower", "--output", output, *SMALL, *more)


def test_a_robot_that_holds_after_a_fault_has_not_solved_its_task(monkeypatch):
    """No command is safe in a workspace without room."""
    setup = PlanningSetup(DomainChoice.of(get_domain("obstacle_tower")), "lazy", PURE_PLANNING)
    from slap_ros.robot.limits import PANDA, Workspace
    from slap_ros.robot.mujoco import closed_loop

    nowhere = PANDA.scaled(0.5, Workspace((0.2, -0.5, 0.88), (0.8, 0.5, 0.9)))
    settings = closed_loop.ClosedLoopSettings(limits=nowhere)
    monkeypatch.setattr(closed_loop, "ClosedLoopSettings", lambda: settings)
    trial = solve_in_mujoco(setup, 1, 0)
    assert not trial.success
    assert trial.error_code == ErrorCode.UNSAFE_COMMAND
    assert "workspace" in trial.reason


def test_without_the_extra_nothing_is_solved(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    done = study(tmp_path)
    assert done.exit_code == ErrorCode.INVALID_PARAMETER
    assert "slap_ros[mujoco]" in " ".join(done.stderr.split())
    assert not list(tmp_path.iterdir())


@pytest.mark.slow  # solves a task four times, and plans with shortcuts
@pytest.mark.timeout(300)
@pytest.mark.parametrize("name", ["transfer", "camera"])
def test_a_domain_without_an_arm_is_refused_and_not_counted_as_unsolved(tmp_path, name):
    if name == "camera":
        pytest.importorskip("pupil_apriltags")
    ran = slap("study", name, "obstacle2d", "--output", tmp_path / "out")
    assert ran.exit_code == ErrorCode.INVALID_PARAMETER, ran.stderr
    assert "obstacle2d has no Panda" in ran.stderr
    assert not list(tmp_path.iterdir())


def test_every_task_is_solved_in_both_physics(tmp_path):
    done = study(tmp_path)
    assert done.exit_code == 0, done.stderr
    data = json.loads((tmp_path / "transfer_obstacle_tower.json").read_text())["found"]
    for physics in (OWN, OTHER):
        for approach in data[physics]:
            (trial,) = approach["trials"]
            assert (trial["seed"], trial["index"]) == (1, 0)
        assert data[physics][0]["success_rate"] == 1.0
    page = (tmp_path / "transfer_obstacle_tower.md").read_text()
    assert f"| {OTHER} | pure planning | 100% |" in page
