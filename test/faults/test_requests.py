# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every field of every service and action at its limits: always an answer with a code."""

from contextlib import contextmanager
from copy import deepcopy

import pytest
from action_msgs.msg import GoalStatus
from control_msgs.action import FollowJointTrajectory, GripperCommand
from rclpy.action import ActionClient
from slap_msgs.action import ExecuteSkill, SolveTask
from slap_msgs.msg import GroundAtom
from slap_msgs.srv import ListSkills, ResetTask
from trajectory_msgs.msg import JointTrajectoryPoint

from ensemble.client import RunClient
from ensemble.interfaces import (
    CLOSE_BAG,
    EXECUTE_SKILL,
    LIST_SKILLS,
    PLAN,
    RESET_TASK,
    SOLVE_TASK,
)
from ensemble.launcher import InProcessLauncher
from ensemble.nodes import RunSettings, node_parameters
from ensemble.spinner import temporary_node
from slap_ros.errors import ErrorCode
from slap_ros.messages.interfaces import TASK
from slap_ros.skills.domain_choice import DomainChoice
from support.bench import LIMIT, Bench

pytestmark = pytest.mark.timeout(300)  # dozens of requests, some of which wait in vain
MOCK = RunSettings(
    DomainChoice("obstacle_tower", "fair"), 1, 0, "lazy", None, world="mock", mock={"pace": 50.0}
)
BRIEFLY = 3.0  # s, for what may last for good and need not succeed
# What is waited for in vain is waited for less long than in a laboratory.
HASTY = {"planner_node": {"observation_timeout": 1.0}, "skill_server": {"state_timeout": 1.0}}
FLOATS = [-1.0, 0.0, 1e308, -1e308, float("inf"), float("-inf"), float("nan")]
BOUNDARIES = {
    "boolean": [False, True],
    "string": ["", "nobody", "x" * 100_000, "é\n{}[/x]\x1b[2J"],
    "double": FLOATS,
    "float": [-1.0, 0.0, 3e38, float("inf"), float("nan")],
    **{f"int{n}": [-(2 ** (n - 1)), -1, 0, 2 ** (n - 1) - 1] for n in (8, 16, 32, 64)},
    **{f"uint{n}": [0, 1, 2**n - 1] for n in (8, 16, 32, 64)},
}


def variants(message):
    """Copies of a message, each with one of its fields, however deep, at one of its limits."""
    for name, kind in message.get_fields_and_field_types().items():
        value = getattr(message, name)
        for changed in field_variants(value, kind.removesuffix("]").partition("[")[0]):
            copy = deepcopy(message)
            setattr(copy, name, changed)
            yield copy


def field_variants(value, kind):
    if kind.startswith("sequence<") or (isinstance(value, list) and not isinstance(value, str)):
        items = list(value)
        yield []
        if items:
            yield items + items
            yield items[:-1]
            inner = kind.removeprefix("sequence<").partition(",")[0].removesuffix(">")
            for item in field_variants(items[0], inner):
                yield [item, *items[1:]]
    elif hasattr(value, "get_fields_and_field_types"):
        yield from variants(value)
    else:
        yield from BOUNDARIES[kind]


class AskedNodes(Bench):
    """Nodes that are asked for whatever can be asked for."""

    def __init__(self, client, spinner, heard):
        super().__init__(client, spinner)
        self.heard = heard
        self.client.create_subscription(PLAN.type, PLAN.name, self.on_plan, PLAN.qos)
        self.plans = []

    def on_plan(self, message):
        self.plans.append(message)

    @property
    def task(self):
        """The newest task; None before there is one."""
        return next((m for kind, m in self.heard[::-1] if kind == TASK), None)

    def ask(self, client, goal, longest_s=LIMIT):
        """Its status and result; none where it is rejected. What lasts longer is canceled."""
        handle = self.result(client.send_goal_async(goal))
        if not handle.accepted:
            return None
        ended = handle.get_result_async()
        if not self.spinner.spin_until(ended.done, longest_s):
            handle.cancel_goal_async()
        return self.result(ended)


@contextmanager
def bench(parameters):
    heard = []
    with (
        temporary_node(lambda: RunClient(lambda *message: heard.append(message))) as (
            client,
            spinner,
        ),
        InProcessLauncher(parameters, spinner.executor),
    ):
        yield AskedNodes(client, spinner, heard)


@contextmanager
def recorded_ensemble(bag, changed):
    settings = RunSettings(DomainChoice("obstacle2d", "fair"), 3, 0, "lazy", bag, shortcuts="none")
    nodes = node_parameters(settings)
    with bench({name: {**nodes[name], **changed.get(name, {})} for name in nodes}) as found:
        found.until(lambda: found.client.ready(True) and found.task)
        yield found


