# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The bridge at a bench: commands that replace one another, on the robot in MuJoCo."""

from contextlib import ExitStack, contextmanager

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from slap_msgs.msg import RobotCommand
from slap_msgs.srv import ResetTask
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from ensemble.client import RunClient
from ensemble.interfaces import COMMAND, FAULT, RESET_TASK, VOLATILE
from ensemble.launcher import InProcessLauncher
from ensemble.nodes import RunSettings, node_parameters
from ensemble.robot_parameters import arm_joints
from ensemble.run import RunRequest, run
from ensemble.spinner import temporary_node
from slap_ros.bags import evaluate_bag, read_bag
from slap_ros.bags.recording import Recording
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode
from slap_ros.messages.decode import decode_state
from slap_ros.messages.interfaces import STATE
from slap_ros.skills.domain_choice import DEMONSTRATOR, DomainChoice
from slap_ros.worlds.contact.features import ROBOT
from support.bench import Bench
from support.slap_command import slap

pytest.importorskip("pybullet")
pytest.importorskip("mujoco")

DOMAIN = "stack_at_target"
TOPIC = "panda_arm_controller/joint_trajectory"
# All nodes share this process and a loaded machine's time.
PATIENT = {"joint_timeout": 60.0, "detection_timeout": 60.0}
SLOW = {"pace": 0.5}
SCRIPTS = DomainChoice(DOMAIN, "fair", DEMONSTRATOR)
AHEAD = [0.02, 0.0, 0.0, 0.0]  # m, m, m, rad


def settings(robot=None, bridge=None, record=None, choice=SCRIPTS, **options):
    return RunSettings(
        choice,
        300,
        0,
        "lazy",
        record,
        patience=5.0,
        world="mujoco",
        servo=True,
        mujoco=SLOW | (robot or {}),
        bridge=PATIENT | (bridge or {}),
        **options,
    )


class ServoLab(Bench):
    """A client, the bridge and the robot, on one executor."""

    def __init__(self, client, spinner, heard):
        super().__init__(client, spinner)
        self.heard, self.types = heard, get_domain(DOMAIN).types_by_name
        self.health = {}
        self.commands = client.create_publisher(COMMAND.type, COMMAND.name, COMMAND.qos)
        self.arm = client.create_publisher(JointTrajectory, TOPIC, VOLATILE)
        client.create_subscription(DiagnosticArray, "/diagnostics", self._hear, 10)

    def _hear(self, message):
        for status in message.status:
            values = {item.key: item.value for item in status.values}
            self.health[status.name.removeprefix("/")] = values

    @property
    def states(self):
        return [m for kind, m in self.heard if kind == STATE]

    @property
    def faults(self):
        return [m for kind, m in self.heard if kind == FAULT.type_name]

    def hand(self, feature):
        """A feature of the robot in the newest state."""
        state = decode_state(self.states[-1], self.types)
        (robot,) = state.layout.of_type(ROBOT)
        return float(state.get(robot, feature))

    def step(self, deltas, gripper=0.0):
        seen, now = len(self.states), self.states[-1]
        self.commands.publish(
            RobotCommand(episode=now.episode, step=now.step, deltas=deltas, gripper=gripper)
        )
        self.until(lambda: len(self.states) > seen)


@contextmanager
def lab(robot=None, bridge=None, beside=""):
    nodes = node_parameters(settings(robot, bridge))
    only = {name: nodes[name] for name in ("robot_bridge.mujoco", "robot_bridge.servo")}
    heard = []
    with (
        temporary_node(lambda: RunClient(lambda *message: heard.append(message), (FAULT,))) as (
            client,
            spinner,
        ),
        ExitStack() as stack,
    ):
        if beside:
            stack.callback(rclpy.create_node(beside).destroy_node)
        stack.enter_context(InProcessLauncher(only, spinner.executor))
        yield ServoLab(client, spinner, heard)


