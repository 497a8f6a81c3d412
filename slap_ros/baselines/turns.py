# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Learning where a controller and the options that it chooses take turns. Needs torch.

What the controller chose is judged by the task's reward until its next turn, what an option does by
the option's own reward until it is over (Henaff et al. 2025). Both are in one rollout, and a single
pass back through it gives the advantages of both.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import accumulate, pairwise
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.type_aliases import PyTorchObs
from stable_baselines3.common.vec_env import VecEnv
from torch.distributions import Categorical, Distribution, Normal

from slap_ros.baselines.option_rollouts import Durations, OptionRolloutBuffer, SuccessRewards
from slap_ros.baselines.scores import SHARPNESS

Floats = NDArray[np.float32]


class Turns(NamedTuple):
    """Whose turn it was in each of n environments, and what came of it; arrays of shape (n,).

    Attributes:
        controller: 1 where the controller chose, 0 where an option acted.
        intrinsic: Reward of the option that acted.
        over: 1 where the option ended with its action.
        controller_next: 1 where it is the controller's turn next.
    """

    controller: Floats
    intrinsic: Floats
    over: Floats
    controller_next: Floats


class TurnRewards(SuccessRewards):
    """Environments that keep whose turn it was; an episode out of steps has earned nothing."""

    def __init__(self, envs: VecEnv, durations: Durations, gamma: float) -> None:
        """See :class:`~slap_ros.baselines.option_rollouts.SuccessRewards`."""
        super().__init__(envs, durations, gamma)
        self.turns = Turns(*np.zeros((len(Turns._fields), envs.num_envs), np.float32))

    def step_wait(self) -> Any:
        """See stable-baselines3."""
        observations, rewards, dones, infos = super().step_wait()
        self.turns = Turns(
            *(np.array([info[name] for info in infos], np.float32) for name in Turns._fields)
        )
        for info in infos:
            info["TimeLimit.truncated"] = False
        return observations, rewards, dones, infos


class TurnBuffer(OptionRolloutBuffer):
    """A buffer of rollouts in which controller and options take turns."""

    def __init__(self, *args: Any, turns: Callable[[], Turns], **options: Any) -> None:
        """Make an empty buffer.

        Args:
            args: Arguments of stable-baselines3's buffer.
            turns: Function that says whose turn it was in the newest step.
            options: Further arguments of the buffer.
        """
        self._turns = turns
        super().__init__(*args, **options)

    def reset(self) -> None:
        """Forget all rollouts."""
        super().reset()
        shape = (len(Turns._fields), self.buffer_size, self.n_envs)
        self.taken = Turns(*np.zeros(shape, np.float32))

    def add(self, *args: Any) -> None:
        """Take an action of each environment, and whose turn it was."""
        for kept, newest in zip(self.taken, self._turns(), strict=True):
            kept[self.pos] = newest
        super().add(*args)

    def compute_returns_and_advantage(
        self, last_values: torch.Tensor, dones: NDArray[np.bool_]
    ) -> None:
        """Generalised advantages of choices over turns, and of an option's actions within it.

        A choice whose option is under way as the rollout ends is not judged.

        Args:
            last_values: Values of the states after the last action, of whose turn it is there.
            dones: Whether the episodes ended with the last action.
        """
        last = last_values.detach().cpu().numpy().flatten()
        goes_on = 1.0 - dones.astype(np.float32)
        choices = _Choices(last, self.taken.controller_next[-1], self.gae_lambda)
        option_value, option_advantage = last, np.zeros_like(last)
        for step in reversed(range(self.buffer_size)):
            value, turns = self.values[step], Turns(*(kept[step] for kept in self.taken))
            discount = goes_on * self.gamma ** self.durations[step]
            chosen = choices.before(self.rewards[step], discount, goes_on, value, turns.controller)
            stays = goes_on * (1.0 - turns.over) * self.gamma
            error = turns.intrinsic + stays * option_value - value
            acted = error + stays * self.gae_lambda * option_advantage
            self.advantages[step] = np.where(turns.controller, chosen, acted)
            option_value = np.where(turns.controller, option_value, value)
            option_advantage = np.where(turns.controller, option_advantage, acted)
            goes_on = 1.0 - self.episode_starts[step]
        self.returns = self.advantages + self.values


