# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Action servers."""

from __future__ import annotations

import inspect
import threading
import time
import traceback
from collections.abc import Callable
from enum import Enum
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from embedded_ros.types import Action, message_class

from ..callback_groups import CallbackGroup, ReentrantCallbackGroup
from ..clock import Clock
from ..clock_type import ClockType
from ..qos import (
    QoSProfile,
    qos_profile_action_status_default,
    qos_profile_services_default,
)
from ..service import RequestHeader
from ..task import Future
from . import names
from .deferred_service import DeferredService
from .goal_state import GoalEvent, GoalState, next_state

if TYPE_CHECKING:
    from ..node import Node

ActT = TypeVar("ActT")

# How long a finished goal's result can still be asked for: Jazzy's default.
RESULT_TIMEOUT_S = 10
# How long before the next look at which results are too old, at least.
EXPIRY_POLL_S = 0.1


class GoalResponse(Enum):
    """What a goal callback returns."""

    REJECT = 1
    ACCEPT = 2


class CancelResponse(Enum):
    """What a cancel callback returns."""

    REJECT = 1
    ACCEPT = 2


class ServerGoalHandle:
    """A goal at its server."""

    def __init__(self, server: ActionServer[Any], goal_info: Any, request: Any) -> None:
        self._server = server
        self._goal_info = goal_info
        self._request = request
        self._state = GoalState.ACCEPTED
        self._lock = threading.RLock()
        self.result_future: Future[Any] = Future()
        self.finished_at: float | None = None  # s, monotonic

    @property
    def request(self) -> Any:
        """The goal message."""
        return self._request

    @property
    def goal_id(self) -> Any:
        """The goal's UUID message."""
        return self._goal_info.goal_id

    @property
    def goal_info(self) -> Any:
        """The goal's UUID and the time it was accepted."""
        return self._goal_info

    @property
    def key(self) -> bytes:
        """The goal's UUID as bytes."""
        return bytes(self._goal_info.goal_id.uuid.tobytes())

    @property
    def status(self) -> int:
        """The state, as in action_msgs/msg/GoalStatus."""
        return int(self._state)

    @property
    def is_active(self) -> bool:
        """Whether the goal is not finished."""
        return self._state.is_active

    @property
    def is_cancel_requested(self) -> bool:
        """Whether a request to cancel was accepted."""
        return self._state is GoalState.CANCELING

    def execute(self, execute_callback: Callable[[ServerGoalHandle], Any] | None = None) -> None:
        """Execute the goal on the executor, by the server's callback where none is given."""
        with self._lock:
            # It may have been cancelled before; the callback then finds that out.
            if not self.is_cancel_requested:
                self.update(GoalEvent.EXECUTE)
        self._server.notify_execute(self, execute_callback)

    def publish_feedback(self, feedback: Any) -> None:
        """Publish feedback; raises TypeError where it is not of the action's feedback type."""
        expected = self._server.action_type.Feedback
        if not isinstance(feedback, expected):
            raise TypeError(f"expected {expected.ros_type}, got {type(feedback).__name__}")
        self._server.publish_feedback(self.goal_id, feedback)

    def succeed(self) -> None:
        """Finish as succeeded; raises InvalidTransitionError where the goal is not executing."""
        self.update(GoalEvent.SUCCEED)

    def abort(self) -> None:
        """Finish as aborted; raises InvalidTransitionError where the goal is not executing."""
        self.update(GoalEvent.ABORT)

    def canceled(self) -> None:
        """Finish as cancelled; raises InvalidTransitionError where that was not requested."""
        self.update(GoalEvent.CANCELED)

    def update(self, event: GoalEvent) -> None:
        """Change the state, and tell."""
        with self._lock:
            self._state = next_state(self._state, event)
        self._server.publish_status()

    def destroy(self) -> None:
        """Forget the goal."""
        self._server.forget(self)

    def __repr__(self) -> str:
        return f"ServerGoalHandle <id={self.key.hex()}, status={self.status}>"


def default_handle_accepted_callback(goal_handle: ServerGoalHandle) -> None:
    """Execute the goal."""
    goal_handle.execute()


def default_goal_callback(goal_request: Any) -> GoalResponse:
    """Accept the goal."""
    return GoalResponse.ACCEPT


def default_cancel_callback(cancel_request: Any) -> CancelResponse:
    """Refuse to cancel."""
    return CancelResponse.REJECT