def test_each_command_is_answered_while_the_arm_moves(network):
    with lab() as bench:
        bench.until(lambda: bench.states)
        began, ahead = bench.hand("x"), bench.hand("target_x")
        assert ahead == pytest.approx(began, abs=1e-4)
        for _ in range(4):
            bench.step(AHEAD, gripper=1.0)
        assert [state.step for state in bench.states] == list(range(5))
        assert bench.hand("vx") > 0.05  # m/s: it is on its way
        assert began + 0.01 < bench.hand("x") < bench.hand("target_x")
        assert bench.hand("left_finger_velocity") < -0.02  # m/s: fingers close meanwhile
        assert bench.hand("gripper") == 1.0
        bench.until(lambda: bench.health.get("servo_bridge", {}).get("holding") == "True")
        counts = bench.health["mujoco_robot"]
        bench.until(lambda: bench.health["mujoco_robot"] is not counts)
        assert int(bench.health["mujoco_robot"]["refused"]) == 0
        seen = len(bench.states)
        bench.spinner.spin_until(lambda: False, 0.5)
        assert len(bench.states) == seen  # without a command there is no state
        for _ in range(12):
            bench.step([0.0] * 4)
        assert abs(bench.hand("vx")) < 0.01
        assert bench.hand("x") == pytest.approx(bench.hand("target_x"), abs=2e-3)
        reset = bench.call(RESET_TASK, ResetTask.Request())
        assert reset.error_code == ErrorCode.NONE, reset.error_msg
        bench.until(lambda: bench.states[-1].episode == 2)
        assert bench.hand("target_x") == pytest.approx(bench.hand("x"), abs=1e-4)


def test_what_the_controller_of_the_topic_cannot_follow_moves_nothing(network):
    with lab() as bench:
        bench.until(lambda: bench.states and bench.arm.get_subscription_count())
        before = bench.hand("x")
        point = JointTrajectoryPoint(positions=[0.0] * 6)
        bench.arm.publish(JointTrajectory(joint_names=arm_joints("panda")[:6], points=[point]))
        bench.until(lambda: bench.health.get("mujoco_robot", {}).get("refused") == "1")
        bench.step([0.0] * 4)
        assert bench.hand("x") == pytest.approx(before, abs=1e-3)


def test_what_is_not_detected_is_named_and_nothing_begins(network):
    with lab({"hidden": "cube1"}, {"detection_timeout": 1.0}) as bench:
        bench.until(lambda: bench.faults)
        fault = bench.faults[0]
        assert fault.error_code == ErrorCode.NO_DETECTION
        assert "cube1" in fault.error_msg and "cube0" not in fault.error_msg
        assert not bench.states


@pytest.mark.slow
@pytest.mark.timeout(600)  # 10 s of the robot's time, in the same process as everything else
def test_the_ensemble_opens_a_drawer_and_grasps_a_hammer_at_a_bench(network, tmp_path):
    """How far the drawer is open, nodes know by detections of its front alone."""
    goal = "(and (IsCabinetOpen cabinet1) (Holding hammer1))"
    choice = DomainChoice("stow_hammer", "fair:hand=panda", DEMONSTRATOR)
    chosen = settings(record=tmp_path / "bag", choice=choice, goal=goal)
    metrics = run(RunRequest(chosen, timeout_s=500, in_process=True), lambda *_: None)
    assert metrics.success, metrics.error_msg
    assert metrics.options[0].name == "Open"
    assert {option.name for option in metrics.options} == {"Open", "Pick"}
    assert evaluate_bag(tmp_path / "bag").runs[0].plan_length == metrics.plan_length
    (episode,) = Recording.of(read_bag(tmp_path / "bag")).episodes.values()
    types = get_domain("stow_hammer").types_by_name
    states = [decode_state(state, types) for state in episode.states.values()]
    cabinet = states[0].layout.object("cabinet1")
    openings = [float(state.get(cabinet, "opening")) for state in states]
    assert openings[0] < 1e-3 and openings[-1] > 0.1


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        ([DOMAIN, "--scene", "my.yaml"], ErrorCode.INVALID_SCENE, "my.yaml cannot be read"),
        ([DOMAIN, "--mujoco", "camera=true"], ErrorCode.INVALID_PARAMETER, "camera needs tags"),
        ([DOMAIN, "--robot", "speed=0.1"], ErrorCode.INVALID_PARAMETER, "speed"),
        ([DOMAIN, "--mujoco", "stiffness=0"], ErrorCode.INVALID_PARAMETER, "stiffness"),
    ],
)
def test_what_a_run_at_a_bench_cannot_have_is_refused_before_it_begins(arguments, code, said):
    done = slap("run", *arguments, "--world", "mujoco", "--skills", DEMONSTRATOR)
    assert done.exit_code == code
    assert said in " ".join(done.stderr.split())


def test_beside_another_bridge_nothing_begins(network):
    with lab(bridge={"detection_timeout": 1.0}, beside="robot_bridge") as bench:
        bench.until(lambda: bench.faults)
        assert bench.faults[0].error_code == ErrorCode.ALREADY_RUNNING
        assert "another robot_bridge" in bench.faults[0].error_msg
        assert not bench.states
