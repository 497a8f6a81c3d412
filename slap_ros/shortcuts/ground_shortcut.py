# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A shortcut for given objects, as a skill: tried out in the model, then executed closed loop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from slap_ros.core import Action, Policy
from slap_ros.errors import InvalidStateError, SkillNotApplicableError
from slap_ros.policies.mlp_policy import Weights
from slap_ros.relational import Object, State
from slap_ros.shortcuts.observation_encoder import ObservationEncoder
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.shortcut_rollouts import ShortcutRollouts
from slap_ros.shortcuts.shortcut_trial import ShortcutRollout
from slap_ros.shortcuts.signature import Change

STATE_TOLERANCE = 1e-6  # in any feature's unit: up to here a state is as predicted
ROBOT_TOLERANCE = 0.02  # in any feature's unit: up to here a robot is where it was predicted


def least_steps(shortcut: Shortcut) -> int:
    """Half of a shortcut's shortest success in training, environment steps.

    An assumption, not a bound: sampling may find a way that is shorter still.
    """
    return max(1, shortcut.shortest // 2)


@dataclass(frozen=True)
class GroundShortcut:
    """A shortcut for given objects: the skill behind a shortcut edge.

    Args:
        shortcut: Learned shortcut that is applied to the objects.
        change: Change of atoms that the shortcut makes in this task.
        attempt: Number of the successful rollout that it follows, from 0, the shortest first.
        make_encoder: Gives the encoder of observations for that change, which most edges of a graph
            never need.
        rollouts: Rollouts in the model, in which the shortcut is tried out.
    """

    shortcut: Shortcut
    change: Change
    attempt: int
    make_encoder: Callable[[], ObservationEncoder] = field(compare=False, repr=False)
    rollouts: ShortcutRollouts = field(compare=False, repr=False)

    @property
    def encoder(self) -> ObservationEncoder:
        """Encoder of observations for the change; the same one for each attempt."""
        return self.make_encoder()

    @property
    def name(self) -> str:
        """The shortcut's name."""
        return self.shortcut.name

    @property
    def step_limit(self) -> int:
        """Environment steps after which it counts as failed."""
        return self.shortcut.step_limit(self.rollouts.sampling)

    @property
    def least_steps(self) -> int:
        """See :func:`least_steps`."""
        return least_steps(self.shortcut)

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """A number of environment steps, the same from every state; see :func:`least_steps`."""
        del state, objects
        return self.least_steps

    def raised_bound(self, state: State, objects: tuple[Object, ...], steps: int) -> int:
        """See :class:`~slap_ros.core.GradualSkill`; the first attempt alone is tried out."""
        del objects
        if self.attempt:
            return steps
        return self.rollouts.raised_bound(self.shortcut, self.encoder, state, steps)

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Try the shortcut out, and follow a successful rollout.

        Args:
            state: State in which the shortcut begins.
            objects: Objects that the shortcut is applied to, for the message.

        Returns:
            The policy that follows the rollout.

        Raises:
            SkillNotApplicableError: Not so many rollouts succeeded, or there can be none from what
                was perceived.
        """
        called = f"{self.name}({', '.join(obj.name for obj in objects)})"
        try:
            successes = self.rollouts.successes(self.shortcut, self.encoder, state)
        except InvalidStateError as error:
            raise SkillNotApplicableError(f"{called} cannot be tried out: {error}") from error
        if self.attempt >= len(successes):
            raise SkillNotApplicableError(
                f"{called} reaches its target {len(successes)} times within {self.step_limit} "
                f"steps in the model; attempt {self.attempt + 1} was asked for"
            )
        return RolloutFollower(self, successes[self.attempt], self.encoder.kept_grasp(state))

    def command(self, action: Weights) -> Action:
        """The robot's action for one of the policy's, from -1 to 1."""
        return self.encoder.action_map(action.astype(np.float64))


class RolloutFollower:
    """Follows a rollout as long as states are as predicted; then the policy, closed loop.

    Objects that are pushed never move quite as predicted in a real world, nor are they seen while
    they move. As long as the robot itself is where it should be, the rollout is still the best
    guess: it ends where the next option can begin, which the policy alone does not promise.

    Where the hand loses what it holds, which it does not in the rollout, and the shortcut has no
    gripper to take it again, the shortcut is over.
    """

    def __init__(self, skill: GroundShortcut, rollout: ShortcutRollout, grasp: int) -> None:
        """Begin at the first step of a rollout.

        Args:
            skill: Shortcut that is executed.
            rollout: Rollout to follow.
            grasp: Atoms about what is held that must stay as they are, a mask.
        """
        self._skill, self._grasp = skill, grasp
        after = (*rollout.states[1:], rollout.final)
        self._predicted: Sequence[tuple[State, Weights, State]] = list(
            zip(rollout.states, rollout.actions, after, strict=True)
        )
        self._step = 0
        self.foreseen: State | None = None

    def __call__(self, state: State) -> Action | None:
        """The next action; None where the shortcut cannot succeed any more."""
        self.foreseen = None
        held = self._skill.encoder.kept_grasp(state)
        if held != self._grasp and held != self._predicted_grasp():
            return None
        if self._step < len(self._predicted):
            predicted, action, after = self._predicted[self._step]
            if self._is_as_predicted(state, predicted):
                self._step += 1
                self.foreseen = after if state == predicted else None
                return self._skill.command(action)
        self._predicted = ()
        observations = self._skill.encoder.encode(state.alone()).observations
        return self._skill.command(self._skill.shortcut.policy.mean(observations)[0])

    def _predicted_grasp(self) -> int:
        """What is held by now in the rollout: what is pressed down is not, for a moment."""
        if self._step < len(self._predicted):
            return self._skill.encoder.kept_grasp(self._predicted[self._step][0])
        return self._grasp

    def _is_as_predicted(self, state: State, predicted: State) -> bool:
        off = np.abs(state.data - predicted.data)
        if off.max() <= STATE_TOLERANCE:
            return True
        own = self._skill.encoder.robot_columns
        return bool(own.size and off[own].max() <= ROBOT_TOLERANCE)
