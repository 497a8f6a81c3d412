# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Action clients."""

from __future__ import annotations

import os
import threading
import time
import weakref
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

from embedded_ros.types import Action, message_class

from ..callback_groups import CallbackGroup
from ..client import READY_POLL_S
from ..qos import (
    QoSProfile,
    qos_profile_action_status_default,
    qos_profile_services_default,
)
from ..task import Future
from . import names
from .goal_state import GoalState

if TYPE_CHECKING:
    from ..node import Node

ActT = TypeVar("ActT")


class ClientGoalHandle:
    """A goal at its client."""

    def __init__(self, client: ActionClient[Any], goal_id: Any, response: Any) -> None:
        self._client = client
        self._goal_id = goal_id
        self._response = response
        self._state = GoalState.ACCEPTED if response.accepted else GoalState.UNKNOWN

    @property
    def goal_id(self) -> Any:
        """The goal's UUID message."""
        return self._goal_id

    @property
    def key(self) -> bytes:
        """The goal's UUID as bytes."""
        return bytes(self._goal_id.uuid.tobytes())

    @property
    def stamp(self) -> Any:
        """When the goal was accepted."""
        return self._response.stamp

    @property
    def accepted(self) -> bool:
        """Whether the goal was accepted."""
        return bool(self._response.accepted)

    @property
    def status(self) -> int:
        """The state last heard of, as in action_msgs/msg/GoalStatus."""
        return int(self._state)

    def set_status(self, status: int) -> None:
        """Note a state; a finished goal stays finished."""
        if self._state.is_active or self._state is GoalState.UNKNOWN:
            self._state = GoalState(status)

    def cancel_goal(self) -> Any:
        """Ask to cancel and wait for the answer; never from a callback on the same executor."""
        return _wait(self.cancel_goal_async())

    def cancel_goal_async(self) -> Future[Any]:
        """Ask to cancel; the future is of an action_msgs/srv/CancelGoal response."""
        return self._client.cancel(self)

    def get_result(self) -> Any:
        """Wait for the result; never from a callback on the same executor."""
        return _wait(self.get_result_async())

    def get_result_async(self) -> Future[Any]:
        """Ask for the result; the future is of status and result."""
        return self._client.request_result(self)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ClientGoalHandle) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)

    def __repr__(self) -> str:
        return (
            f"ClientGoalHandle <id={self.key.hex()}, accepted={self.accepted}, "
            f"status={self.status}>"
        )


