# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ensemble on a world with contact forces, whose skills are the demonstrator's scripts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pybullet")  # Bullet is an extra: without it there is nothing to test here

from builtin_interfaces.msg import Time
from visualization_msgs.msg import Marker

from ensemble.encode import SCENE
from ensemble.nodes import RunSettings, node_parameters
from ensemble.run import RunRequest, run
from slap_ros.bags import bag_info, evaluate_bag, replay_bag
from slap_ros.bags.reader import read_bag
from slap_ros.bags.recording import Recording
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode, OpenLoopOnlyError, UnsafeCommandError
from slap_ros.report import read_report, render
from slap_ros.robot.dry_run import DryRun
from slap_ros.robot.gripper import GripperAction
from slap_ros.robot.limits import Workspace, arm_limits
from slap_ros.robot.recorded_motion import read_recorded_motion
from slap_ros.robot.robot_world import RobotWorld
from slap_ros.robot.scene_config import sampled_scene_config
from slap_ros.skills.domain_choice import DEMONSTRATOR, DomainChoice, open_domain
from slap_ros.worlds.panda import grasp_pose
from support.bench import solved_by
from support.slap_command import slap

pytestmark = pytest.mark.timeout(180)  # runs in worlds with contact forces
DOMAIN, SEED = "stack_at_target", 0
TABLE_AT_BASE = Workspace((0.2, -0.5, 0.0), (0.8, 0.5, 0.9))
STAMP = Time(sec=1, nanosec=2)
LIMIT_S = 200.0  # far more than anything here takes


def settings(record: Path | None = None, **options: object) -> RunSettings:
    return RunSettings(
        DomainChoice(DOMAIN, "fair", DEMONSTRATOR), SEED, 0, "lazy", record, patience=5.0, **options
    )


def solved(record: Path, **options: object) -> object:
    asked = RunRequest(
        settings(record, **options), timeout_s=LIMIT_S, in_process=True, max_replans=10
    )
    metrics = run(asked, lambda *_: None)
    assert metrics.success, metrics.error_msg
    return metrics


def test_a_goal_by_name_has_its_objects_in_the_world(network, tmp_path):
    """What this seed's first task lacks: the world is in the first task that has it."""
    domain = get_domain("groceries")
    assert "cereal" not in domain.task(1).initial_state.layout.by_name
    goal = ["--goal", "task3", "--seed", "1", "--record", str(tmp_path / "bag"), "--in-process"]
    goal += ["--patience", "10"]  # for a loaded machine
    ran = slap("run", "groceries", "--skills", "demonstrator", *goal)
    assert ran.exit_code == 0, ran.output
    (episode,) = Recording.of(read_bag(tmp_path / "bag")).episodes.values()
    assert {obj.name for obj in episode.states[0].objects} >= {"cereal", "basket"}
    assert [str(atom.predicate) for atom in episode.task.goal] == ["In"]


def test_a_run_is_recorded_evaluated_replayed_and_reported(network, tmp_path):
    live = solved(tmp_path / "bag")
    assert [option.name for option in live.options] == ["Pick", "Place"] * 2

    found = evaluate_bag(tmp_path / "bag")
    assert found.runs == [live]
    assert found.compared == found.states == live.plan_length + 1
    assert not found.mismatches
    again = replay_bag(tmp_path / "bag")
    assert (again.compared, again.different, again.unreached) == (found.states, 0, 0)

    # The bag names the skills, so what opens it has the operators that were planned with.
    assert bag_info(tmp_path / "bag").metadata["configuration.skills"] == DEMONSTRATOR
    recorded = Recording.of(read_bag(tmp_path / "bag")).domain()
    assert recorded.operators == open_domain(DomainChoice(DOMAIN, "fair", DEMONSTRATOR)).operators
    assert not get_domain(DOMAIN).operators

    page = render([read_report(tmp_path / "bag")])
    assert f"solved in {live.plan_length} steps" in page
    _check_dry_run(tmp_path / "bag", live.plan_length)


def _check_dry_run(bag: Path, steps: int) -> None:
    """The recording is a motion that an arm can execute where its workspace reaches the table."""
    recorded = read_recorded_motion(bag)
    acting = [w.gripper for w in recorded.waypoints if w.gripper is not GripperAction.KEEP]
    assert acting == [GripperAction.CLOSE, GripperAction.OPEN] * 2
    closing = [w for w in recorded.waypoints if w.gripper is GripperAction.CLOSE]
    assert all(w.gap == pytest.approx(0.04, abs=0.002) for w in closing)  # the cubes' edge
    checked = DryRun.of(
        recorded, recorded.limits_of(arm_limits("panda").scaled(0.5, TABLE_AT_BASE))
    )
    checked.require_safe()
    assert len(checked.motions) == steps
    ends = np.array([motion.target for motion in checked.motions])
    starts = np.array([motion.start for motion in checked.motions])
    assert np.array_equal(starts[1:], ends[:-1])
    off_table = DryRun.of(
        recorded, recorded.limits_of(arm_limits("panda").scaled(0.5, Workspace()))
    )
    with pytest.raises(UnsafeCommandError, match="outside the workspace"):
        off_table.require_safe()


