# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A shortcut tried out from one state: without noise, with noise, and in variations of the best.

Where worlds are stepped together, a trial goes as far as it is asked to: search mostly wants to
know only whether a shortcut is fast enough to matter. Whoever goes on later gets the same successes
to the bit, since the next states are a function of the states alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from slap_ros.core import Domain, VectorWorld
from slap_ros.policies.mlp_policy import ActionSampler, SampledPolicy, Weights
from slap_ros.portable_math import on_grid
from slap_ros.relational import State
from slap_ros.shortcuts.observation_encoder import Encoding, ObservationEncoder
from slap_ros.shortcuts.sampling import Sampling

MAX_NOISE_SCALE = 2.0  # temperature of the last rollout of a batch against that of the first
SPREAD_DECAY = 0.7  # ratio of the spread of variations in one round to that in the round before

# From a step and what is known of the states to actions, shape (n, actions).
Actor = Callable[[int, Encoding], Weights]


@dataclass(frozen=True)
class ShortcutRollout:
    """A successful rollout of a shortcut in the model.

    Args:
        actions: Actions of the policy, from -1 to 1, one per step.
        states: States in which the actions were chosen, one per step.
        final: State in which it ended.
    """

    actions: tuple[Weights, ...]
    states: tuple[State, ...]
    final: State

    @property
    def steps(self) -> int:
        """The number of environment steps."""
        return len(self.actions)


class TrialWorlds:
    """The worlds in which the shortcuts of a task are tried out."""

    def __init__(self, domain: Domain, initial: State, sampling: Sampling) -> None:
        """Find out how many worlds are stepped at once.

        Args:
            domain: Domain of the worlds.
            initial: State with the objects of the task.
            sampling: Settings of how shortcuts are tried out.
        """
        self.sampling = sampling
        self._domain = domain
        self.stepped_together = together = domain.steps_together
        self.noisy = (sampling.samples - 1) * (sampling.batch if together else 1)
        self.at_once = self.noisy + 1 if together else 1
        # Others are slow to make, but then they are used for one rollout after the other.
        self._only = None if together else domain.model_worlds([initial])

    def begin(self, state: State, count: int) -> VectorWorld:
        """So many worlds that begin in a state; where they are not stepped together, the only one.

        Args:
            state: State to begin in.
            count: Number of worlds.
        """
        if self._only is None:
            return self._domain.model_worlds([state] * count)
        self._only.reset(0, state)
        return self._only

    def batches(self, rollouts: int) -> range:
        """The batches in which so many rollouts are made: how many were made before each."""
        return range(0, rollouts, self.at_once)


class _TrialStart:
    """The state in which all rollouts of a trial begin, and what is known of it, found out once."""

    def __init__(self, worlds: TrialWorlds, encoder: ObservationEncoder, state: State) -> None:
        """Abstract the state.

        Args:
            worlds: Worlds in which rollouts begin.
            encoder: Encoder for the change to be made.
            state: State to begin in.
        """
        self.worlds, self.encoder, self._state = worlds, encoder, state
        self.target = encoder.change.apply(encoder.space.abstract(state))
        self._encodings: dict[int, tuple[State, Encoding]] = {}

    def begin(self, count: int) -> VectorWorld:
        """See :meth:`TrialWorlds.begin`."""
        return self.worlds.begin(self._state, count)

    def encoded(self, count: int) -> tuple[State, Encoding]:
        """The state so many times, as a batch, and its encoding.

        Args:
            count: Number of rollouts that are stepped together.
        """
        if count not in self._encodings:
            data = np.repeat(self._state.data[None], count, axis=0)
            states = State(self._state.layout, data)
            self._encodings[count] = states, self.encoder.encode(states)
        return self._encodings[count]


