# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which actions there are."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..node import Node

NamesAndTypes = list[tuple[str, list[str]]]

_FEEDBACK_SUFFIX = "/_action/feedback"
_FEEDBACK_TYPE_SUFFIX = "_FeedbackMessage"


def get_action_names_and_types(node: Node) -> NamesAndTypes:
    """Every action with a server or a client."""
    return _actions(node.get_topic_names_and_types())


def get_action_server_names_and_types_by_node(
    node: Node, remote_node_name: str, remote_node_namespace: str
) -> NamesAndTypes:
    """The actions that a node serves."""
    return _actions(
        node.get_publisher_names_and_types_by_node(remote_node_name, remote_node_namespace)
    )


def get_action_client_names_and_types_by_node(
    node: Node, remote_node_name: str, remote_node_namespace: str
) -> NamesAndTypes:
    """The actions that a node uses."""
    return _actions(
        node.get_subscriber_names_and_types_by_node(remote_node_name, remote_node_namespace)
    )


def _actions(topics: Iterable[tuple[str, list[str]]]) -> NamesAndTypes:
    return [
        (
            name.removesuffix(_FEEDBACK_SUFFIX),
            [t.removesuffix(_FEEDBACK_TYPE_SUFFIX) for t in types],
        )
        for name, types in topics
        if name.endswith(_FEEDBACK_SUFFIX)
    ]
