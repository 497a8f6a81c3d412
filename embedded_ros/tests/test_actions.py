# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Actions between processes."""

from __future__ import annotations

from collections.abc import Callable

import pytest
import rclpy
from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from example_interfaces.action import Fibonacci
from rclpy.action import (
    ActionClient,
    ActionServer,
    CancelResponse,
    GoalResponse,
    get_action_names_and_types,
)
from rclpy.action.goal_state import InvalidTransitionError
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from conftest import TIMEOUT_S, Process, complete, spin_until
from peers import FAILING_ORDER, HELD_ORDER, REJECTED_ORDER, TOLD_ORDER

Run = Callable[..., Process]


@pytest.fixture
def server(run: Run) -> Process:
    return run("counter")


@pytest.fixture
def client(node: Node, server: Process) -> ActionClient:
    return ready_client(node)


def ready_client(node: Node) -> ActionClient:
    client = ActionClient(node, Fibonacci, "fibonacci")
    assert client.wait_for_server(TIMEOUT_S)
    return client


def test_a_goal_succeeds_with_feedback(node: Node, client: ActionClient, server: Process) -> None:
    feedback: list[list[int]] = []
    goal = complete(
        node,
        client.send_goal_async(
            Fibonacci.Goal(order=TOLD_ORDER), lambda m: feedback.append(list(m.feedback.sequence))
        ),
    )
    assert goal.accepted
    assert goal.stamp.sec > 0
    assert spin_until(node, lambda: len(feedback) == 5)
    server.tell("end")  # not before: feedback that is under way when a goal ends is dropped
    response = complete(node, goal.get_result_async())
    assert response.status == GoalStatus.STATUS_SUCCEEDED == goal.status
    assert list(response.result.sequence) == [0, 1, 1, 2, 3, 5, 8]
    assert feedback[0] == [0, 1, 1]
    assert feedback[-1] == [0, 1, 1, 2, 3, 5, 8]
    again = complete(node, goal.get_result_async())
    assert again == response


def test_a_goal_is_cancelled_halfway(node: Node, client: ActionClient) -> None:
    feedback: list[object] = []
    goal = complete(node, client.send_goal_async(Fibonacci.Goal(order=HELD_ORDER), feedback.append))
    result = goal.get_result_async()
    assert spin_until(node, lambda: goal.status == GoalStatus.STATUS_EXECUTING)
    assert spin_until(node, lambda: bool(feedback))
    answer = complete(node, goal.cancel_goal_async())
    assert answer.return_code == CancelGoal.Response.ERROR_NONE
    assert [info.goal_id for info in answer.goals_canceling] == [goal.goal_id]
    response = complete(node, result)
    assert response.status == GoalStatus.STATUS_CANCELED
    assert 2 < len(response.result.sequence) < HELD_ORDER
    again = complete(node, goal.cancel_goal_async())
    assert again.return_code == CancelGoal.Response.ERROR_GOAL_TERMINATED


def test_a_state_that_arrives_before_the_answer_counts(node: Node) -> None:
    begun, released = rclpy.Future(), rclpy.Future()

    async def execute(handle):
        begun.set_result(None)
        await released
        handle.succeed()
        return Fibonacci.Result()

    serving = Node("serving", context=node.context)
    server = ActionServer(serving, Fibonacci, "fibonacci", execute)
    client = ready_client(node)
    accepted = client.send_goal_async(Fibonacci.Goal())
    executor = SingleThreadedExecutor()
    executor.add_node(serving)
    executor.spin_until_future_complete(begun, timeout_sec=TIMEOUT_S)
    # The answer and the latest state, of which there will be no other, wait for the client now.
    goal = complete(node, accepted)
    assert spin_until(node, lambda: goal.status == GoalStatus.STATUS_EXECUTING)
    released.set_result(None)
    executor.spin_once(timeout_sec=TIMEOUT_S)
    executor.shutdown()
    server.destroy()
    serving.destroy_node()


def test_goals_are_rejected_and_aborted(node: Node, client: ActionClient) -> None:
    rejected = complete(node, client.send_goal_async(Fibonacci.Goal(order=REJECTED_ORDER)))
    assert not rejected.accepted
    failing = complete(node, client.send_goal_async(Fibonacci.Goal(order=FAILING_ORDER)))
    response = complete(node, failing.get_result_async())
    assert response.status == GoalStatus.STATUS_ABORTED
    assert response.result == Fibonacci.Result()


