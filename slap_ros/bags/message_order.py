# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The order of messages that rosbag2 compressed one by one.

Several threads do it, and each writes a message when it is ready: a short one overtakes a long one
that was received before it. Messages that are not compressed are in the order in which they came.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator

from slap_ros.bags.compression import is_compressed
from slap_ros.bags.raw import RawMessage
from slap_ros.errors import DamagedBagError

WINDOW_BYTES = 64 * 2**20  # of compressed messages that wait for others from before them
OVERTAKING_NS = 5 * 10**9  # who is earlier by more was not overtaken: the clock was set back


def in_order_of_arrival(messages: Iterable[RawMessage]) -> Iterator[RawMessage]:
    """The messages in the order in which they were received.

    Raises:
        DamagedBagError: As ``messages`` does, after the last of them.
    """
    waiting = _Waiting()
    try:
        for message in messages:
            if not is_compressed(message):
                yield from waiting.all()
                yield message
                continue
            if message.stamp_ns < waiting.newest_ns - OVERTAKING_NS:
                yield from waiting.all()
            waiting.add(message)
            while waiting.size_bytes > WINDOW_BYTES:
                yield waiting.first()
    except DamagedBagError:
        yield from waiting.all()
        raise
    yield from waiting.all()


class _Waiting:
    """Compressed messages that others may have overtaken, and the newest stamp among them."""

    def __init__(self) -> None:
        self._heap: list[tuple[int, int, RawMessage]] = []
        self._count = 0  # messages of one stamp stay in the order in which they were written
        self.size_bytes = 0
        self.newest_ns = 0

    def add(self, message: RawMessage) -> None:
        heapq.heappush(self._heap, (message.stamp_ns, self._count, message))
        self._count += 1
        self.size_bytes += len(message.data)
        self.newest_ns = max(self.newest_ns, message.stamp_ns)

    def first(self) -> RawMessage:
        """Take the earliest message."""
        message = heapq.heappop(self._heap)[-1]
        self.size_bytes -= len(message.data)
        return message

    def all(self) -> Iterator[RawMessage]:
        """Take all messages, the earliest first."""
        while self._heap:
            yield self.first()
        self.newest_ns = 0