class ActionClient(Generic[ActT]):
    """Sends goals.

    Args:
        node: The node it belongs to.
        action_type: The action's class.
        action_name: Name of the action: absolute, relative or private.
        callback_group: The callbacks' group; the node's default one where not given.
        goal_service_qos_profile: QoS of the goal service.
        result_service_qos_profile: QoS of the result service.
        cancel_service_qos_profile: QoS of the cancel service.
        feedback_sub_qos_profile: QoS of feedback.
        status_sub_qos_profile: QoS of the states.
    """

    def __init__(
        self,
        node: Node,
        action_type: type[ActT],
        action_name: str,
        *,
        callback_group: CallbackGroup | None = None,
        goal_service_qos_profile: QoSProfile = qos_profile_services_default,
        result_service_qos_profile: QoSProfile = qos_profile_services_default,
        cancel_service_qos_profile: QoSProfile = qos_profile_services_default,
        feedback_sub_qos_profile: QoSProfile | None = None,
        status_sub_qos_profile: QoSProfile = qos_profile_action_status_default,
    ) -> None:
        if not (isinstance(action_type, type) and issubclass(action_type, Action)):
            raise TypeError(f"{action_name}: {action_type!r} is no action type")
        self._node = node
        self.action_type: type[Action] = action_type
        name = node.resolve_service_name(action_name)
        self.action_name = name
        self._lock = threading.Lock()
        self._destroyed = False
        self._feedback_callbacks: dict[bytes, Callable[[Any], Any]] = {}
        # The state last heard of each goal whose answer is awaited: it may overtake the answer,
        # and be the last for long.
        self._early_states: dict[bytes, int] = {}
        self._goals: weakref.WeakValueDictionary[bytes, ClientGoalHandle] = (
            weakref.WeakValueDictionary()
        )
        kinds = action_type.Impl
        self._feedback = node.create_subscription(
            kinds.FeedbackMessage,
            names.feedback(name),
            self._on_feedback,
            feedback_sub_qos_profile or QoSProfile(depth=10),
            callback_group=callback_group,
        )
        self._status = node.create_subscription(
            kinds.GoalStatusMessage,
            names.status(name),
            self._on_status,
            status_sub_qos_profile,
            callback_group=callback_group,
        )
        ask = partial(node.create_client, callback_group=callback_group)
        self._goal_client = ask(
            kinds.SendGoalService, names.send_goal(name), qos_profile=goal_service_qos_profile
        )
        self._cancel_client = ask(
            kinds.CancelGoalService, names.cancel_goal(name), qos_profile=cancel_service_qos_profile
        )
        self._result_client = ask(
            kinds.GetResultService, names.get_result(name), qos_profile=result_service_qos_profile
        )

    def send_goal(
        self,
        goal: Any,
        *,
        feedback_callback: Callable[[Any], Any] | None = None,
        goal_uuid: Any = None,
    ) -> Any:
        """Send a goal and wait for its result; never from a callback on the same executor.

        Returns:
            The result service's response, or None where the goal was rejected.
        """
        handle: ClientGoalHandle = _wait(
            self.send_goal_async(goal, feedback_callback=feedback_callback, goal_uuid=goal_uuid)
        )
        return handle.get_result() if handle.accepted else None

    def send_goal_async(
        self,
        goal: Any,
        feedback_callback: Callable[[Any], Any] | None = None,
        goal_uuid: Any = None,
    ) -> Future[ClientGoalHandle]:
        """Send a goal.

        Args:
            goal: The goal message.
            feedback_callback: Called with each feedback message; its ``feedback`` is the
                action's.
            goal_uuid: The goal's UUID message; random where not given.

        Returns:
            A future of the goal's handle; look at its ``accepted``.

        Raises:
            TypeError: The goal is not of the action's goal type.
        """
        if not isinstance(goal, self.action_type.Goal):
            raise TypeError(f"expected {self.action_type.Goal.ros_type}, got {type(goal).__name__}")
        goal_id = goal_uuid if goal_uuid is not None else _random_uuid()
        key = goal_id.uuid.tobytes()
        with self._lock:  # before sending: feedback and states may come before the answer
            self._early_states[key] = GoalState.UNKNOWN
            if feedback_callback is not None:
                self._feedback_callbacks[key] = feedback_callback
        request: Any = self.action_type.Impl.SendGoalService.Request()
        request.goal_id, request.goal = goal_id, goal
        accepted: Future[ClientGoalHandle] = Future()
        try:
            answer = self._goal_client.call_async(request)
        except Exception:
            self._forget(key)
            raise
        answer.add_done_callback(lambda future: self._on_answer(future, goal_id, accepted))
        return accepted

    def cancel(self, goal: ClientGoalHandle) -> Future[Any]:
        """Ask to cancel a goal."""
        request: Any = self.action_type.Impl.CancelGoalService.Request()
        request.goal_info.goal_id = goal.goal_id
        return self._cancel_client.call_async(request)

    def request_result(self, goal: ClientGoalHandle) -> Future[Any]:
        """Ask for a goal's result."""
        request: Any = self.action_type.Impl.GetResultService.Request()
        request.goal_id = goal.goal_id
        future = self._result_client.call_async(request)

        def note(finished: Future[Any]) -> None:
            if not finished.cancelled() and finished.exception() is None:
                response: Any = finished.result()
                goal.set_status(response.status)
            self._end_feedback(goal.key)

        future.add_done_callback(note)
        return future

    def server_is_ready(self) -> bool:
        """Whether a server is there, with all of its services and topics."""
        clients = (self._goal_client, self._cancel_client, self._result_client)
        return (
            all(client.service_is_ready() for client in clients)
            and self._feedback.get_publisher_count() > 0
            and self._status.get_publisher_count() > 0
        )

    def wait_for_server(self, timeout_sec: float | None = None) -> bool:
        """Wait until a server is ready.

        Args:
            timeout_sec: How long to wait, for ever by default.

        Returns:
            Whether it is ready.
        """
        deadline = None if timeout_sec is None else time.monotonic() + timeout_sec
        while self._node.context.ok():
            if self.server_is_ready():
                return True
            if deadline is not None and time.monotonic() >= deadline:
                return False
            time.sleep(READY_POLL_S)
        return False

    def destroy(self) -> None:
        """Delete the client; twice is allowed."""
        if self._destroyed:
            return
        self._destroyed = True
        for client in (self._goal_client, self._cancel_client, self._result_client):
            self._node.destroy_client(client)
        self._node.destroy_subscription(self._feedback)
        self._node.destroy_subscription(self._status)

    def __enter__(self) -> ActionClient[ActT]:
        return self

    def __exit__(self, *exc: object) -> None:
        self.destroy()

    def _on_answer(
        self, answer: Future[Any], goal_id: Any, accepted: Future[ClientGoalHandle]
    ) -> None:
        executor = self._node.executor
        if executor is not None:
            accepted._set_executor(executor)
        if answer.cancelled():
            self._forget(goal_id.uuid.tobytes())
            accepted.cancel()
            return
        error = answer.exception()
        if error is not None:
            self._forget(goal_id.uuid.tobytes())
            accepted.set_exception(error)
            return
        handle = ClientGoalHandle(self, goal_id, answer.result())
        if handle.accepted:
            self._track(handle)
        else:
            self._forget(handle.key)
        accepted.set_result(handle)

    def _track(self, goal: ClientGoalHandle) -> None:
        """Have an accepted goal follow its states, from the one that came before the answer."""
        with self._lock:
            state = self._early_states.pop(goal.key, GoalState.UNKNOWN)
            if state != GoalState.UNKNOWN:
                goal.set_status(state)
            self._goals[goal.key] = goal

    def _on_feedback(self, message: Any) -> Any:
        with self._lock:
            callback = self._feedback_callbacks.get(message.goal_id.uuid.tobytes())
        return callback(message) if callback is not None else None

    def _on_status(self, message: Any) -> None:
        for status in message.status_list:
            key = status.goal_info.goal_id.uuid.tobytes()
            with self._lock:
                goal = self._goals.get(key)
                if key in self._early_states:
                    self._early_states[key] = status.status
            if goal is not None:
                goal.set_status(status.status)
            if not GoalState(status.status).is_active:
                self._end_feedback(key)

    def _forget(self, key: bytes) -> None:
        with self._lock:
            self._early_states.pop(key, None)
        self._end_feedback(key)

    def _end_feedback(self, key: bytes) -> None:
        with self._lock:
            self._feedback_callbacks.pop(key, None)


def _random_uuid() -> Any:
    cls: Any = message_class("unique_identifier_msgs/msg/UUID")
    return cls(uuid=np.frombuffer(os.urandom(16), np.uint8).copy())


def _wait(future: Future[Any]) -> Any:
    future.wait()
    return future.result()
