# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ROS part of a command line: ``--ros-args ... [--]``."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from embedded_ros.transport.errors import RCLInvalidROSArgsError, UnknownROSArgsError

_START, _END = "--ros-args", "--"
_WITH_VALUE = {
    "-r": "remap",
    "--remap": "remap",
    "-p": "param",
    "--param": "param",
    "--params-file": "params-file",
    "--log-level": "log-level",
    "-e": "ignored",
    "--enclave": "ignored",
}
# Accepted, because launch files pass them, and without effect: the console and /rosout are all
# the logging there is.
_SWITCHES = {
    f"--{verb}-{what}"
    for verb in ("enable", "disable")
    for what in ("rosout-logs", "stdout-logs", "external-lib-logs")
}
_PARAMETERS_KEY = "ros__parameters"


@dataclass(frozen=True, slots=True)
class RemapRule:
    """``[node:]from:=to``; ``from`` may be ``__node`` or ``__ns``."""

    node: str | None
    source: str
    target: str


@dataclass(frozen=True, slots=True)
class ParameterRule:
    """A parameter's value for the nodes that a pattern matches."""

    node: str  # a node's full name, with * for one token and ** for any number
    name: str
    value: Any

    @property
    def is_wildcard(self) -> bool:
        """Whether the pattern can match several nodes."""
        return "*" in self.node

    def matches(self, full_name: str) -> bool:
        """Whether it is for the node of this full name."""
        pattern = re.escape(self.node).replace(r"/\*\*", r"(?:/\w+)*").replace(r"\*", r"\w+")
        return re.fullmatch(pattern, full_name) is not None


@dataclass(frozen=True, slots=True)
class RosArguments:
    """What the ROS part of a command line says."""

    remaps: tuple[RemapRule, ...] = ()
    parameters: tuple[tuple[ParameterRule, ...], ...] = ()  # one group an argument, in order
    log_levels: tuple[tuple[str, str], ...] = ()  # logger, level; "" for all
    enable_rosout: bool = True

    def parameters_of(self, name: str, full_name: str) -> dict[str, Any]:
        """The parameters of a node: later arguments win, and exact names over wildcards."""
        found: dict[str, Any] = {}
        for group in self.parameters:
            for wildcard in (True, False):
                for rule in group:
                    if rule.is_wildcard is wildcard and (
                        rule.matches(full_name) or rule.node == name
                    ):
                        found[rule.name] = rule.value
        return found

    def remapped_special(self, key: str, name: str) -> str | None:
        """The target of a ``__node`` or ``__ns`` rule for the node of this (original) name."""
        for rule in self.remaps:
            if rule.source == key and rule.node in (None, name):
                return rule.target
        return None


def parse_arguments(args: Sequence[str]) -> RosArguments:
    """Read a command line.

    Raises:
        UnknownROSArgsError: A ROS argument is unknown.
        RCLInvalidROSArgsError: One lacks its value, or is malformed.
    """
    remaps: list[RemapRule] = []
    parameters: list[tuple[ParameterRule, ...]] = []
    log_levels: list[tuple[str, str]] = []
    enable_rosout = True
    tokens = iter(_ros_tokens(args))
    for token in tokens:
        if token in _SWITCHES:
            if token.endswith("rosout-logs"):
                enable_rosout = token.startswith("--enable")
            continue
        kind = _WITH_VALUE.get(token)
        if kind is None:
            raise UnknownROSArgsError(f"Found unknown ROS arguments: {token!r}")
        value = next(tokens, None)
        if value is None:
            raise RCLInvalidROSArgsError(f"ROS argument {token!r} lacks its value")
        if kind == "remap":
            remaps.append(_remap_rule(value))
        elif kind == "param":
            parameters.append((_parameter_rule(value),))
        elif kind == "params-file":
            parameters.append(tuple(_parameter_file(value)))
        elif kind == "log-level":
            logger, separator, level = value.rpartition(":=")
            log_levels.append((logger if separator else "", level))
    return RosArguments(tuple(remaps), tuple(parameters), tuple(log_levels), enable_rosout)


def remove_ros_args(args: Sequence[str]) -> list[str]:
    """A command line without its ROS part."""
    kept: list[str] = []
    inside = False
    for arg in args:
        if arg == _START:
            inside = True
        elif arg == _END and inside:
            inside = False
        elif not inside:
            kept.append(arg)
    return kept


