# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Records every topic of the ensemble as a rosbag2 bag (MCAP).

The bag is begun when the domain and the task are known, because they go into its metadata; what
arrives earlier is kept until then.

ROS Parameters:
    bag (string, no default): the folder to write; must not exist.
    limit (double, 4000.0): MB of messages after which the bag is finished, whoever sends them.

Subscribers:
    every topic of ``ensemble.interfaces.RECORDED``, as raw bytes; joint_states as they are offered.

Publishers:
    diagnostics (diagnostic_msgs/DiagnosticArray): messages written; 1 Hz.

Services:
    slap/close_bag (std_srvs/Trigger): finish the bag once nothing more arrives.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import monotonic_ns
from typing import Any

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from slap_msgs.msg import DomainInfo, Task
from std_srvs.srv import Trigger

from ensemble.diagnostics import DiagnosticsPublisher
from ensemble.endpoints import subscribe
from ensemble.entry_point import run_node
from ensemble.futures import wait_until
from ensemble.interfaces import (
    CLOSE_BAG,
    DIAGNOSTICS,
    DOMAIN,
    JOINT_STATES,
    RECORDED,
    TASK,
    TF,
    Topic,
)
from ensemble.offered_qos import subscribe_as_offered
from ensemble.parameters import parameter, read_parameters
from slap_ros.bags.writer import BagWriter, require_new
from slap_ros.errors import InvalidParameterError
from slap_ros.files import require_writable
from slap_ros.versions import versions

# Looks for a message in vain, after which nothing more is expected; one every POLL_PERIOD, 0.2 s in
# all. Not a time: in that, a process that is kept waiting has not looked.
QUIET = 10
LONGEST = 100  # looks in all: strangers may never be quiet
KNOWN = 100  # domains that are announced, and tasks, before the bag is begun
ENDLESS = (
    DIAGNOSTICS,
    JOINT_STATES,
    TF,
)  # a robot's driver never stops; a simulator's go with states


@dataclass(frozen=True)
class RecorderParameters:
    """See the module's docstring."""

    bag: str = parameter("", "the folder to write; must not exist")
    limit: float = parameter(4000.0, "MB of messages after which the bag is finished", 1e-3)


@dataclass(frozen=True)
class Record:
    """A message as it arrived."""

    topic: str  # fully qualified
    type_name: str
    stamp_ns: int  # time of arrival
    raw: bytes  # CDR


class RecorderNode(Node):
    """Records every topic of an ensemble into a bag."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("recorder_node", **kwargs)
        settings = read_parameters(self, RecorderParameters)
        self._path = _new_folder(settings.bag)
        self._limit_bytes = settings.limit * 1e6
        # Strangers may announce others: the first task whose domain is known begins the bag.
        self._domains: OrderedDict[str, DomainInfo] = OrderedDict()
        self._tasks: OrderedDict[str, Task] = OrderedDict()  # by domain
        self._early: list[Record] = []  # before domain and task are known
        self._bytes = 0  # of messages, those that are early among them
        self._writer: BagWriter | None = None
        self._closed = False
        self._started_ns = self.get_clock().now().nanoseconds - monotonic_ns()
        self._looks = 0  # in vain, since the newest message
        self._looks_left = LONGEST  # of those of a request
        self._written = 0  # messages
        for topic in RECORDED:
            self._subscribe(topic)
        # A group of its own: while it waits for quiet it would keep its group's other callbacks
        # from running, and with them what it waits for.
        self.create_service(
            CLOSE_BAG.type,
            CLOSE_BAG.name,
            self._on_close,
            callback_group=MutuallyExclusiveCallbackGroup(),
        )
        DiagnosticsPublisher(self, self._diagnostics)

    def _diagnostics(self) -> dict[str, object]:
        full = self._bytes > self._limit_bytes
        return {"messages": self._written, "closed": self._closed, "full": full}

    def destroy_node(self) -> None:
        """Finish the bag, also on a signal."""
        self._close()
        super().destroy_node()

    def _subscribe(self, topic: Topic) -> None:
        callback = partial(self._on_message, topic, self.resolve_topic_name(topic.name))
        if topic is JOINT_STATES:
            subscribe_as_offered(self, topic, callback, raw=True)
        else:
            subscribe(self, topic, callback, raw=True)

    def _on_message(self, topic: Topic, name: str, raw: bytes) -> None:
        if self._closed:
            return
        if topic not in ENDLESS:
            self._looks = 0
        self._bytes += len(raw)
        if self._bytes > self._limit_bytes:
            self._finish_full()
            return
        record = Record(name, topic.type_name, self._now_ns(), bytes(raw))
        if self._writer is not None:
            self._write(record)
            return
        self._early.append(record)
        if topic is DOMAIN:
            domain = deserialize_message(raw, DomainInfo)
            _remember(self._domains, domain.name, domain)
        elif topic is TASK:
            task = deserialize_message(raw, Task)
            _remember(self._tasks, task.domain, task)
        if common := self._domains.keys() & self._tasks.keys():
            known = common.pop()
            self._begin(_of_domain(self._domains[known]) | _of_task(self._tasks[known]))

    def _finish_full(self) -> None:
        """End the recording, so that no stranger fills the disk."""
        self.get_logger().error(
            f"the bag is finished, as {self._limit_bytes / 1e6:g} MB were published: parameter "
            "limit allows more"
        )
        self._close()

    def _now_ns(self) -> int:
        """Time of arrival, from the clock as it was at the start: readers sort messages by it."""
        return self._started_ns + monotonic_ns()

    def _begin(self, metadata: dict[str, str]) -> None:
        self._writer = BagWriter(self._path, metadata | versions())
        for record in self._early:
            self._write(record)
        self._early.clear()

    def _write(self, record: Record) -> None:
        assert self._writer is not None
        self._writer.write(record.topic, record.type_name, record.stamp_ns, record.raw)
        self._written += 1

    async def _on_close(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._looks, self._looks_left = 0, LONGEST
        await wait_until(self, self._is_quiet)
        response.success = self._written > 0  # also where the bag was finished before
        response.message = str(self._path) if response.success else "nothing was recorded"
        self._close()
        return response

    def _is_quiet(self) -> bool:
        self._looks += 1
        self._looks_left -= 1
        return self._looks > QUIET or self._looks_left < 0

    def _close(self) -> None:
        self._closed = True
        if self._writer is not None:
            self._writer.close()
            self._writer = None


def _remember(known: OrderedDict[str, Any], name: str, message: object) -> None:
    """Keep a message by a name, and no more than ``KNOWN`` names: the newest."""
    known[name] = message
    known.move_to_end(name)
    if len(known) > KNOWN:
        known.popitem(last=False)


def _new_folder(name: str) -> Path:
    if not name:
        raise InvalidParameterError("parameter bag must name the folder to write")
    path = Path(name)
    require_new(path)
    try:
        require_writable(path)
    except OSError as error:
        raise InvalidParameterError(f"parameter bag: {path}: {error.strerror}") from error
    return path


def _of_domain(message: DomainInfo) -> dict[str, str]:
    configuration = {f"configuration.{item.key}": item.value for item in message.configuration}
    return {"domain": message.name, "preset": message.preset, **configuration}


def _of_task(message: Task) -> dict[str, str]:
    return {"seed": str(message.seed), "index": str(message.index)}


def main() -> int:
    """Run the node."""
    return run_node("recorder_node", RecorderNode)
