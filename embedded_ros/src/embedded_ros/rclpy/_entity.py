# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an executor runs: entities, and the work they hand out."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from embedded_ros.transport.endpoints import Reader, Writer

    from .callback_groups import CallbackGroup
    from .node import Node


@dataclass(slots=True)
class Work:
    """One callback to run, with its arguments."""

    callback: Callable[..., Any]
    args: tuple[Any, ...] = ()


class Entity:
    """Base of subscriptions, services, clients, timers and guard conditions."""

    def __init__(self, callback_group: CallbackGroup) -> None:
        self.callback_group = callback_group
        self._node: weakref.ref[Node] | None = None
        callback_group.add_entity(self)

    @property
    def reader(self) -> Reader | None:
        """The DDS reader whose samples make it ready, where there is one."""
        return None

    @property
    def is_ready(self) -> bool:
        """Whether it is ready for a reason of its own, besides its reader's samples."""
        return False

    def take(self) -> Work | None:
        """The next piece of work, or None where there is none after all."""
        raise NotImplementedError

    def enter_node(self, node: Node) -> None:
        """Belong to a node; its executor learns of it."""
        self._node = weakref.ref(node)
        node.add_entity(self)

    def leave_node(self) -> None:
        """Belong to the node no more."""
        self.callback_group.remove_entity(self)
        node = self.node
        self._node = None
        if node is not None:
            node.remove_entity(self)

    @property
    def node(self) -> Node | None:
        """The node it belongs to."""
        return self._node() if self._node is not None else None

    def wake_executor(self) -> None:
        """Have the node's executor look again at what is ready."""
        node = self.node
        if node is not None:
            node.wake_executor()


class Endpoints:
    """An entity's DDS endpoints, closed and withdrawn together."""

    def __init__(self, node: Node, *endpoints: Reader | Writer) -> None:
        self._node = weakref.ref(node)
        self._endpoints = endpoints
        self._participant = node.context.participant
        self._key = node.discovery_key
        self._participant.discovery.add_endpoints(self._key, *endpoints)

    def close(self) -> None:
        """Delete them; closing twice is allowed."""
        if not self._participant.closed:
            self._participant.discovery.remove_endpoints(self._key, *self._endpoints)
        for endpoint in self._endpoints:
            self._participant.close_endpoint(endpoint)
