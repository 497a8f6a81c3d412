# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans executed by camera: what counts as solved, and what is said of the rest."""

import json
import sys

import pytest

from slap_ros.errors import ErrorCode
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.comparison import PlanningSetup
from slap_ros.studies.slap.camera import SEEN, solve_by_camera
from support.slap_command import slap

pytest.importorskip("pybullet")
pytest.importorskip("mujoco")
pytest.importorskip("pupil_apriltags")

# A block on the table and a free target: the shortest plans that there are.
SMALL = ["--preset", "fair:obstacles=0,distractors=0", "--tasks", "1", "--seeds", "1"]
SMALL += ["--first-seed", "1", "--samples", "1"]


def study(output):
    return slap("study", "camera", "obstacle_tower", "--output", output, *SMALL)


@pytest.mark.parametrize("obstacles, code", [(1, ErrorCode.NO_DETECTION), (0, ErrorCode.NONE)])
def test_a_block_that_no_picture_shows_matters_only_to_a_task_about_it(obstacles, code):
    """Without obstacles, another block is to be placed than the one that stands behind others."""
    choice = DomainChoice("obstacle_tower", f"fair:obstacles={obstacles},distractors=4")
    setup = PlanningSetup(choice, "lazy", PURE_PLANNING)
    trial = solve_by_camera(setup, 306, 0)
    assert trial.error_code == code, trial.reason
    assert trial.success == (code is ErrorCode.NONE)
    assert ("about what no picture has shown yet: block1" in trial.reason) != trial.success


def test_without_the_extra_for_tags_nothing_is_solved(monkeypatch, tmp_path):
    monkeypatch.setattr("slap_ros.vision.installed.LIBRARIES", ("no_such_library",))
    done = study(tmp_path)
    assert done.exit_code == ErrorCode.INVALID_PARAMETER
    assert "slap_ros[camera]" in " ".join(done.stderr.split())
    monkeypatch.setitem(sys.modules, "mujoco", None)
    assert "slap_ros[mujoco]" in " ".join(study(tmp_path).stderr.split())
    assert not list(tmp_path.iterdir())


@pytest.mark.slow  # solves a task twice by camera, which takes a picture a second
@pytest.mark.timeout(400)
def test_a_task_is_solved_by_what_a_camera_sees(tmp_path):
    done = study(tmp_path)
    assert done.exit_code == 0, done.stderr
    data = json.loads((tmp_path / "camera_obstacle_tower.json").read_text())["found"]
    for approach in data[SEEN]:
        (trial,) = approach["trials"]
        assert (trial["seed"], trial["index"]) == (1, 0)
    assert data[SEEN][0]["success_rate"] == 1.0
    assert (
        f"| {SEEN} | pure planning | 100% |" in (tmp_path / "camera_obstacle_tower.md").read_text()
    )