class ActionServer(Generic[ActT]):
    """Takes goals and executes them.

    Args:
        node: The node it belongs to.
        action_type: The action's class.
        action_name: Name of the action: absolute, relative or private.
        execute_callback: Called with the goal handle; returns the result. A coroutine function
            lets a single-threaded executor go on meanwhile.
        callback_group: The group of the goal, cancel and result services' callbacks; the
            execute callback is in none.
        goal_callback: Called with the goal; returns a :class:`GoalResponse`.
        handle_accepted_callback: Called with the handle of an accepted goal.
        cancel_callback: Called with the goal handle; returns a :class:`CancelResponse`.
        goal_service_qos_profile: QoS of the goal service.
        result_service_qos_profile: QoS of the result service.
        cancel_service_qos_profile: QoS of the cancel service.
        feedback_pub_qos_profile: QoS of feedback.
        status_pub_qos_profile: QoS of the states.
        result_timeout: How many seconds a finished goal is kept; for ever where negative.
    """

    def __init__(
        self,
        node: Node,
        action_type: type[ActT],
        action_name: str,
        execute_callback: Callable[[ServerGoalHandle], Any],
        *,
        callback_group: CallbackGroup | None = None,
        goal_callback: Callable[[Any], Any] = default_goal_callback,
        handle_accepted_callback: Callable[
            [ServerGoalHandle], Any
        ] = default_handle_accepted_callback,
        cancel_callback: Callable[[ServerGoalHandle], Any] = default_cancel_callback,
        goal_service_qos_profile: QoSProfile = qos_profile_services_default,
        result_service_qos_profile: QoSProfile = qos_profile_services_default,
        cancel_service_qos_profile: QoSProfile = qos_profile_services_default,
        feedback_pub_qos_profile: QoSProfile | None = None,
        status_pub_qos_profile: QoSProfile = qos_profile_action_status_default,
        result_timeout: float = RESULT_TIMEOUT_S,
    ) -> None:
        if not (isinstance(action_type, type) and issubclass(action_type, Action)):
            raise TypeError(f"{action_name}: {action_type!r} is no action type")
        self._node = node
        self.action_type: type[Action] = action_type
        self.register_handle_accepted_callback(handle_accepted_callback)
        self.register_goal_callback(goal_callback)
        self.register_cancel_callback(cancel_callback)
        self.register_execute_callback(execute_callback)
        self._result_timeout_s = result_timeout
        self._lock = threading.RLock()
        self._goals: dict[bytes, ServerGoalHandle] = {}
        self._destroyed = False
        self._logger = node.get_logger().get_child("action_server")

        name = node.resolve_service_name(action_name)
        self.action_name = name
        kinds = action_type.Impl
        self._feedback = node.create_publisher(
            kinds.FeedbackMessage,
            names.feedback(name),
            feedback_pub_qos_profile or QoSProfile(depth=10),
        )
        self._status: Any = node.create_publisher(
            kinds.GoalStatusMessage, names.status(name), status_pub_qos_profile
        )
        group = callback_group or node.default_callback_group
        serve = partial(node.make_service, DeferredService, callback_group=group)
        self._goal_service = serve(
            kinds.SendGoalService, names.send_goal(name), self._on_goal, goal_service_qos_profile
        )
        self._cancel_service = serve(
            kinds.CancelGoalService,
            names.cancel_goal(name),
            self._on_cancel,
            cancel_service_qos_profile,
        )
        self._result_service = serve(
            kinds.GetResultService,
            names.get_result(name),
            self._on_result_request,
            result_service_qos_profile,
        )
        self._expiry = node.create_timer(
            max(EXPIRY_POLL_S, result_timeout),
            self._expire_results,
            ReentrantCallbackGroup(),
            Clock(clock_type=ClockType.STEADY_TIME),
            autostart=False,
        )

    def register_handle_accepted_callback(
        self, handle_accepted_callback: Callable[[ServerGoalHandle], Any] | None
    ) -> None:
        """Replace the callback that gets accepted goals."""
        self._handle_accepted = _callable(
            handle_accepted_callback or default_handle_accepted_callback
        )

    def register_goal_callback(self, goal_callback: Callable[[Any], Any] | None) -> None:
        """Replace the callback that accepts or rejects goals."""
        self._goal_callback = _callable(goal_callback or default_goal_callback)

    def register_cancel_callback(
        self, cancel_callback: Callable[[ServerGoalHandle], Any] | None
    ) -> None:
        """Replace the callback that accepts or rejects cancelling."""
        self._cancel_callback = _callable(cancel_callback or default_cancel_callback)

    def register_execute_callback(
        self, execute_callback: Callable[[ServerGoalHandle], Any]
    ) -> None:
        """Replace the callback that executes goals; raises TypeError unless callable."""
        self._execute_callback = _callable(execute_callback)

    def notify_execute(
        self,
        goal_handle: ServerGoalHandle,
        execute_callback: Callable[[ServerGoalHandle], Any] | None,
    ) -> None:
        """Execute a goal on the node's executor; raises RuntimeError where it has none."""
        executor = self._node.executor
        if executor is None:
            raise RuntimeError(f"{self.action_name}: the node has no executor to execute goals on")
        executor.create_task(self._execute, goal_handle, execute_callback or self._execute_callback)

    def publish_feedback(self, goal_id: Any, feedback: Any) -> None:
        """Publish feedback of a goal."""
        message_type: Any = self.action_type.Impl.FeedbackMessage
        self._feedback.publish(message_type(goal_id=goal_id, feedback=feedback))

    def publish_status(self) -> None:
        """Publish every goal's state."""
        if self._destroyed or not self._node.context.ok():
            return
        status_type: Any = message_class("action_msgs/msg/GoalStatus")
        message: Any = self.action_type.Impl.GoalStatusMessage()
        with self._lock:
            # Published under the lock: an older list must not overtake a newer one.
            message.status_list = [
                status_type(goal_info=goal.goal_info, status=goal.status)
                for goal in self._goals.values()
            ]
            self._status.publish(message)

    def forget(self, goal_handle: ServerGoalHandle) -> None:
        """Keep a goal and its result no longer."""
        with self._lock:
            self._goals.pop(goal_handle.key, None)

    def destroy(self) -> None:
        """Abort what is not finished, and delete the server; twice is allowed."""
        with self._lock:
            if self._destroyed:
                return
            goals = list(self._goals.values())
        for goal in goals:
            if goal.is_active:
                if goal.status == GoalState.ACCEPTED:
                    goal.update(GoalEvent.EXECUTE)
                goal.abort()
        self._destroyed = True
        for service in (self._goal_service, self._cancel_service, self._result_service):
            self._node.destroy_service(service)
        self._node.destroy_timer(self._expiry)
        self._node.destroy_publisher(self._feedback)
        self._node.destroy_publisher(self._status)

    def __enter__(self) -> ActionServer[ActT]:
        return self

    def __exit__(self, *exc: object) -> None:
        self.destroy()

    # -- goals

    async def _on_goal(self, request: Any, header: RequestHeader) -> None:
        response: Any = self.action_type.Impl.SendGoalService.Response()
        key = request.goal_id.uuid.tobytes()
        goal: ServerGoalHandle | None = None
        if key in self._goals:
            self._logger.error(f"Failed to accept goal: ID {key.hex()} is used already")
        elif await self._wants(request.goal):
            goal_info: Any = message_class("action_msgs/msg/GoalInfo")()
            goal_info.goal_id = request.goal_id
            goal_info.stamp = self._node.get_clock().now().to_msg()
            goal = ServerGoalHandle(self, goal_info, request.goal)
            with self._lock:
                self._goals[key] = goal
            response.accepted = True
            response.stamp = goal_info.stamp
        self._goal_service.send_response(response, header)
        if goal is not None:
            self.publish_status()
            await _outcome(self._handle_accepted(goal))

    async def _wants(self, goal: Any) -> bool:
        try:
            answer = await _outcome(self._goal_callback(goal))
        except Exception as error:
            # As rclpy: one bad goal must not end the server.
            self._logger.error(f"Error raised in goal callback: {error!r}")
            traceback.print_exc()
            return False
        if not isinstance(answer, GoalResponse):
            self._logger.error(f"Goal callback returned {answer!r}, expected a GoalResponse")
            return False
        return answer is GoalResponse.ACCEPT

    async def _execute(
        self, goal: ServerGoalHandle, execute_callback: Callable[[ServerGoalHandle], Any]
    ) -> None:
        result: Any
        try:
            result = await _outcome(execute_callback(goal))
        except Exception as error:
            if not self._node.context.ok():
                return  # shut down meanwhile: the callback failed at that, and nobody can be told
            # As rclpy: the goal is aborted, the server goes on.
            self._logger.error(f"Error raised in execute callback: {error!r}")
            traceback.print_exc()
            result = self.action_type.Result()
        if goal.is_active:
            self._logger.warning(f"Goal state not set, assuming aborted. Goal ID: {goal.key.hex()}")
            goal.abort()
        if not isinstance(result, self.action_type.Result):
            self._logger.error(
                f"Execute callback returned {result!r}, expected {self.action_type.Result.ros_type}"
            )
            result = self.action_type.Result()
        response: Any = self.action_type.Impl.GetResultService.Response()
        response.status, response.result = goal.status, result
        goal.finished_at = time.monotonic()
        goal.result_future.set_result(response)
        if self._result_timeout_s >= 0 and not self._destroyed and self._expiry.is_canceled():
            self._expiry.reset()

    def _expire_results(self) -> None:
        now = time.monotonic()
        with self._lock:
            finished = [g for g in self._goals.values() if g.finished_at is not None]
            for goal in finished:
                assert goal.finished_at is not None
                if now - goal.finished_at >= self._result_timeout_s:
                    self.forget(goal)
            left = [
                g.finished_at + self._result_timeout_s - now
                for g in self._goals.values()
                if g.finished_at is not None
            ]
        if left:
            self._expiry.timer_period_ns = int(max(EXPIRY_POLL_S, min(left)) * 1e9)
        else:
            self._expiry.cancel()

    # -- results

    def _on_result_request(self, request: Any, header: RequestHeader) -> None:
        goal = self._goals.get(request.goal_id.uuid.tobytes())
        if goal is None:
            unknown: Any = self.action_type.Impl.GetResultService.Response()
            self._result_service.send_response(unknown, header)
            return
        goal.result_future.add_done_callback(lambda future: self._send_result(future, header))

    def _send_result(self, future: Future[Any], header: RequestHeader) -> None:
        if not self._destroyed and self._node.context.ok():
            self._result_service.send_response(future.result(), header)

    # -- cancelling

    async def _on_cancel(self, request: Any, header: RequestHeader) -> None:
        response: Any = self.action_type.Impl.CancelGoalService.Response()
        candidates = self._to_cancel(request.goal_info)
        for goal in candidates:
            if await self._cancels(goal):
                response.goals_canceling.append(goal.goal_info)
        if not response.goals_canceling:
            response.return_code = self._why_not(request.goal_info, bool(candidates), response)
        self._cancel_service.send_response(response, header)

    async def _cancels(self, goal: ServerGoalHandle) -> bool:
        answer = await _outcome(self._cancel_callback(goal))
        # It may have finished while the callback ran.
        if answer is not CancelResponse.ACCEPT or not goal.is_active:
            return False
        if not goal.is_cancel_requested:
            goal.update(GoalEvent.CANCEL_GOAL)
        return True

    def _to_cancel(self, goal_info: Any) -> list[ServerGoalHandle]:
        """The unfinished goals meant: see action_msgs/srv/CancelGoal."""
        key = goal_info.goal_id.uuid.tobytes()
        stamp = _nanoseconds(goal_info.stamp)
        with self._lock:
            active = [goal for goal in self._goals.values() if goal.is_active]
        if not any(key) and not stamp:
            return active
        return [
            goal
            for goal in active
            if goal.key == key or (stamp and _nanoseconds(goal.goal_info.stamp) <= stamp)
        ]

    def _why_not(self, goal_info: Any, refused: bool, response: Any) -> int:
        key = goal_info.goal_id.uuid.tobytes()
        if refused:
            return int(response.ERROR_REJECTED)
        if any(key) and key not in self._goals:
            return int(response.ERROR_UNKNOWN_GOAL_ID)
        return int(response.ERROR_GOAL_TERMINATED if any(key) else response.ERROR_NONE)


def _callable(callback: Callable[[Any], Any]) -> Callable[[Any], Any]:
    if not callable(callback):
        raise TypeError(f"{callback!r} is not callable")
    return callback


async def _outcome(value: Any) -> Any:
    return await value if inspect.isawaitable(value) else value


def _nanoseconds(stamp: Any) -> int:
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
