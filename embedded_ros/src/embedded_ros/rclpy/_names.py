# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Names: validation, expansion to full names, remapping."""

from __future__ import annotations

import re
from collections.abc import Iterable

from ._arguments import RemapRule
from .exceptions import (
    InvalidNamespaceException,
    InvalidNodeNameException,
    InvalidServiceNameException,
    InvalidTopicNameException,
    NameValidationException,
)

MAX_NODE_NAME_LENGTH = 255
MAX_NAMESPACE_LENGTH = 245
_SUBSTITUTION = re.compile(r"\{([^{}]*)\}")


def check_node_name(name: str) -> None:
    """Raise InvalidNodeNameException unless it is a valid node name."""
    if not name:
        raise InvalidNodeNameException(name, "node name must not be empty", 0)
    _check_characters(name, r"[A-Za-z0-9_]", InvalidNodeNameException, "node name")
    if name[0].isdigit():
        raise InvalidNodeNameException(name, "node name must not start with a number", 0)
    if len(name) > MAX_NODE_NAME_LENGTH:
        raise InvalidNodeNameException(name, "node name is too long", MAX_NODE_NAME_LENGTH)


def check_namespace(namespace: str) -> None:
    """Raise InvalidNamespaceException unless it is a valid, absolute namespace."""
    if not namespace.startswith("/"):
        raise InvalidNamespaceException(namespace, "namespace must be absolute, with a '/'", 0)
    if len(namespace) > MAX_NAMESPACE_LENGTH:
        raise InvalidNamespaceException(namespace, "namespace is too long", MAX_NAMESPACE_LENGTH)
    if namespace != "/":
        _check_tokens(namespace, InvalidNamespaceException, "namespace")


def expand(name: str, node_name: str, namespace: str, *, is_service: bool = False) -> str:
    """The full name of a topic or service.

    Args:
        name: Absolute, relative or private (``~/x``); may hold ``{node}`` and ``{ns}``.
        node_name: The node's name.
        namespace: The node's namespace.
        is_service: Which exception an invalid name raises.

    Raises:
        InvalidTopicNameException: The name is invalid.
        InvalidServiceNameException: The name is invalid.
    """
    error = InvalidServiceNameException if is_service else InvalidTopicNameException
    kind = "service name" if is_service else "topic name"
    if not name:
        raise error(name, f"{kind} must not be empty", 0)
    expanded = _substitute(name, node_name, namespace, error)
    root = "" if namespace == "/" else namespace
    if expanded.startswith("~"):
        if len(expanded) > 1 and expanded[1] != "/":
            raise error(name, f"{kind} must not have characters other than '/' after '~'", 1)
        expanded = f"{root}/{node_name}{expanded[1:]}"
    elif not expanded.startswith("/"):
        expanded = f"{root}/{expanded}"
    _check_tokens(expanded, error, kind)
    return expanded


def remap(
    full_name: str, rules: Iterable[RemapRule], node_name: str, namespace: str, original_node: str
) -> str:
    """The name that the first matching rule gives to a full name, or the name itself.

    Args:
        full_name: The expanded name.
        rules: The rules, in order of precedence.
        node_name: The node's (remapped) name, for private targets.
        namespace: The node's (remapped) namespace, for relative names in rules.
        original_node: The name that rules for single nodes are written for.
    """
    for rule in rules:
        if rule.source in ("__node", "__ns") or rule.node not in (None, node_name, original_node):
            continue
        if expand(rule.source, node_name, namespace) == full_name:
            return expand(rule.target, node_name, namespace)
    return full_name


def _substitute(
    name: str,
    node_name: str,
    namespace: str,
    error: type[InvalidTopicNameException] | type[InvalidServiceNameException],
) -> str:
    values = {"node": node_name, "ns": namespace, "namespace": namespace}

    def value(match: re.Match[str]) -> str:
        if match[1] not in values:
            raise error(name, f"unknown substitution '{match[0]}'", match.start())
        return values[match[1]]

    return _SUBSTITUTION.sub(value, name)


_NameError = (
    type[InvalidTopicNameException]
    | type[InvalidServiceNameException]
    | type[InvalidNamespaceException]
    | type[InvalidNodeNameException]
)


def _check_tokens(name: str, error: _NameError, kind: str) -> None:
    _check_characters(name, r"[A-Za-z0-9_/]", error, kind)
    position = 1
    for token in name[1:].split("/"):
        if not token:
            raise error(name, f"{kind} must not end with '/' or contain '//'", position - 1)
        if token[0].isdigit():
            raise error(name, f"{kind} tokens must not start with a number", position)
        position += len(token) + 1


def _check_characters(name: str, allowed: str, error: _NameError, kind: str) -> None:
    for index, character in enumerate(name):
        if not re.fullmatch(allowed, character):
            raise error(
                name,
                f"{kind} must not contain characters other than alphanumerics, '_' and '/'"
                if "/" in allowed
                else f"{kind} must not contain characters other than alphanumerics or '_'",
                index,
            )


__all__ = ["NameValidationException", "check_namespace", "check_node_name", "expand", "remap"]
