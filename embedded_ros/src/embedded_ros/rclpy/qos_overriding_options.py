# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""QoS that parameters override, such as ``qos_overrides./chatter.publisher.depth``."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from copy import copy
from enum import IntEnum
from typing import TYPE_CHECKING, Any

from embedded_ros.types import message_class

from .duration import Duration
from .exceptions import ParameterAlreadyDeclaredException
from .qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
)

if TYPE_CHECKING:
    from .node import Node

_NAMED: dict[QoSPolicyKind, type[IntEnum]] = {  # policies whose parameter is a name
    QoSPolicyKind.HISTORY: HistoryPolicy,
    QoSPolicyKind.RELIABILITY: ReliabilityPolicy,
    QoSPolicyKind.DURABILITY: DurabilityPolicy,
    QoSPolicyKind.LIVELINESS: LivelinessPolicy,
}


class InvalidQosOverridesError(Exception):
    """The profile that parameters ask for was refused by the node's own callback."""


class QoSOverridingOptions:
    """Which policies of a publisher or subscription have a parameter.

    Args:
        policy_kinds: Policies that have one.
        callback: Called with the profile that results; says whether it is accepted.
        entity_id: Suffix of the parameters' names, where a node has several on one topic.
    """

    def __init__(
        self,
        policy_kinds: Iterable[QoSPolicyKind],
        *,
        callback: Callable[[QoSProfile], Any] | None = None,
        entity_id: str | None = None,
    ) -> None:
        self._policy_kinds = tuple(policy_kinds)
        self._callback = callback
        self._entity_id = entity_id

    @property
    def policy_kinds(self) -> Iterable[QoSPolicyKind]:
        """Policies that have a parameter."""
        return self._policy_kinds

    @property
    def callback(self) -> Callable[[QoSProfile], Any] | None:
        """What is asked whether a profile is accepted."""
        return self._callback

    @property
    def entity_id(self) -> str | None:
        """Suffix of the parameters' names."""
        return self._entity_id

    @classmethod
    def with_default_policies(
        cls,
        *,
        callback: Callable[[QoSProfile], Any] | None = None,
        entity_id: str | None = None,
    ) -> QoSOverridingOptions:
        """Options with parameters for history, depth and reliability."""
        kinds = (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY)
        return cls(kinds, callback=callback, entity_id=entity_id)


def overridden(
    node: Node, entity: str, topic: str, qos: QoSProfile, options: QoSOverridingOptions | None
) -> QoSProfile:
    """The profile of a publisher or subscription, as its parameters have it.

    Args:
        node: Declares the parameters, read-only, with the profile's values as defaults.
        entity: ``publisher`` or ``subscription``.
        topic: Full name of the topic.
        qos: The profile where no parameter is given.
        options: Which policies have a parameter; None: none has.

    Raises:
        InvalidQosOverridesError: The options' callback refuses the profile.
        RuntimeError: A parameter names a value that its policy does not have.
    """
    if options is None:
        return qos
    found = copy(qos)
    suffix = f"_{options.entity_id}" if options.entity_id is not None else ""
    for kind in options.policy_kinds:
        if kind is QoSPolicyKind.LIFESPAN and entity == "subscription":
            continue
        policy = kind.name.lower()
        name = f"qos_overrides.{topic}.{entity}{suffix}.{policy}"
        value = _declared(node, name, _as_parameter(getattr(found, policy)))
        setattr(found, policy, _as_policy(kind, value))
    _require_accepted(options, found, topic)
    return found


def _declared(node: Node, name: str, default: Any) -> Any:
    descriptor: Any = message_class("rcl_interfaces/msg/ParameterDescriptor")()
    descriptor.description = f"QoS override of {name.split('.')[1]}"
    descriptor.read_only = True
    try:
        return node.declare_parameter(name, default, descriptor).value
    except ParameterAlreadyDeclaredException:  # a second publisher on the topic
        return node.get_parameter(name).value


def _as_parameter(value: Any) -> Any:
    if isinstance(value, IntEnum):
        return value.name.lower()
    return value.nanoseconds if isinstance(value, Duration) else value


def _as_policy(kind: QoSPolicyKind, value: Any) -> Any:
    if kind in _NAMED:
        try:
            return _NAMED[kind][value.upper()]
        except KeyError:
            policy = kind.name.lower()
            raise RuntimeError(
                f"Unexpected QoS override for policy `{policy}`: `{value}`"
            ) from None
    durations = (
        QoSPolicyKind.LIFESPAN,
        QoSPolicyKind.DEADLINE,
        QoSPolicyKind.LIVELINESS_LEASE_DURATION,
    )
    return Duration(nanoseconds=value) if kind in durations else value


def _require_accepted(options: QoSOverridingOptions, qos: QoSProfile, topic: str) -> None:
    if options.callback is None:
        return
    result = options.callback(qos)
    if not result.successful:
        raise InvalidQosOverridesError(f"QoS overrides of {topic} are not valid: {result.reason}")
