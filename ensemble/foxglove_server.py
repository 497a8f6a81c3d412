# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Serves a run to Foxglove on a WebSocket of this machine: ROS messages as they are, without ROS 2.

Channels have the names, types and bytes that bags and ``foxglove_bridge`` have, so that one layout
fits all three. Needs ``foxglove-sdk``.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Self

from rclpy.serialization import serialize_message

from ensemble.interfaces import DIAGNOSTICS, PLAN_EVENTS, RECORDED, SKILL_EVENTS, Topic
from slap_ros.errors import InvalidParameterError
from slap_ros.messages.typestore import definition

if TYPE_CHECKING:
    from foxglove.websocket import ChannelView, Client

SHOWN_TOPICS = tuple(topic for topic in RECORDED if topic is not DIAGNOSTICS)
EVENTS = (PLAN_EVENTS.type_name, SKILL_EVENTS.type_name)
HOST = "127.0.0.1"  # reachable from this machine only
PORT = 8765  # where Foxglove looks
BACKLOG = 4096  # messages kept for a viewer that is slow


def foxglove_installed() -> bool:
    """Whether foxglove-sdk is installed."""
    return find_spec("foxglove") is not None


class FoxgloveServer:
    """Sends messages to all viewers; one that joins late gets the newest of each topic at once.

    Raises:
        InvalidParameterError: foxglove-sdk is not installed, or the port is in use.
    """

    def __init__(self, port: int | None) -> None:
        """Serve on ``port``; None: Foxglove's own port, or any other that is free."""
        if not foxglove_installed():
            raise InvalidParameterError(
                "Foxglove is served with foxglove-sdk, which is not installed: "
                "pip install 'slap_ros[live]'"
            )
        from foxglove import Channel, Context, Schema

        self._context = Context()
        self._channels = {
            topic.type_name: Channel(
                channel_name(topic),
                schema=Schema(
                    name=topic.type_name,
                    encoding="ros2msg",
                    data=definition(topic.type_name).encode(),
                ),
                message_encoding="cdr",
                context=self._context,
            )
            for topic in SHOWN_TOPICS
        }
        self._by_id = {channel.id(): channel for channel in self._channels.values()}
        self._newest: dict[int, bytes] = {}  # by channel
        self._lock = threading.Lock()  # the server calls back in threads of its own
        self._subscriptions = 0
        self._server = self._start((PORT, 0) if port is None else (port,))

    def _start(self, ports: Sequence[int]) -> Any:
        from foxglove import start_server

        for port in ports:
            try:
                return start_server(
                    name="slap_ros",
                    host=HOST,
                    port=port,
                    server_listener=self,
                    context=self._context,
                    message_backlog_size=BACKLOG,
                )
            except (OSError, RuntimeError) as error:
                reason = error
        raise InvalidParameterError(f"Foxglove cannot be served on port {ports[-1]}: {reason}")

    @property
    def url(self) -> str:
        """What to open in Foxglove."""
        return f"ws://{HOST}:{self._server.port}"

    @property
    def has_viewers(self) -> bool:
        """Whether any viewer subscribes to a topic."""
        return self._subscriptions > 0

    def __call__(self, type_name: str, message: Any) -> None:
        """Send a message of the run."""
        channel = self._channels.get(type_name)
        if channel is None:
            return
        data = bytes(serialize_message(message))
        with self._lock:
            if type_name not in EVENTS:  # which must not arrive twice
                self._newest[channel.id()] = data
            channel.log(data)

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Send the newest message of a topic that a viewer has just subscribed to.

        The server cannot send it to one viewer alone, so the others receive it twice.
        """
        del client
        with self._lock:
            self._subscriptions += 1
            if channel.id in self._newest:
                self._by_id[channel.id].log(self._newest[channel.id])

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:
        """Count a viewer that has unsubscribed from a topic."""
        del client, channel
        with self._lock:
            self._subscriptions -= 1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._server.stop()


def channel_name(topic: Topic) -> str:
    """The topic's name from the root, as bags have it."""
    return f"/{topic.name}"
