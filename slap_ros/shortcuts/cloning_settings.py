# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Hyper-parameters of cloning, in a module of their own that does not import torch."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

LATER = (
    "horizon",
    "anywhere",
    "disturbed",
    "disturbance",
)  # settings that came later, which change nothing where not given


@dataclass(frozen=True)
class ShortcutCloningSettings:
    """Hyper-parameters of cloning, under the names of stable-baselines3 where it has them.

    Args:
        straightened: Number of stretches that are tried to make the execution of skills in each
            start shorter.
        epochs: Number of times that each step of these executions is learned from.
        batch_size: Number of steps of an update.
        learning_rate: Learning rate in the beginning; it falls, linearly, to a twentieth.
        net_arch: Units of each hidden layer.
        noise: Standard deviation of the noise on the policy's actions when a shortcut is tried
            out, of -1 to 1. The sampling's temperature multiplies it.
        gamma: Discount per environment step of the rewards, of which only figures are made.
        n_envs: Number of environments in which the policy is measured.
        parts: Number of parts that the environments are divided into.
        total_steps: Environment steps in which the policy is measured.
        horizon: Environment steps for which a shortcut is tried out at least when planning, as all
            are for those of :class:`~slap_ros.shortcuts.sampling.Sampling`.
        anywhere: Whether a start is drawn from all places where operators lead on by the shortcut,
            and not taken after the same operators each time.
        disturbed: Number of times that each execution is made again with noise, to learn how to
            come back to it.
        disturbance: Standard deviation of that noise, of actions from -1 to 1.
    """

    straightened: int = 120
    epochs: int = 150
    batch_size: int = 128
    learning_rate: float = 1e-3
    net_arch: tuple[int, ...] = (128, 128)
    noise: float = 0.05
    gamma: float = 0.97
    n_envs: int = 16
    parts: int = 1
    total_steps: int = 4_000
    horizon: int = 1
    anywhere: bool = False
    disturbed: int = 0
    disturbance: float = 0.2

    @property
    def repetitions(self) -> int:
        """Number of times that each execution is made again, to see what a policy observes."""
        return 1 + self.disturbed

    @property
    def rollout_steps(self) -> int:
        """Environment steps between two reports, all environments together."""
        return self.n_envs

    def as_json(self) -> dict[str, Any]:
        """A JSON object, without what work folders lack from when there was no other way."""
        values = [(field, getattr(self, field.name)) for field in fields(self)]
        return {
            field.name: value
            for field, value in values
            if field.name not in LATER or value != field.default
        }
