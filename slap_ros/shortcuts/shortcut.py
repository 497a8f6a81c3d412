# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A learned shortcut."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from slap_ros.policies.mlp_policy import SampledPolicy
from slap_ros.shortcuts.sampling import Sampling
from slap_ros.shortcuts.signature import Signature


@dataclass(frozen=True)
class Shortcut:
    """A learned shortcut, for any objects.

    Args:
        signature: Lifted change that the shortcut makes.
        policy: Policy that makes the change.
        shortest: Environment steps of the shortest success in training; half of them is the
            lower bound that search assumes.
        record: Record of the training: figures by name.
        horizon: Environment steps for which it is tried out at least when planning, as all are for
            those of :class:`~slap_ros.shortcuts.sampling.Sampling`.
    """

    signature: Signature
    policy: SampledPolicy
    shortest: int
    record: Mapping[str, Any] = field(default_factory=dict, compare=False)
    horizon: int = 1

    @property
    def name(self) -> str:
        """The signature's name."""
        return self.signature.name

    def step_limit(self, sampling: Sampling) -> int:
        """Environment steps of a rollout when planning, at most.

        Args:
            sampling: Settings of how shortcuts are tried out.
        """
        return max(sampling.horizon, self.horizon)
