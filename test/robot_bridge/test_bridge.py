# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The whole ensemble on a simulated robot; whatever goes wrong there leaves the robot holding.

What may depend on the robot is tried on the mock robot and on the one in MuJoCo.
"""

from contextlib import contextmanager
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import JointState
from slap_msgs.msg import RobotCommand
from slap_msgs.srv import ResetTask
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from ensemble.cli.run_options import RunOptions
from ensemble.client import RunClient
from ensemble.interfaces import COMMAND, FAULT, JOINT_STATES, RESET_TASK, SENSOR_DATA, TF
from ensemble.launcher import InProcessLauncher, ProcessLauncher
from ensemble.nodes import RunSettings, node_parameters
from ensemble.robot_parameters import parse_mock_robot
from ensemble.run import RunRequest, run
from ensemble.spinner import temporary_node
from slap_ros.bags import evaluate_bag, read_bag, replay_bag
from slap_ros.errors import ErrorCode, InvalidParameterError, SlapError
from slap_ros.messages.interfaces import STATE
from slap_ros.skills.domain_choice import DomainChoice
from support.clocks import BY_THE_CLOCK, SettableClock
from support.marks import slow

SMALL = "fair:obstacles=1,distractors=0"  # of few abstract states
IMPOSSIBLE = "(and (Holding robot block1) (GripperEmpty robot))"
LIMIT = 120.0  # s, far more than anything here takes: a loaded machine takes its time
# All nodes share this process and a loaded machine's time: joint positions may be late.
PATIENT = {"joint_timeout": 60.0, "controller_timeout": 60.0, "detection_timeout": 60.0}
QUICK = {"pace": 20.0, "rate": 200.0, "latency": 0.01}
# Where every object is seen to stand: one that seems to tip has to be measured, or moves away.
EXACT = {"pose_noise": 0.0, "turn_noise": 0.0}
STILL = [0.0] * 7
STANDS = {"mock": 1e-6, "mujoco": 5e-3}  # rad, by which an arm that stands is off its command
MUJOCO = pytest.param(
    "mujoco", marks=pytest.mark.skipif(find_spec("mujoco") is None, reason="needs MuJoCo")
)
on_both_robots = pytest.mark.parametrize("world", ["mock", MUJOCO])


def settings(robot=None, bridge=None, record=None, world="mock", **options):
    options = {"shortcuts": "none", "world": world, world: QUICK | (robot or {})} | options
    return RunSettings(
        DomainChoice("obstacle_tower", "fair"),
        1,
        0,
        "lazy",
        record,
        patience=5.0,
        bridge=bridge or {},
        **options,
    )


class Lab:
    """A client, the bridge and a simulated robot, on one executor."""

    def __init__(self, client, spinner, heard, stands):
        self.client, self.spinner, self.heard = client, spinner, heard
        self.stands = stands  # rad
        self.joints, self.health = [], {}
        self.commands = client.create_publisher(COMMAND.type, COMMAND.name, COMMAND.qos)
        client.create_subscription(
            JointState,
            JOINT_STATES.name,
            lambda m: self.joints.append(list(m.position)),
            SENSOR_DATA,
        )
        client.create_subscription(DiagnosticArray, "/diagnostics", self.on_health, 10)

    def on_health(self, message):
        for status in message.status:
            if status.name == "/robot_bridge":
                self.health = {item.key: item.value for item in status.values}

    @property
    def states(self):
        return [m for kind, m in self.heard if kind == STATE]

    @property
    def faults(self):
        return [m for kind, m in self.heard if kind == FAULT.type_name]

    def until(self, condition):
        assert self.spinner.spin_until(condition, LIMIT)

    def wait(self, seconds):
        self.spinner.spin_until(lambda: False, seconds)

    def command(self, deltas=STILL, gripper=0.0, **moment):
        now = {"episode": self.states[-1].episode, "step": self.states[-1].step} | moment
        self.commands.publish(RobotCommand(deltas=deltas, gripper=gripper, **now))

    def step(self, **command):
        seen = len(self.states)
        self.command(**command)
        self.until(lambda: len(self.states) > seen)

    def fault(self, code):
        """Wait until the bridge holds for this reason; it then stands."""
        self.until(lambda: self.health.get("fault") == code.name and self.faults)
        assert self.health["holding"] == "True"
        (said,) = self.faults
        assert (said.error_code, said.episode) == (code, self.states[-1].episode)
        states, joints = len(self.states), self.joints[-1][:7]
        self.command(deltas=[0.02, *STILL[1:]])
        self.wait(0.5)
        assert len(self.states) == states
        assert self.joints[-1][:7] == pytest.approx(joints, abs=self.stands)

    def reset(self, **request):
        service = self.client.create_client(RESET_TASK.type, RESET_TASK.name)
        self.until(service.service_is_ready)
        answer = service.call_async(ResetTask.Request(**request))
        self.until(answer.done)
        return answer.result()


@contextmanager
def lab(robot=None, bridge=None, started=True, world="mock"):
    nodes = node_parameters(settings(robot, PATIENT | (bridge or {}), world=world))
    only = {name: nodes[name] for name in (f"robot_bridge.{world}", "robot_bridge")}
    heard = []
    with (
        temporary_node(lambda: RunClient(lambda *message: heard.append(message), (FAULT,))) as (
            client,
            spinner,
        ),
        InProcessLauncher(only, spinner.executor),
    ):
        bench = Lab(client, spinner, heard, STANDS[world])
        if started:
            bench.until(lambda: bench.states and bench.commands.get_subscription_count())
        yield bench


@pytest.mark.slow
@pytest.mark.timeout(700)
def test_the_ensemble_solves_a_task_on_a_mock_robot(network, tmp_path):
    bag = tmp_path / "bag"
    chosen = settings(bridge=PATIENT, record=bag)
    metrics = run(RunRequest(chosen, timeout_s=600, in_process=True), lambda *_: None)
    assert metrics.success, metrics.error_msg
    assert metrics.error_code == ErrorCode.NONE  # the bag is closed, though joint states never stop
    assert metrics.plan_length > 60
    joints = [item for item in read_bag(bag) if item.topic == "/joint_states"]
    assert len(joints) > metrics.plan_length
    found = evaluate_bag(bag)
    assert found.runs[0].plan_length == metrics.plan_length
    assert found.states == metrics.plan_length + 1


def test_where_there_is_no_plan_the_robot_looks_again_as_often_as_it_may_replan(network, tmp_path):
    bag, small = tmp_path / "bag", DomainChoice("obstacle_tower", SMALL)
    chosen = replace(settings(bridge=PATIENT, record=bag, goal=IMPOSSIBLE), domain=small)
    request = RunRequest(chosen, timeout_s=LIMIT, max_replans=2, in_process=True)
    metrics = run(request, lambda *_: None)
    assert metrics.error_code == ErrorCode.REPLANS_EXHAUSTED
    assert "diverged again after 2 replans: " in metrics.error_msg
    assert (metrics.replans, metrics.plan_length) == (2, 2)  # a step for each look
    with pytest.raises(InvalidParameterError, match="its states are measured"):
        replay_bag(bag)


@on_both_robots
def test_commands_are_answered_one_by_one_and_bad_ones_move_nothing(network, world):
    with lab(world=world) as bench:
        bench.until(lambda: bench.joints)
        before = bench.joints[-1][:7]
        refused = [
            {"step": 7},
            {"episode": 9},
            {"deltas": [float("nan"), *STILL[1:]]},
            {"deltas": [0.5, *STILL[1:]]},
            {"deltas": [0.0]},
            {"gripper": float("inf")},
        ]
        for command in refused:
            bench.command(**command)
        bench.wait(0.5)
        assert len(bench.states) == 1
        assert bench.joints[-1][:7] == pytest.approx(before, abs=bench.stands)
        bench.command(deltas=[0.05, *STILL[1:]])
        bench.command(deltas=[0.05, *STILL[1:]])  # the same one again
        bench.until(lambda: len(bench.states) == 2)
        bench.wait(0.5)
        assert [state.step for state in bench.states] == [0, 1]
        bench.until(
            lambda: bench.joints[-1][0] == pytest.approx(before[0] + 0.05, abs=bench.stands)
        )
        bench.until(lambda: bench.health.get("steps") == "1")
        assert bench.health["stale_commands"] == "3"
        assert bench.health["invalid_commands"] == "4"
        bench.until(lambda: bench.health["holding"] == "True")  # nobody commands anything


def test_what_leaves_the_workspace_is_refused(network):
    with lab(bridge={"workspace": [0.2, -0.5, 0.499, 0.8, 0.5, 0.9]}) as bench:
        bench.command(deltas=[0.0, 0.05, *STILL[2:]])
        bench.until(lambda: bench.health.get("unsafe_commands") == "1")
        assert len(bench.states) == 1
        bench.step()  # it goes on


@pytest.mark.parametrize(
    ("fault", "code"),
    [
        ("reject", ErrorCode.CONTROLLER_REJECTED),
        ("abort", ErrorCode.CONTROLLER_ABORTED),
        ("ignore", ErrorCode.CONTROLLER_TIMEOUT),
    ],
)
def test_a_controller_that_fails_leaves_the_robot_holding(network, fault, code):
    quickly = {"controller_timeout": 2.0} if fault == "ignore" else {}
    done = 0 if fault == "ignore" else 1  # a loaded machine may take longer than that for a step
    with lab({"fault": fault, "fault_after": done}, quickly) as bench:
        if done:
            bench.step(deltas=[0.05, *STILL[1:]])
        bench.command(deltas=[0.05, *STILL[1:]])
        bench.fault(code)


@pytest.mark.slow  # a node in a process of its own
def test_a_second_bridge_does_not_begin_beside_the_first(network):
    nodes = node_parameters(settings(None, PATIENT))
    with lab() as bench, ProcessLauncher({"robot_bridge": nodes["robot_bridge"]}):
        bench.until(lambda: bench.faults)
        assert bench.faults[0].error_code == ErrorCode.ALREADY_RUNNING
        bench.step(deltas=[0.05, *STILL[1:]])
        assert [(state.episode, state.step) for state in bench.states] == [(1, 0), (1, 1)]


def test_an_arm_that_stands_though_its_controller_says_otherwise_is_noticed(network):
    with lab(EXACT | {"fault": "stand", "fault_after": 1}) as bench:
        for _ in range(3):  # the first one moves it
            bench.step(deltas=[0.05, *STILL[1:]])
        bench.step()  # nothing is asked for, so that nothing is told
        bench.command(deltas=[0.05, *STILL[1:]])
        bench.fault(ErrorCode.CONTROLLER_ABORTED)
        assert "stood through 3 motions" in bench.faults[0].error_msg


def test_a_horizon_of_commands_is_one_motion_that_begins_with_the_last(network):
    with lab(EXACT, bridge={"horizon": 3, "hold_after": 60.0}) as bench:
        bench.until(lambda: bench.joints)
        before = bench.joints[-1][0]
        for number in (1, 2):
            bench.step(deltas=[0.04, *STILL[1:]])
            assert bench.states[-1].step == number
            assert bench.states[-1].objects[0].features[0] == pytest.approx(before + 0.04 * number)
            bench.wait(0.3)
            assert bench.joints[-1][0] == before
        bench.step(deltas=[0.04, *STILL[1:]])
        assert bench.states[-1].step == 3
        bench.until(lambda: bench.joints[-1][0] == pytest.approx(before + 0.12, abs=1e-6))
        assert max(joints[0] for joints in bench.joints) <= before + 0.12 + 1e-6
        bench.until(lambda: bench.health.get("steps") == "3")
        assert bench.health["stale_commands"] == "0"


def test_what_was_commanded_is_executed_when_nothing_more_is(network):
    with lab(bridge={"horizon": 4}) as bench:
        bench.until(lambda: bench.joints)
        before = bench.joints[-1][0]
        bench.step(deltas=[0.04, *STILL[1:]])
        bench.until(lambda: bench.joints[-1][0] == pytest.approx(before + 0.04, abs=1e-6))
        for _ in range(4):  # whenever they come: it may be measuring
            bench.step(deltas=[0.04, *STILL[1:]])
        bench.until(lambda: bench.joints[-1][0] == pytest.approx(before + 0.2, abs=1e-3))
        assert [state.step for state in bench.states] == [0, 1, 2, 3, 4, 5]
        bench.until(lambda: bench.health.get("steps") == "5")
        assert bench.health["stale_commands"] == "0"


def test_a_reset_forgets_commands_that_have_not_been_executed(network):
    with lab(EXACT, bridge={"horizon": 3, "hold_after": 60.0}) as bench:
        bench.until(lambda: bench.joints)
        before = bench.joints[-1][0]
        bench.step(deltas=[0.04, *STILL[1:]])
        bench.until(lambda: bench.reset().error_code == 0)
        bench.until(lambda: bench.states[-1].episode == 2)
        for _ in range(3):
            bench.step(deltas=[0.02, *STILL[1:]])
        bench.until(lambda: bench.joints[-1][0] == pytest.approx(before + 0.06, abs=1e-3))


@pytest.mark.parametrize(
    ("preset", "goal"), [("fair", "(Holding robot block4)"), *slow((SMALL, ""))]
)
def test_the_ensemble_solves_a_task_by_horizons(network, tmp_path, preset, goal):
    bag, domain = tmp_path / "bag", DomainChoice("obstacle_tower", preset)
    chosen = settings(EXACT, PATIENT | {"horizon": 3}, bag, goal=goal)  # no plan diverges
    chosen = replace(chosen, domain=domain)
    metrics = run(RunRequest(chosen, timeout_s=600, in_process=True), lambda *_: None)
    assert metrics.success, metrics.error_msg
    assert metrics.replans == 0
    found = evaluate_bag(bag)
    assert found.states == metrics.plan_length + 1


def test_a_task_is_solved_without_what_no_picture_shows(network, tmp_path):
    bag = tmp_path / "bag"
    robot, bridge = {"hidden": "block5"}, PATIENT | {"hidden_after": 5}
    chosen = settings(robot, bridge, bag, goal="(Holding robot block4)")
    metrics = run(RunRequest(chosen, timeout_s=600, in_process=True), lambda *_: None)
    assert metrics.success, metrics.error_msg
    states = [item.message for item in read_bag(bag) if item.type_name == STATE]
    assert states
    assert not any(obj.name == "block5" for message in states for obj in message.objects)
    assert evaluate_bag(bag).states == metrics.plan_length + 1


@pytest.mark.parametrize(
    ("hidden", "bridge", "why"),
    [
        ("block4", {"hidden_after": 5}, "about what no picture has shown yet: block4"),
        ("block2", {"detection_timeout": 2.0}, "block2; others are seen"),
    ],
)
def test_a_task_that_cannot_begin_fails_with_what_is_missing(network, hidden, bridge, why):
    chosen = settings({"hidden": hidden}, PATIENT | bridge, goal="(Holding robot block4)")
    impatient = replace(chosen, patience=0.5)
    with pytest.raises(SlapError, match=why) as failed:
        run(RunRequest(impatient, timeout_s=600, in_process=True), lambda *_: None)
    assert failed.value.code == ErrorCode.NO_DETECTION


def test_controllers_that_nobody_offers_are_named(network, capfd):
    chosen = node_parameters(settings(bridge={"arm": "fr3", "detection_timeout": 0.1}))
    said = []

    def named():
        said.append(capfd.readouterr().err)
        return "no controller offers fr3_arm_controller/follow_joint_trajectory" in "".join(said)

    with (
        temporary_node(lambda: RunClient(lambda *_: None)) as (_, spinner),
        InProcessLauncher({"robot_bridge": chosen["robot_bridge"]}, spinner.executor),
    ):
        assert spinner.spin_until(named, 60.0)


@on_both_robots
def test_an_object_that_is_never_seen_is_named(network, world):
    with lab({"hidden": "block2"}, started=False, world=world) as bench:
        answers = []

        def the_others_are_seen():
            answers.append(bench.reset())
            return ": block2; others are seen" in answers[-1].error_msg

        bench.until(the_others_are_seen)
        assert answers[-1].error_code == ErrorCode.NO_DETECTION
        assert not bench.states


@pytest.mark.slow
def test_sensors_that_fall_silent_stop_the_state(network):
    """The mock robot is taken away: joint positions, detections and controllers with it."""
    with lab(bridge={"joint_timeout": 5.0}) as bench:
        bench.step()
        (mock,) = [n for n in bench.spinner.executor.get_nodes() if n.get_name() == "mock_robot"]
        for timer in list(mock.timers):
            mock.destroy_timer(timer)
        bench.wait(6.0)
        bench.until(lambda: bench.health.get("fault") == "NONE")  # it stands anyway
        bench.command(deltas=[0.02, *STILL[1:]])
        bench.until(lambda: bench.health.get("fault") == "NO_JOINT_STATE")
        assert len(bench.states) == 2


@on_both_robots
def test_detections_that_are_lost_late_or_out_of_order_do_no_harm(network, world):
    with lab({"dropout": 0.3, "jitter": 0.05, "pose_noise": 0.003}, world=world) as bench:
        for _ in range(5):
            bench.step(deltas=[0.02, *STILL[1:]])
        bench.until(lambda: int(bench.health.get("refused_measurements", 0)) > 0)
        heights = [state.objects[1].features[2] for state in bench.states]
        assert max(heights) == min(heights)


def test_poses_that_are_none_are_refused_and_counted(network):
    with lab() as bench:
        publisher = bench.client.create_publisher(TF.type, TF.name, TF.qos)
        bench.until(lambda: publisher.get_subscription_count() >= 1)
        item = TransformStamped(
            header=Header(stamp=bench.client.get_clock().now().to_msg(), frame_id="panda_link0"),
            child_frame_id="detected_block1",
        )
        item.transform.translation.x = float("nan")
        publisher.publish(TFMessage(transforms=[item]))
        bench.until(lambda: int(bench.health.get("refused_measurements", 0)) > 0)
        bench.step()
        assert bench.states[-1].objects[1].features == bench.states[0].objects[1].features


ARM = [f"panda_joint{i + 1}" for i in range(7)]
FINGERS = ["panda_finger_joint1", "panda_finger_joint2"]
ELSEWHERE = [0.4, 0.3, 0.2, -1.4, 0.5, 1.6, 0.7]
UNUSABLE = {
    "a finger without its position": (FINGERS[:1] + ARM, ELSEWHERE, []),
    "positions without names": (ARM[:6], ELSEWHERE, []),
    "velocities of some": (ARM, ELSEWHERE, [0.0] * 3),
    "a name twice": (ARM + ARM[:1], [*ELSEWHERE, 0.4], []),
    "not a number": (ARM, [float("nan"), *ELSEWHERE[1:]], []),
    "a velocity that is none": (ARM, ELSEWHERE, [float("inf")] * 7),
    "degrees": (ARM, [57.3 * q for q in ELSEWHERE], []),
    "fingers in mm": (ARM + FINGERS, [*ELSEWHERE, 40.0, 40.0], []),
    "a finger that is none": (ARM + FINGERS, [*ELSEWHERE, 0.04, float("nan")], []),
}


def test_joint_states_that_cannot_be_read_for_sure_are_refused_and_counted(network):
    with lab() as bench:
        publisher = bench.client.create_publisher(JOINT_STATES.type, JOINT_STATES.name, 10)
        bench.until(lambda: publisher.get_subscription_count() >= 1)

        (bridge,) = [
            n for n in bench.spinner.executor.get_nodes() if n.get_name() == "robot_bridge"
        ]
        refused = bridge._robot.sensors.counts  # diagnostics have them once a second

        def refuses(names, positions, velocities, stamp):
            before = refused["refused_measurements"]
            header = Header(stamp=stamp)
            lists = {"name": names, "position": positions, "velocity": velocities}
            publisher.publish(JointState(header=header, **lists))
            bench.until(lambda: refused["refused_measurements"] > before)

        for lists in UNUSABLE.values():
            refuses(*lists, stamp=bench.client.get_clock().now().to_msg())
        refuses(ARM, ELSEWHERE, [], stamp=Time())  # nobody knows when that was
        bench.step()
        assert bench.states[-1].objects[0].features == bench.states[0].objects[0].features


def test_a_clock_that_is_ahead_is_not_believed(network):
    with lab() as bench:
        publisher = bench.client.create_publisher(JOINT_STATES.type, JOINT_STATES.name, 10)
        bench.until(lambda: publisher.get_subscription_count() >= 1)
        ahead = bench.client.get_clock().now().to_msg()
        ahead.sec += 60
        names = [f"panda_joint{i + 1}" for i in range(7)]
        publisher.publish(JointState(header=Header(stamp=ahead), name=names, position=STILL))
        bench.until(lambda: int(bench.health.get("refused_measurements", 0)) > 0)
        bench.step()
        assert bench.states[-1].objects[0].features == bench.states[0].objects[0].features


@pytest.mark.parametrize("set_by", [-0.3, -60.0, 60.0, -86_400.0])
def test_a_robot_goes_on_after_its_clock_was_set(network, set_by):
    """Bridge, sensors and controllers go by one clock, and none of their deadlines does."""
    deadlines = dict.fromkeys(("joint_timeout", "controller_timeout", "detection_timeout"), 30.0)
    with lab(BY_THE_CLOCK, BY_THE_CLOCK | deadlines, started=False) as bench:
        clock = SettableClock()
        bench.spinner.executor.add_node(clock)
        bench.until(lambda: bench.states and bench.commands.get_subscription_count())
        bench.step()
        clock.set_by(set_by)
        for _ in range(3):
            bench.step(deltas=[0.02, *STILL[1:]])
        bench.until(lambda: bench.health.get("steps") == "4")
        assert bench.health["fault"] == "NONE"
        assert bench.states[-1].objects[0].features[0] != bench.states[0].objects[0].features[0]
        clock.destroy_node()


# A controller that gives a motion up: as it is told to, or since the arm lags more than it may.
GIVES_UP = {"mock": {"fault": "abort", "fault_after": 1}, "mujoco": {"path_tolerance": 0.01}}


@on_both_robots
def test_a_reset_opens_an_episode_as_measured_and_ends_a_fault(network, world):
    with lab(GIVES_UP[world], world=world) as bench:
        bench.step()
        bench.command(deltas=[0.05, *STILL[1:]])
        bench.fault(ErrorCode.CONTROLLER_ABORTED)
        explicit = bench.reset(initial_state=bench.states[0])
        assert explicit.error_code == ErrorCode.INVALID_STATE
        assert "cannot be put into a state" in explicit.error_msg
        bench.until(lambda: bench.reset().error_code == 0)
        bench.until(lambda: bench.states[-1].episode == 2)
        assert bench.states[-1].step == 0


def test_a_reset_waits_for_the_controllers_of_a_motion_that_failed(network):
    """Joint positions fail while the fingers move, and are back before these are done."""
    with lab(EXACT, {"joint_timeout": 0.3}) as bench:
        bench.until(lambda: bench.joints)
        before = bench.joints[-1][0]
        robot, bridge = (
            next(n for n in bench.spinner.executor.get_nodes() if n.get_name() == name)
            for name in ("mock_robot", "robot_bridge")
        )
        robot._controllers._period_s = 1.5  # s, that the fingers take
        bridge._robot.world._lost = True  # what was held: they are to be opened
        encoders = robot._joints._joints
        publish, encoders.publish = encoders.publish, lambda _: None
        bench.command(deltas=[0.05, *STILL[1:]])
        bench.until(lambda: bench.faults)
        encoders.publish = publish
        answers = []

        def begun():
            answers.append(bench.reset())
            return answers[-1].error_code == 0

        bench.until(begun)
        bench.until(lambda: bench.states[-1].episode == 2)
        for _ in range(3):
            bench.step()
        assert bench.joints[-1][0] == pytest.approx(before, abs=1e-6)  # the command is forgotten
        assert len(bench.faults) == 1
        assert ErrorCode.BUSY in [answer.error_code for answer in answers]


def test_a_skill_server_that_dies_leaves_the_robot_holding(network):
    nodes = node_parameters(settings(bridge=PATIENT))
    mind = {name: nodes.pop(name) for name in ("skill_server", "planner_node")}
    heard = []
    with (
        temporary_node(lambda: RunClient(lambda *message: heard.append(message))) as (
            client,
            spinner,
        ),
        InProcessLauncher(nodes, spinner.executor),
    ):
        bench = Lab(client, spinner, heard, STANDS["mock"])
        with InProcessLauncher(mind, spinner.executor):
            bench.until(lambda: client.ready(False))
            client.send((), 0, 5)
            bench.until(lambda: len(bench.states) > 5)
        bench.health.clear()
        # The motion under way ends, and nobody commands another.
        bench.until(
            lambda: bench.health.get("phase") == "READY" and bench.health["holding"] == "True"
        )
        states, joints = len(bench.states), bench.joints[-1]
        bench.wait(1.5)
        assert (len(bench.states), bench.joints[-1]) == (states, joints)


def test_options_of_the_mock_robot_have_types_and_names():
    assert parse_mock_robot("latency=1,noise_seed=3,fault=abort") == {
        "latency": 1.0,
        "noise_seed": 3,
        "fault": "abort",
    }
    assert isinstance(parse_mock_robot("latency=1")["latency"], float)
    for wrong in ("speed=1", "latency=soon", "domain=obstacle2d"):
        with pytest.raises(InvalidParameterError, match="mock robot"):
            parse_mock_robot(wrong)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"world": "moon"}, "--world must be one of sim, robot, mock"),
        ({"world": "sim", "scene": Path("x.yaml")}, "not for --world sim"),
        ({"world": "robot", "mock": "latency=0.1"}, "for --world mock"),
        ({"watched": True}, "for --live"),
        ({"live_port": 8765}, "for --live"),
    ],
)
def test_the_command_line_refuses_what_does_not_fit(options, words):
    with pytest.raises(InvalidParameterError, match=words):
        RunOptions("obstacle_tower", **options)