@pytest.fixture
def ensemble(network, tmp_path):
    patient = {"patience": 5.0}  # for a loaded machine
    names = ("perception_node", "skill_server", "planner_node")
    with recorded_ensemble(tmp_path / "bag", dict.fromkeys(names, patient)) as found:
        yield found


@pytest.fixture
def hasty_ensemble(network, tmp_path):
    with recorded_ensemble(tmp_path / "bag", HASTY) as found:
        yield found


def answered(result):
    """It has a code of its own, which is not that of a bug."""
    assert ErrorCode(result.error_code) is not ErrorCode.INTERNAL_ERROR, result.error_msg
    assert bool(result.error_code) == bool(result.error_msg)


def test_whatever_a_reset_is_asked_it_answers(ensemble):
    task = ensemble.task
    sampled = ResetTask.Request(seed=1, index=1)
    given = ResetTask.Request(initial_state=task.initial_state, goal=task.goal)
    for request in (*variants(sampled), *variants(given)):
        answered(ensemble.call(RESET_TASK, request))
    refused = ensemble.call(RESET_TASK, ResetTask.Request(seed=-1))
    assert refused.error_code == ErrorCode.INVALID_PARAMETER
    again = ensemble.call(RESET_TASK, ResetTask.Request(seed=5))
    goal = SolveTask.Goal(episode=again.episode)
    assert ensemble.ask(ensemble.client._solve, goal).result.success


def test_whatever_planner_and_skill_server_are_asked_they_answer(hasty_ensemble):
    solver = ActionClient(hasty_ensemble.client, SOLVE_TASK.type, SOLVE_TASK.name)
    skills = ActionClient(hasty_ensemble.client, EXECUTE_SKILL.type, EXECUTE_SKILL.name)
    hasty_ensemble.until(lambda: solver.server_is_ready() and skills.server_is_ready())
    goal = SolveTask.Goal(goal=hasty_ensemble.task.goal, max_replans=1)
    for request in (*variants(goal), SolveTask.Goal(goal=2 * list(itself(hasty_ensemble.task)))):
        answered(hasty_ensemble.ask(solver, request, BRIEFLY).result)
    hasty_ensemble.until(lambda: hasty_ensemble.plans)
    edge = hasty_ensemble.plans[0].edges[0]
    for request in variants(ExecuteSkill.Goal(episode=1, edge=edge, step_budget=5)):
        answered(hasty_ensemble.ask(skills, request, BRIEFLY).result)
    answered(hasty_ensemble.call(LIST_SKILLS, ListSkills.Request()))
    for client in (solver, skills):
        client.destroy()


def itself(task):
    """Atoms that relate an object to itself, and to what is no block."""
    names = [obj.name for obj in task.initial_state.objects]
    return [GroundAtom(predicate="On", objects=[name, name]) for name in names]


def test_a_bag_can_be_closed_again_and_again(ensemble):
    for _ in range(3):
        assert ensemble.call(CLOSE_BAG, CLOSE_BAG.type.Request()).message


def test_whatever_a_robot_is_asked_to_begin_with_it_answers(network):
    pytest.importorskip("pybullet")
    nodes = node_parameters(MOCK)
    with bench({name: nodes[name] for name in ("robot_bridge.mock", "robot_bridge")}) as found:
        found.until(lambda: found.task)
        sampled = ResetTask.Request(seed=1, index=1, goal=found.task.goal)
        given = ResetTask.Request(initial_state=found.task.initial_state)
        for request in (*variants(sampled), *variants(given)):
            answered(found.call(RESET_TASK, request))
        found.until(lambda: not found.call(RESET_TASK, ResetTask.Request()).error_code)


def test_whatever_the_controllers_are_asked_they_answer(network):
    pytest.importorskip("pybullet")
    only = {"robot_bridge.mock": node_parameters(MOCK)["robot_bridge.mock"]}
    with bench(only) as found:
        arm = ActionClient(
            found.client, FollowJointTrajectory, "panda_arm_controller/follow_joint_trajectory"
        )
        gripper = ActionClient(found.client, GripperCommand, "franka_gripper/gripper_action")
        found.until(lambda: arm.server_is_ready() and gripper.server_is_ready())
        motion = FollowJointTrajectory.Goal()
        motion.trajectory.joint_names = [f"panda_joint{i + 1}" for i in range(7)]
        motion.trajectory.points = [
            JointTrajectoryPoint(positions=[0.0, -0.5, 0.0, -2.0, 0.0, 1.5, 0.8])
        ]
        for request in variants(motion):
            found.ask(arm, request, BRIEFLY)
        for request in variants(GripperCommand.Goal()):
            found.ask(gripper, request, BRIEFLY)
        motion.trajectory.points[0].time_from_start.sec = 1
        assert found.ask(arm, motion).status == GoalStatus.STATUS_SUCCEEDED
        for client in (arm, gripper):
            client.destroy()