def _ros_tokens(args: Sequence[str]) -> Iterator[str]:
    inside = False
    for arg in args:
        if arg == _START:
            inside = True
        elif arg == _END:
            inside = False
        elif inside:
            yield arg


def _remap_rule(text: str) -> RemapRule:
    source, separator, target = text.partition(":=")
    if not (separator and source and target):
        raise RCLInvalidROSArgsError(f"Remap rule {text!r} is not of the form [node:]from:=to")
    node, source = _split_node(source)
    if source == "__name":
        source = "__node"
    return RemapRule(node, source, target)


def _parameter_rule(text: str) -> ParameterRule:
    name, separator, value = text.partition(":=")
    if not (separator and name):
        raise RCLInvalidROSArgsError(
            f"Parameter rule {text!r} is not of the form [node:]name:=value"
        )
    node, name = _split_node(name)
    return ParameterRule(node or "/**", name, _yaml(value, f"parameter rule {text!r}"))


def _split_node(text: str) -> tuple[str | None, str]:
    if text.startswith(("rostopic://", "rosservice://")):
        return None, text.partition("://")[2]
    node, separator, rest = text.partition(":")
    return (node, rest) if separator else (None, text)


def _parameter_file(path: str) -> Iterator[ParameterRule]:
    if Path(path).exists() and not Path(path).is_file():  # a pipe would be waited for
        raise RCLInvalidROSArgsError(f"Parameter file {path!r} cannot be read: it is no file")
    try:
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise RCLInvalidROSArgsError(f"Parameter file {path!r} cannot be read: {error}") from error
    content = _yaml(text, f"parameter file {path!r}")
    if not isinstance(content, dict):
        raise RCLInvalidROSArgsError(f"Parameter file {path!r} has no node at its top level")
    yield from _node_rules(content, "", path)


def _node_rules(content: dict[Any, Any], prefix: str, path: str) -> Iterator[ParameterRule]:
    for key, value in content.items():
        if not isinstance(value, dict):
            raise RCLInvalidROSArgsError(
                f"Parameter file {path!r}: {key!r} must hold {_PARAMETERS_KEY!r} or further names"
            )
        name = f"{prefix}/{str(key).strip('/')}"
        if _PARAMETERS_KEY in value:
            # A relative name without a namespace means a node of this name in any namespace.
            pattern = name if prefix or str(key).startswith("/") else f"/**{name}"
            pattern = "/**" if str(key) in ("/**", "**") and not prefix else pattern
            for parameter, item in _flatten(value[_PARAMETERS_KEY] or {}, path):
                yield ParameterRule(pattern, parameter, item)
        nested = {k: v for k, v in value.items() if k != _PARAMETERS_KEY}
        if nested:
            yield from _node_rules(nested, name, path)


def _flatten(parameters: Any, path: str, prefix: str = "") -> Iterator[tuple[str, Any]]:
    if not isinstance(parameters, dict):
        raise RCLInvalidROSArgsError(f"Parameter file {path!r}: {parameters!r} is no mapping")
    for key, value in parameters.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict):
            yield from _flatten(value, path, f"{name}.")
        else:
            yield name, value


class _Loader(yaml.SafeLoader):
    """YAML as rcl reads it: 1e-3 is a number, and dates are strings."""


_Loader.yaml_implicit_resolvers = {
    key: [(tag, regexp) for tag, regexp in resolvers if not tag.endswith((":timestamp", ":float"))]
    for key, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(
        r"[-+]?(?:[0-9]+\.[0-9]*(?:[eE][-+]?[0-9]+)?|\.[0-9]+(?:[eE][-+]?[0-9]+)?"
        r"|[0-9]+[eE][-+]?[0-9]+|\.(?:inf|Inf|INF)|\.?(?:nan|NaN|NAN))"
    ),
    list("-+0123456789.nN"),
)


def _yaml(text: str, what: str) -> Any:
    try:
        return yaml.load(text, Loader=_Loader)
    except yaml.YAMLError as error:
        raise RCLInvalidROSArgsError(f"{what} is no YAML: {error}") from error