class _Choices:
    """Advantages of the controller's choices, from the last to the first."""

    def __init__(self, value: Floats, known: Floats, gae_lambda: float) -> None:
        """Begin at the end of a rollout.

        Args:
            value: Value of the state at the controller's next turn.
            known: 1 where this is the controller's turn, else 0.
            gae_lambda: Share of the advantage after the next turn that counts.
        """
        self._value, self._known, self._lambda = value, known, gae_lambda
        self._advantage = np.zeros_like(value)
        self._reward, self._discount = np.zeros_like(value), np.ones_like(value)

    def before(
        self, reward: Floats, discount: Floats, goes_on: Floats, value: Floats, controller: Floats
    ) -> Floats:
        """Go back by an action.

        Args:
            reward: Reward of the task for the action.
            discount: Discount of what follows the action; 0 at the end of an episode.
            goes_on: 0 where an episode ended with the action, else 1.
            value: Value of the state in which the action was taken.
            controller: 1 where the controller chose, else 0.

        Returns:
            The advantage of the action if the controller chose it; 0 where that is not known.
        """
        total = reward + discount * self._reward
        until = discount * self._discount
        known = np.where(goes_on > 0.0, self._known, 1.0)
        error = total + until * self._value - value
        advantage: Floats = known * (error + until * self._lambda * self._advantage)
        self._value = np.where(controller, value, self._value)
        self._advantage = np.where(controller, advantage, self._advantage)
        self._reward = np.where(controller, 0.0, total)
        self._discount = np.where(controller, 1.0, until)
        self._known = np.where(controller, 1.0, known)
        return advantage


class TurnPolicy(ActorCriticPolicy):
    """One network for the controller's choices and the joints; the observation says which count."""

    def __init__(
        self, *args: Any, axes: int, choices: tuple[int, ...], turn: int, **options: Any
    ) -> None:
        """Make the network.

        Args:
            args: Arguments of stable-baselines3's policy.
            axes: Number of the actions that move joints; the others are choices.
            choices: Number of ways to make each choice.
            turn: Place in the observation that is 1 on the controller's turn.
            options: Further arguments of stable-baselines3's policy.
        """
        self._axes, self._choices, self._turn = axes, choices, turn
        super().__init__(*args, **options)

    def forward(
        self, obs: torch.Tensor, deterministic: bool = False
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """See stable-baselines3."""
        joints, choices = self._both(obs)
        parts = [joints.mean if deterministic else _sampled(joints)]
        for choice in choices:
            chosen = choice.probs.argmax(-1) if deterministic else _sampled(choice)
            marked = torch.nn.functional.one_hot(chosen, choice.probs.shape[-1])
            parts.append(marked.to(obs.dtype))
        actions = torch.cat(parts, dim=-1)
        return actions, self.predict_values(obs), self._log_prob(obs, joints, choices, actions)

    def evaluate_actions(
        self, obs: PyTorchObs, actions: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor | None]:
        """See stable-baselines3."""
        assert isinstance(obs, torch.Tensor)
        joints, choices = self._both(obs)
        chosen = torch.stack([_entropy(choice) for choice in choices]).sum(0)
        entropy = torch.where(self._is_choice(obs), chosen, _entropy(joints).sum(-1))
        return self.predict_values(obs), self._log_prob(obs, joints, choices, actions), entropy

    def _is_choice(self, obs: torch.Tensor) -> torch.Tensor:
        """Whether it is the controller's turn."""
        return obs[:, self._turn] > 0.5

    def _each_choice(self, values: torch.Tensor) -> list[torch.Tensor]:
        """The values of each choice, which follow those that move joints."""
        ends = list(accumulate(self._choices, initial=self._axes))
        return [values[:, first:end] for first, end in pairwise(ends)]

    def _both(self, obs: torch.Tensor) -> tuple[Normal, list[Categorical]]:
        """How joints move, and what is chosen."""
        out = torch.tanh(self.action_net(self.mlp_extractor.forward_actor(obs)))
        spread = torch.exp(self.log_std[: self._axes]).expand(len(obs), -1)
        logits = self._each_choice(SHARPNESS * out)
        return Normal(out[:, : self._axes], spread), [Categorical(logits=one) for one in logits]

    def _log_prob(
        self,
        obs: torch.Tensor,
        joints: Normal,
        choices: list[Categorical],
        actions: torch.Tensor,
    ) -> torch.Tensor:
        """The likelihood of what counts: the choices, or how the joints move."""
        made = self._each_choice(actions)
        each = [
            _likelihood(choice, one.argmax(-1)) for choice, one in zip(choices, made, strict=True)
        ]
        moved = _likelihood(joints, actions[:, : self._axes]).sum(-1)
        return torch.where(self._is_choice(obs), torch.stack(each).sum(0), moved)


def _sampled(distribution: Distribution) -> torch.Tensor:
    sample: torch.Tensor = distribution.sample()
    return sample


def _entropy(distribution: Distribution) -> torch.Tensor:
    entropy: torch.Tensor = distribution.entropy()
    return entropy


def _likelihood(distribution: Distribution, values: torch.Tensor) -> torch.Tensor:
    likelihood: torch.Tensor = distribution.log_prob(values)
    return likelihood