@pytest.mark.slow
def test_with_noise_things_that_rest_are_seen_at_rest(network, tmp_path):
    """No perceived state is one that the planner's world refuses; the replay is exact."""
    noise = {"position_noise": 0.002, "turn_noise": 0.01, "debounce": 3, "noise_seed": 1}
    live = solved(tmp_path / "bag", perception=noise)
    assert evaluate_bag(tmp_path / "bag").runs == [live]
    assert evaluate_bag(tmp_path / "bag").compared == 0  # noise cannot be found again
    assert replay_bag(tmp_path / "bag").identical


@pytest.mark.slow
def test_nodes_that_were_given_other_skills_refuse_each_other(network):
    nodes = {name: dict(given) for name, given in node_parameters(settings()).items()}
    # s, for it will see no state
    nodes["planner_node"] |= {"skills": "none", "observation_timeout": 2.0}
    result = solved_by(nodes)
    assert result.error_code == ErrorCode.SKILLS_CHANGED
    assert "skills demonstrator" in result.error_msg and "given none" in result.error_msg


def test_nodes_without_skills_of_their_own_take_those_that_are_announced(network, tmp_path):
    nodes = {name: dict(given) for name, given in node_parameters(settings()).items()}
    for name in ("perception_node", "skill_server", "planner_node"):
        nodes[name] |= {"skills": "", "domain": ""}
    assert solved_by(nodes).success


@pytest.mark.parametrize("world", ["robot", "mock"])
def test_a_robot_in_closed_loop_is_refused_with_a_code_of_its_own(world):
    arguments = ["run", DOMAIN, "--skills", DEMONSTRATOR, "--world", world]
    refused = slap(*arguments)
    assert refused.exit_code == ErrorCode.OPEN_LOOP_ONLY
    assert "which nothing measures" in " ".join(refused.stderr.split())
    domain = get_domain(DOMAIN)
    scene = sampled_scene_config(domain.task(SEED).initial_state)
    with pytest.raises(OpenLoopOnlyError, match="--to robot --dry-run"):
        RobotWorld(domain, scene, arm_limits("panda"))


def test_skills_that_there_are_not_are_refused():
    refused = slap("run", DOMAIN, "--skills", "best")
    assert refused.exit_code == ErrorCode.INVALID_PARAMETER
    refused = slap("run", "obstacle2d", "--skills", DEMONSTRATOR)
    assert refused.exit_code == ErrorCode.INVALID_PARAMETER
    assert "has no demonstrator" in " ".join(refused.stderr.split())


def test_what_is_at_a_bench_is_shown_part_by_part():
    domain = get_domain("stow_hammer")
    state = domain.task(0).initial_state
    bodies, poses = domain.display.bodies(state), domain.display.frames(state)
    shown = SCENE.markers(bodies, STAMP).markers
    kinds = {marker.text: marker.type for marker in shown}
    things = {obj.name for obj in state.objects} - {"robot"}
    assert things <= set(kinds) == set(poses)
    assert {Marker.CUBE, Marker.TRIANGLE_LIST} == {marker.type for marker in shown}
    assert "floor" not in kinds

    framed = {t.child_frame_id: t.transform for t in SCENE.frames(poses, STAMP).transforms}
    hammer = state.layout.object("hammer0")
    translation = framed["hammer0"].translation
    assert [translation.x, translation.y, translation.z] == state[hammer][:3].tolist()
    cabinet = state.layout.object("cabinet0")
    pulled = state.replace({(cabinet, "opening"): 0.1})
    before, after = poses["cabinet0_moving"], domain.display.frames(pulled)["cabinet0_moving"]
    way = np.subtract(after.position, before.position)
    assert np.linalg.norm(way) == pytest.approx(0.1)
    assert domain.display.frames(pulled)["cabinet0"] == poses["cabinet0"]

    joints = SCENE.joint_state(state, STAMP).position
    hand = {body.name: body for body in domain.display.arm(state)}["panda_hand"]
    assert hand.position[:2] == pytest.approx(grasp_pose(joints).position[:2], abs=0.02)
