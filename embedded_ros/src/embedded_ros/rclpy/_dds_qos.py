# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""QoS profiles as DDS policies, and back."""

from __future__ import annotations

from typing import Any

from cyclonedds.core import Policy, Qos

from .duration import Duration, Infinite
from .qos import (
    DurabilityPolicy,
    HistoryPolicy,
    InvalidQoSProfileException,
    LivelinessPolicy,
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
)

# How long a full reliable writer may block before publishing fails.
MAX_BLOCKING_NS = 100_000_000

# DDS's policy numbers, as in its incompatible QoS statuses.
_POLICY_KINDS = {
    2: QoSPolicyKind.DURABILITY,
    4: QoSPolicyKind.DEADLINE,
    8: QoSPolicyKind.LIVELINESS,
    11: QoSPolicyKind.RELIABILITY,
    13: QoSPolicyKind.HISTORY,
}


def to_policies(profile: QoSProfile) -> list[Any]:
    """The DDS policies of a profile.

    Raises:
        InvalidQoSProfileException: The profile asks for what is not provided.
    """
    history = (
        Policy.History.KeepAll
        if profile.history == HistoryPolicy.KEEP_ALL
        else Policy.History.KeepLast(max(1, profile.depth))
    )
    policies: list[Any] = [history]
    if profile.reliability == ReliabilityPolicy.BEST_EFFORT:
        policies.append(Policy.Reliability.BestEffort)
    elif profile.reliability in (ReliabilityPolicy.RELIABLE, ReliabilityPolicy.SYSTEM_DEFAULT):
        policies.append(Policy.Reliability.Reliable(MAX_BLOCKING_NS))
    else:
        raise InvalidQoSProfileException(f"{profile.reliability!r} is not part of embedded_ros")
    if profile.durability == DurabilityPolicy.TRANSIENT_LOCAL:
        policies.append(Policy.Durability.TransientLocal)
        # What late joiners get: without it CycloneDDS replays the last sample only.
        policies.append(Policy.DurabilityService(0, history, -1, -1, -1))
    elif profile.durability in (DurabilityPolicy.VOLATILE, DurabilityPolicy.SYSTEM_DEFAULT):
        policies.append(Policy.Durability.Volatile)
    else:
        raise InvalidQoSProfileException(f"{profile.durability!r} is not part of embedded_ros")
    if _is_given(profile.deadline):
        policies.append(Policy.Deadline(profile.deadline.nanoseconds))
    if _is_given(profile.lifespan):
        policies.append(Policy.Lifespan(profile.lifespan.nanoseconds))
    policies += _liveliness(profile)
    return policies


def from_qos(qos: Qos) -> QoSProfile:
    """The profile of a discovered endpoint."""
    reliability = qos[Policy.Reliability]
    durability = qos[Policy.Durability]
    history = qos[Policy.History]
    keep_last = history is not None and "KeepLast" in repr(history)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST if keep_last else HistoryPolicy.KEEP_ALL,
        depth=history.depth if keep_last else 0,
        reliability=(
            ReliabilityPolicy.RELIABLE
            if "Reliable" in repr(reliability)
            else ReliabilityPolicy.BEST_EFFORT
        ),
        durability=(
            DurabilityPolicy.TRANSIENT_LOCAL
            if "TransientLocal" in repr(durability)
            else DurabilityPolicy.VOLATILE
        ),
        deadline=_from_ns(qos[Policy.Deadline].deadline),
        lifespan=_from_ns(qos[Policy.Lifespan].lifespan) if qos[Policy.Lifespan] else Infinite,
        liveliness=LivelinessPolicy.AUTOMATIC,
        liveliness_lease_duration=_from_ns(qos[Policy.Liveliness].lease_duration),
    )


def policy_kind(dds_policy: int) -> QoSPolicyKind:
    """Which policy a DDS policy number means."""
    return _POLICY_KINDS.get(dds_policy, QoSPolicyKind.INVALID)


def _liveliness(profile: QoSProfile) -> list[Any]:
    if profile.liveliness not in (LivelinessPolicy.AUTOMATIC, LivelinessPolicy.SYSTEM_DEFAULT):
        raise InvalidQoSProfileException(f"{profile.liveliness!r} is not part of embedded_ros")
    if not _is_given(profile.liveliness_lease_duration):
        return []
    return [Policy.Liveliness.Automatic(profile.liveliness_lease_duration.nanoseconds)]


def _is_given(duration: Duration) -> bool:
    return duration.nanoseconds not in (0, Infinite.nanoseconds)


def _from_ns(nanoseconds: int) -> Duration:
    return Infinite if nanoseconds >= Infinite.nanoseconds else Duration(nanoseconds=nanoseconds)
