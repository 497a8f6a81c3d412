# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Behaviour cloning: a policy that does in an observation what was done there. Needs torch.

The action is predicted by least squares. A clone has the network of the policy that it imitates,
and runs without torch as that one does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn
from torch.nn import functional

from slap_ros.imitation.settings import CloningSettings
from slap_ros.imitation.trajectories import Trajectory
from slap_ros.learning.policy_export import exported_layers, weights_of
from slap_ros.policies.mlp_policy import MlpPolicy, ObservationNormalisation
from slap_ros.skills.skill import LearnedSkill

LEAST_NOISE = 1e-3  # of a clone that predicts every action exactly


@dataclass(frozen=True)
class Clone:
    """A skill that imitates another one.

    Args:
        skill: Skill with the policy that was cloned.
        transitions: Number of observations that the clone learned from.
        error: Root of the mean squared error of its actions there.
    """

    skill: LearnedSkill
    transitions: int
    error: float


def clone_skills(
    skills: Mapping[str, LearnedSkill],
    trajectories: Mapping[str, Sequence[Trajectory]],
    settings: CloningSettings,
    seed: int,
) -> dict[str, Clone]:
    """Clone skills from their trajectories, each for itself.

    Args:
        skills: Skills by operator name, of whose policies the clones have the networks.
        trajectories: Trajectories of each skill, one at least, by operator name.
        settings: Hyper-parameters.
        seed: Seed of weights and batches.

    Returns:
        The clones by operator name; operators and horizons are those of the skills.
    """
    return {
        name: _clone(skill, trajectories[name], settings, seed) for name, skill in skills.items()
    }


def _clone(
    skill: LearnedSkill, trajectories: Sequence[Trajectory], settings: CloningSettings, seed: int
) -> Clone:
    observations = np.concatenate([one.observations for one in trajectories])
    actions = np.concatenate([one.actions for one in trajectories])
    hidden = [len(bias) for _, bias in skill.policy.layers[:-1]]
    policy = clone_policy(observations, actions, hidden, settings, seed)
    error = float(np.sqrt(np.mean((policy.mean(observations) - actions) ** 2)))
    return Clone(replace(skill, policy=policy), len(observations), error)


def clone_policy(
    observations: NDArray[np.float32],
    actions: NDArray[np.float32],
    hidden: Sequence[int],
    settings: CloningSettings,
    seed: int,
) -> MlpPolicy:
    """Learn to predict actions from observations.

    Args:
        observations: Observations, shape (n, features).
        actions: Actions that were taken there, from -1 to 1, shape (n, actions).
        hidden: Units of each hidden layer.
        settings: Hyper-parameters.
        seed: Seed of weights and batches.

    Returns:
        The policy; its noise is what it cannot explain of the actions.
    """
    torch.set_num_threads(1)  # tiny networks: more threads only wait for one another
    normalisation = ObservationNormalisation.of(observations)
    seen, wanted = torch.from_numpy(normalisation(observations)), torch.from_numpy(actions)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        network = _network([seen.shape[1], *hidden, wanted.shape[1]])
        _fit(network, seen, wanted, settings)
    with torch.no_grad():
        squares = (network(seen).tanh() - wanted).square().mean(dim=0)
    names = [str(2 * i) for i in range(len(hidden) + 1)]
    return MlpPolicy(
        normalisation,
        exported_layers(weights_of(network), names),
        np.log(np.maximum(np.sqrt(squares.numpy()), LEAST_NOISE)),
        "relu",
        squashed=True,
    )


def _network(sizes: Sequence[int]) -> nn.Sequential:
    """Linear layers between these sizes, with an activation between each two of them."""
    parts: list[nn.Module] = []
    for inputs, outputs in pairwise(sizes):
        parts += [nn.Linear(inputs, outputs), nn.ReLU()]
    return nn.Sequential(*parts[:-1])


def _fit(
    network: nn.Module, seen: torch.Tensor, wanted: torch.Tensor, settings: CloningSettings
) -> None:
    """Fit a network's squashed outputs by least squares, in batches drawn at random."""
    optimiser = torch.optim.AdamW(
        network.parameters(),
        lr=settings.learning_rate,
        weight_decay=settings.weight_decay,
        fused=True,
    )
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, settings.updates)
    for _ in range(settings.updates):
        batch = torch.randint(len(seen), (settings.batch_size,))
        loss = functional.mse_loss(network(seen[batch]).tanh(), wanted[batch])
        optimiser.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        optimiser.step()
        schedule.step()
