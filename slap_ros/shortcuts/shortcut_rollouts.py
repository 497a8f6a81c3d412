# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rollouts of shortcuts in the planner's model: what a shortcut would do before it is used."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from hashlib import sha256

import numpy as np

from slap_ros.core import Domain, VectorWorld
from slap_ros.policies.mlp_policy import ActionSampler, SampledPolicy, Weights
from slap_ros.portable_math import on_grid
from slap_ros.relational import State
from slap_ros.shortcuts.observation_encoder import ObservationEncoder
from slap_ros.shortcuts.sampling import Sampling
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.signature import Change

MAX_NET_FAILURES = 3  # failures, less as many for each success, before a shortcut is given up
MAX_NOISE_SCALE = 2.0  # temperature of the last rollout of a batch against that of the first
MOST_KEPT = 2_000  # states for which successful rollouts are kept
SPREAD_DECAY = 0.7  # ratio of the spread of variations in one round to that in the round before


@dataclass(frozen=True)
class ShortcutRollout:
    """A successful rollout of a shortcut in the model.

    Args:
        actions: Actions of the policy, from -1 to 1, one per step.
        states: States in which the actions were chosen, one per step.
    """

    actions: tuple[Weights, ...]
    states: tuple[State, ...]

    @property
    def steps(self) -> int:
        """The number of environment steps."""
        return len(self.actions)


def _steps(rollout: ShortcutRollout) -> int:
    return rollout.steps


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