def test_results_expire(node: Node, run: Run) -> None:
    process = run("forgetful")
    client = ready_client(node)
    goal = complete(node, client.send_goal_async(Fibonacci.Goal(order=TOLD_ORDER)))
    result = goal.get_result_async()
    process.tell("end")
    assert complete(node, result).status == GoalStatus.STATUS_SUCCEEDED

    def expired() -> bool:
        status = complete(node, goal.get_result_async()).status
        return status == GoalStatus.STATUS_UNKNOWN

    assert spin_until(node, expired)


def test_several_goals_at_once(node: Node, client: ActionClient) -> None:
    goals = [
        complete(node, client.send_goal_async(Fibonacci.Goal(order=order))) for order in (3, 4, 5)
    ]
    results = [complete(node, goal.get_result_async()).result for goal in goals]
    assert [len(result.sequence) for result in results] == [4, 5, 6]


def test_actions_are_listed(node: Node, client: ActionClient) -> None:
    assert get_action_names_and_types(node) == [
        ("/fibonacci", ["example_interfaces/action/Fibonacci"])
    ]


def test_a_server_that_dies_is_noticed(node: Node, run: Run) -> None:
    process = run("counter")
    client = ready_client(node)
    assert node.count_publishers("/fibonacci/_action/feedback") == 1
    process.kill()
    assert spin_until(node, lambda: not client.server_is_ready())
    assert spin_until(node, lambda: node.count_publishers("/fibonacci/_action/feedback") == 0)
    assert spin_until(node, lambda: "counter" not in node.get_node_names())


def test_an_asynchronous_server_in_one_thread(node: Node) -> None:
    """Goal, cancel and execution on the very executor that also runs the client."""
    handles = []

    async def execute(handle):
        handles.append(handle)
        with pytest.raises(InvalidTransitionError, match=r"EXECUTING cannot take .* CANCELED"):
            handle.canceled()
        released = rclpy.Future()

        def release() -> None:
            if handle.is_cancel_requested:
                released.set_result(None)

        timer = node.create_timer(0.01, release)
        await released
        node.destroy_timer(timer)
        handle.canceled()
        with pytest.raises(InvalidTransitionError):
            handle.succeed()
        return Fibonacci.Result(sequence=[1])

    server = ActionServer(
        node,
        Fibonacci,
        "fibonacci",
        execute,
        goal_callback=lambda goal: GoalResponse.ACCEPT,
        cancel_callback=lambda handle: CancelResponse.ACCEPT,
    )
    client = ready_client(node)
    goal = complete(node, client.send_goal_async(Fibonacci.Goal(order=1)))
    result = goal.get_result_async()
    assert spin_until(node, lambda: bool(handles))
    complete(node, goal.cancel_goal_async())
    response = complete(node, result)
    assert response.status == GoalStatus.STATUS_CANCELED
    assert list(response.result.sequence) == [1]
    with pytest.raises(TypeError, match="expected example_interfaces/action/Fibonacci_Feedback"):
        handles[0].publish_feedback(Fibonacci.Result())
    server.destroy()
    server.destroy()
    client.destroy()
    assert get_action_names_and_types(node) == []


def test_a_deferred_goal_executes_when_told(node: Node) -> None:
    waiting = []
    server = ActionServer(
        node,
        Fibonacci,
        "fibonacci",
        lambda handle: (handle.succeed(), Fibonacci.Result())[1],
        handle_accepted_callback=waiting.append,
    )
    client = ready_client(node)
    goal = complete(node, client.send_goal_async(Fibonacci.Goal()))
    result = goal.get_result_async()
    assert spin_until(node, lambda: bool(waiting))
    spin_until(node, lambda: False, 0.1)
    assert not result.done()
    assert waiting[0].status == GoalStatus.STATUS_ACCEPTED
    waiting[0].execute()
    assert complete(node, result).status == GoalStatus.STATUS_SUCCEEDED
    refused = complete(node, goal.cancel_goal_async())
    assert refused.return_code == CancelGoal.Response.ERROR_GOAL_TERMINATED
    server.destroy()


def test_a_destroyed_server_says_that_its_goals_are_aborted(node: Node) -> None:
    server = ActionServer(
        node, Fibonacci, "fibonacci", lambda handle: None, handle_accepted_callback=lambda h: None
    )
    client = ready_client(node)
    goal = complete(node, client.send_goal_async(Fibonacci.Goal()))
    server.destroy()
    assert spin_until(node, lambda: goal.status == GoalStatus.STATUS_ABORTED)
    assert not client.server_is_ready()
