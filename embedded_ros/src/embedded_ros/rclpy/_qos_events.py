# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Warns when a publisher and a subscription do not match because of their QoS."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from embedded_ros.transport.endpoints import Reader, Writer

from ._dds_qos import policy_kind

if TYPE_CHECKING:
    from .node import Node


class QoSWarnings:
    """Looks after a node's endpoints; the executor asks now and then."""

    def __init__(self, node: Node) -> None:
        self._log: Callable[..., object] = node.get_logger().warning
        self._watched: dict[Reader | Writer, str] = {}

    def watch(self, endpoint: Reader | Writer, topic: str) -> None:
        """Look after an endpoint."""
        self._watched[endpoint] = topic

    def check(self) -> None:
        """Warn of every incompatibility that is new."""
        for endpoint, topic in list(self._watched.items()):
            if endpoint.closed:
                del self._watched[endpoint]
                continue
            policy = endpoint.take_incompatible_policy()
            if not policy:
                continue
            name = policy_kind(policy).name
            if isinstance(endpoint, Reader):
                self._log(
                    f"New publisher discovered on topic '{topic}', offering incompatible QoS. "
                    f"No messages will be received from it. Last incompatible policy: {name}"
                )
            else:
                self._log(
                    f"New subscription discovered on topic '{topic}', requesting incompatible "
                    f"QoS. No messages will be sent to it. Last incompatible policy: {name}"
                )