class ShortcutRollouts:
    """Tries shortcuts out in worlds of its own, and caches the successful rollouts.

    The outcome is a function of the shortcut, the change and the state: noise comes from a
    generator that is seeded with them. So planner, skill server and replay agree.
    """

    def __init__(self, domain: Domain, initial: State, sampling: Sampling) -> None:
        """Make the worlds.

        Args:
            domain: Domain of the worlds.
            initial: State with the objects of the task.
            sampling: Settings of how shortcuts are tried out.
        """
        self.sampling = sampling
        together = domain.steps_together
        self._count = (sampling.samples - 1) * (sampling.batch if together else 1)  # with noise
        self._at_once = self._count + 1 if together else 1
        self._world = domain.model_worlds([initial])
        self._worlds = domain.model_worlds([initial] * self._at_once) if together else self._world
        self._cache: dict[tuple[str, Change, bytes], tuple[ShortcutRollout, ...]] = {}
        self._failures: Counter[str] = Counter()  # of each shortcut, beyond those expected

    def successes(
        self, shortcut: Shortcut, encoder: ObservationEncoder, state: State
    ) -> tuple[ShortcutRollout, ...]:
        """Try a shortcut out.

        Args:
            shortcut: Shortcut to try out.
            encoder: Encoder of observations for the change to be made.
            state: State to begin in.

        Returns:
            The successful rollouts that are kept, the shortest first; none of a shortcut that
            was given up.
        """
        key = (shortcut.name, encoder.change, state.key)
        if key not in self._cache and self.given_up(shortcut):
            return ()
        if key not in self._cache:
            # The seed is a hash of the text of name and change, which must not be worded otherwise,
            # and of the state as far as it is the same on every processor.
            seed = sha256(repr(key[:2]).encode() + on_grid(state.data).tobytes()).digest()[:8]
            rng = np.random.default_rng(int.from_bytes(seed, "little"))
            self._cache[key] = self._sample(shortcut.policy, encoder, state, rng)
            self._failures[shortcut.name] += -MAX_NET_FAILURES if self._cache[key] else 1
            if len(self._cache) > MOST_KEPT:
                del self._cache[next(iter(self._cache))]  # the oldest
        return self._cache[key]

    def cached(self) -> Iterator[tuple[str, tuple[ShortcutRollout, ...]]]:
        """The name of each shortcut that was tried, and its successes, once for each state."""
        for (name, _, _), successes in self._cache.items():
            yield name, successes

    def given_up(self, shortcut: Shortcut) -> bool:
        """Whether a shortcut failed so often in this task that it is not tried any more."""
        return self._failures[shortcut.name] >= MAX_NET_FAILURES

    def _sample(
        self,
        policy: SampledPolicy,
        encoder: ObservationEncoder,
        state: State,
        rng: np.random.Generator,
    ) -> tuple[ShortcutRollout, ...]:
        """Roll out without noise, with noise, and in variations of the shortest."""
        sampling = self.sampling
        noise_scale = np.linspace(1.0, MAX_NOISE_SCALE, self._at_once, dtype=np.float32)
        temperature = (sampling.temperature * noise_scale)[:, None]

        def deterministic(_: int, observations: Weights) -> Weights:
            return policy.mean(observations)

        noisy = policy.sampler(rng, temperature)
        found = self._roll_out(self._world, encoder, state, deterministic, sampling.horizon)
        best = _BestRollouts(sampling.alternatives, next(iter(found), None))
        for failures in range(0, self._count, self._at_once):
            if not best.all and failures + 1 >= sampling.patience:
                break
            limit = best.limit(sampling.horizon)
            best.add(self._roll_out(self._worlds, encoder, state, noisy, limit))
        for number in range(sampling.refinements if best.all else 0):
            self._refine(best, encoder, state, sampling.spread * SPREAD_DECAY**number, rng)
        return tuple(best.all)

    def _refine(
        self,
        best: _BestRollouts,
        encoder: ObservationEncoder,
        state: State,
        spread: float,
        rng: np.random.Generator,
    ) -> None:
        """Try random variations of the shortest: a round of a cross-entropy search."""
        middle = np.clip(np.array(best.all[0].actions), -1.0, 1.0)[:, None]
        shape = (len(middle), self._at_once, middle.shape[-1])
        for _ in range(0, self._count + 1, self._at_once):
            noise = rng.standard_normal(shape, dtype=np.float32)
            script = _scripted(on_grid(middle + np.float32(spread) * noise))
            limit = best.limit(len(middle))
            best.add(self._roll_out(self._worlds, encoder, state, script, limit))

    def _roll_out(
        self,
        worlds: VectorWorld,
        encoder: ObservationEncoder,
        state: State,
        sample: ActionSampler,
        limit: int,
    ) -> list[ShortcutRollout]:
        """Roll out in all of the worlds until enough succeeded, for at most ``limit`` steps."""
        target = encoder.change.apply(encoder.space.abstract(state))
        count = len(worlds.states.data)
        for world in range(count):
            worlds.reset(world, state)
        states = worlds.states
        observations = encoder.encode(states).observations
        alive = np.ones(count, dtype=bool)
        past: list[tuple[State, Weights]] = []
        reached: list[ShortcutRollout] = []
        for step in range(limit):
            actions = sample(step, observations)
            past.append((states, actions))
            alive &= ~np.isnan(actions).any(axis=-1)  # a damaged policy may give no number
            states = worlds.step(encoder.action_map(np.nan_to_num(actions).astype(np.float64)))
            encoding = encoder.encode(states)
            success = alive & encoder.success(states, encoding, [target] * count)
            reached += [_rollout(past, int(world)) for world in np.flatnonzero(success)]
            alive &= ~success & ~encoding.failure
            if not alive.any() or len(reached) >= self.sampling.alternatives:
                break
            observations = encoding.observations
        return reached


def _rollout(past: Sequence[tuple[State, Weights]], world: int) -> ShortcutRollout:
    """The rollout that was made in one of the worlds, copied: a view would keep all of them."""
    return ShortcutRollout(
        tuple(actions[world].copy() for _, actions in past),
        tuple(State(states.layout, states.data[world].copy()) for states, _ in past),
    )


def _scripted(script: Weights) -> ActionSampler:
    return lambda step, _: script[step]