class RolloutBatch:
    """Rollouts from one state, step by step, in worlds that are stepped together."""

    def __init__(self, start: _TrialStart, act: Actor, limit: int, count: int = 1) -> None:
        """Begin where all rollouts of the trial do.

        Args:
            start: Gives the worlds with the first step, so that other rollouts may end before.
            act: Gives the actions of each step.
            limit: Environment steps of a rollout at most.
            count: Number of rollouts.
        """
        self._begin = partial(start.begin, count)
        self._worlds: VectorWorld | None = None
        self._encoder, self._act = start.encoder, act
        self._limit, self._enough = limit, start.worlds.sampling.alternatives
        self._targets = [start.target] * count
        self.states, self._encoding = start.encoded(count)
        self._alive = np.ones(count, dtype=bool)
        self._past: list[tuple[State, Weights]] = []
        self.reached: list[ShortcutRollout] = []

    @property
    def steps(self) -> int:
        """Environment steps so far."""
        return len(self._past)

    @property
    def is_over(self) -> bool:
        """Whether enough rollouts succeeded, or no other can."""
        return (
            self.steps >= self._limit or len(self.reached) >= self._enough or not self._alive.any()
        )

    def run(self) -> list[ShortcutRollout]:
        """The successes, in the order in which they end."""
        while not self.is_over:
            self.step()
        return self.reached

    def step(self) -> None:
        """Step all rollouts once."""
        if self._worlds is None:
            self._worlds = self._begin()
        actions = self._act(self.steps, self._encoding)
        self._past.append((self.states, actions))
        if np.isnan(actions.sum()):  # a damaged policy may give no number
            self._alive &= ~np.isnan(actions).any(axis=-1)
            actions = np.nan_to_num(actions)
        commands = self._encoder.action_map(actions.astype(np.float64))
        self.states = self._worlds.step(commands)
        self._encoding = encoding = self._encoder.encode(self.states)
        success = self._alive & self._encoder.success(self.states, encoding, self._targets)
        for world in np.flatnonzero(success).tolist():
            self.reached.append(_rollout(self._past, self.states, world))
        self._alive &= ~success & ~encoding.failure


@dataclass
class _BestRollouts:
    """Successful rollouts: the one without noise, and the shortest others."""

    alternatives: int  # number of others at most
    deterministic: ShortcutRollout | None
    others: list[ShortcutRollout] = field(default_factory=list)  # the shortest first

    @property
    def all(self) -> list[ShortcutRollout]:
        """All rollouts, the shortest first."""
        deterministic = [] if self.deterministic is None else [self.deterministic]
        return sorted((*deterministic, *self.others), key=_steps)

    def limit(self, most: int) -> int:
        """Environment steps, ``most`` or fewer, within which one more would be kept."""
        if len(self.others) < self.alternatives:
            return most
        return min(most, self.others[-1].steps - 1)

    def add(self, rollouts: Sequence[ShortcutRollout]) -> None:
        """Keep the shortest of these rollouts and those kept so far."""
        self.others = sorted((*self.others, *rollouts), key=_steps)[: self.alternatives]


