# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Hindsight experience replay where goals are atoms, most of which hold all the time.

stable-baselines3's buffer gives a transition all that a later state has achieved as its goal. Few
actions change an atom. So in nearly all transitions that goal holds already as they begin: a
success of length 0, which no task has and which teaches nothing. Here the goal is the atoms that
hold later and not yet, a few, as in tasks; where there are none, the transition keeps its own goal.
And a transition that reaches its goal ends its episode, as in tasks.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import HerReplayBuffer
from stable_baselines3.common.type_aliases import DictReplayBufferSamples

from slap_ros.baselines import stored_transitions
from slap_ros.baselines.stored_transitions import restore_transitions, transitions_of

PARTS = (*stored_transitions.PARTS, "ep_start", "ep_length")


class HindsightBuffer(HerReplayBuffer):
    """stable-baselines3's buffer of hindsight, with goals that are still to be achieved."""

    def _sample_goals(
        self, batch_indices: NDArray[Any], env_indices: NDArray[Any]
    ) -> NDArray[np.float32]:
        """The atoms of later states that do not hold yet; where there are none, the own goal."""
        later = super()._sample_goals(batch_indices, env_indices)
        own = self.observations["desired_goal"][batch_indices, env_indices]
        gained = later * (1.0 - self.observations["achieved_goal"][batch_indices, env_indices])
        goals: NDArray[np.float32] = np.where(gained.any(axis=-1, keepdims=True), gained, own)
        return goals

    def _get_virtual_samples(self, *args: Any, **options: Any) -> DictReplayBufferSamples:
        """Transitions with new goals, each of which ends where its goal is reached."""
        samples = super()._get_virtual_samples(*args, **options)
        ended = (samples.rewards == 0.0).to(samples.dones.dtype)
        return samples._replace(dones=torch.maximum(samples.dones, ended))

    # -- checkpoints ------------------------------------------------------------------------------

    def arrays(self) -> dict[str, NDArray[Any]]:
        """All transitions, as arrays; those of an episode that is under way are never sampled."""
        return transitions_of(self, PARTS)

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Take back what :meth:`arrays` gave.

        Raises:
            KeyError, ValueError: The arrays are of another buffer.
        """
        restore_transitions(self, arrays, PARTS)
        self._current_ep_start[:] = self.pos
