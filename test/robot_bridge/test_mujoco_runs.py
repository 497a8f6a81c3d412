# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ensemble in front of a robot in MuJoCo."""

import pytest

from ensemble.nodes import RunSettings
from ensemble.run import RunRequest, run
from slap_ros.bags import evaluate_bag
from slap_ros.errors import ErrorCode
from slap_ros.skills.domain_choice import DomainChoice

pytest.importorskip("mujoco")

# All nodes share this process and a loaded machine's time.
PATIENT = {"joint_timeout": 60.0, "controller_timeout": 60.0, "detection_timeout": 60.0}
QUICK = {"pace": 5.0, "rate": 100.0}
GOAL = "(Holding robot block4)"  # the top block: 15 steps


@pytest.mark.slow
@pytest.mark.timeout(600)  # 8 s of the robot's time, in the same process as everything else
def test_the_ensemble_grasps_a_block_on_a_robot_in_mujoco(network, tmp_path):
    chosen = RunSettings(
        DomainChoice("obstacle_tower", "fair"),
        1,
        0,
        "lazy",
        tmp_path / "bag",
        goal=GOAL,
        patience=5.0,
        world="mujoco",
        shortcuts="none",
        mujoco=QUICK,
        bridge=PATIENT,
    )
    metrics = run(RunRequest(chosen, timeout_s=500, in_process=True), lambda *_: None)
    assert metrics.success, metrics.error_msg
    assert metrics.error_code == ErrorCode.NONE
    found = evaluate_bag(tmp_path / "bag")
    assert found.runs[0].plan_length == metrics.plan_length