class ShortcutTrial:
    """A shortcut that is tried out for one change from one state."""

    def __init__(
        self,
        worlds: TrialWorlds,
        policy: SampledPolicy,
        encoder: ObservationEncoder,
        state: State,
        rng: np.random.Generator,
        limit: int,
    ) -> None:
        """Begin with no steps made.

        Args:
            worlds: Worlds in which the shortcut is tried out.
            policy: Policy of the shortcut.
            encoder: Encoder of observations for the change to be made.
            state: State to begin in.
            rng: Generator that draws the noise of this trial alone.
            limit: Environment steps of a rollout at most.
        """
        self._worlds, self._sampling, self._rng = worlds, worlds.sampling, rng
        self._start, self._limit = _TrialStart(worlds, encoder, state), limit
        scale = np.linspace(1.0, MAX_NOISE_SCALE, worlds.at_once, dtype=np.float32)
        temperature = (self._sampling.temperature * scale)[:, None]
        self._sample = _observing(policy.sampler(rng, temperature))
        self._deterministic = _DeterministicRollout(RolloutBatch(self._start, _mean(policy), limit))
        self._noisy = self._batch(self._sample, limit)  # the first of them

    def lasts(self, steps: int) -> bool:
        """Whether no rollout, of those made before variations, succeeds within so many steps.

        False as well where nothing else is left to be tried, or where rollouts are made one after
        the other, so that the last one begins when the others have ended.

        Args:
            steps: Environment steps.
        """
        if not self._worlds.stepped_together or not self._worlds.noisy:
            return False
        if self._sampling.patience <= 1:  # without a success, noise is not even tried
            return False
        while self._noisy.steps < steps and not self._noisy.is_over and not self._has_success:
            self._noisy.step()
            self._deterministic.step()
        return not self._noisy.is_over and not self._has_success

    @property
    def _has_success(self) -> bool:
        return bool(self._deterministic.reached or self._noisy.reached)

    def successes(self) -> tuple[ShortcutRollout, ...]:
        """Roll out without noise, with noise, and in variations of the shortest, to the end.

        Returns:
            The successful rollouts that are kept, the shortest first.
        """
        sampling = self._sampling
        best = _BestRollouts(sampling.alternatives, self._deterministic.run())
        for failures in self._worlds.batches(self._worlds.noisy):
            if not best.all and failures + 1 >= sampling.patience:
                break
            batch = self._noisy
            if failures:
                batch = self._batch(self._sample, best.limit(self._limit))
            best.add(batch.run())
        for number in range(sampling.refinements if best.all else 0):
            self._refine(best, sampling.spread * SPREAD_DECAY**number)
        return tuple(best.all)

    def _refine(self, best: _BestRollouts, spread: float) -> None:
        """Try random variations of the shortest: a round of a cross-entropy search."""
        middle = np.clip(np.array(best.all[0].actions), -1.0, 1.0)[:, None]
        shape = (len(middle), self._worlds.at_once, middle.shape[-1])
        for _ in self._worlds.batches(self._worlds.noisy + 1):
            noise = self._rng.standard_normal(shape, dtype=np.float32)
            script = _scripted(on_grid(middle + np.float32(spread) * noise))
            best.add(self._batch(script, best.limit(len(middle))).run())

    def _batch(self, act: Actor, limit: int) -> RolloutBatch:
        return RolloutBatch(self._start, act, limit, self._worlds.at_once)


class _DeterministicRollout:
    """The rollout without noise: in a state that comes again it would go round for ever."""

    def __init__(self, batch: RolloutBatch) -> None:
        self._batch = batch
        self._seen: set[bytes] = set()
        self._goes_round = False

    @property
    def reached(self) -> list[ShortcutRollout]:
        """The rollout, if it has succeeded."""
        return self._batch.reached

    def step(self) -> None:
        """Step once, if that may still lead to the target."""
        if not self._is_over:
            self._seen.add(self._batch.states.key)
            self._batch.step()
            self._goes_round = self._batch.states.key in self._seen

    def run(self) -> ShortcutRollout | None:
        """The rollout to its end; None if that is not the target."""
        while not self._is_over:
            self.step()
        return next(iter(self.reached), None)

    @property
    def _is_over(self) -> bool:
        return self._goes_round or self._batch.is_over


def _steps(rollout: ShortcutRollout) -> int:
    return rollout.steps


def _rollout(past: Sequence[tuple[State, Weights]], now: State, world: int) -> ShortcutRollout:
    """The rollout that was made in one of the worlds, up to now."""
    return ShortcutRollout(
        tuple(actions[world].copy() for _, actions in past),
        tuple(_alone(states, world) for states, _ in past),
        _alone(now, world),
    )


def _alone(states: State, world: int) -> State:
    """The state of one of the worlds, copied: a view would keep all of them."""
    return State(states.layout, states.data[world].copy())


def _mean(policy: SampledPolicy) -> Actor:
    return lambda _, encoding: policy.mean(encoding.observations)


def _observing(sample: ActionSampler) -> Actor:
    return lambda step, encoding: sample(step, encoding.observations)


def _scripted(script: Weights) -> Actor:
    return lambda step, _: script[step]
