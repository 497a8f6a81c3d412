# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The shortcut MDP (SLAP §4.2), many episodes side by side.

Initial states come from the graphs of the training tasks; -1 a step; terminal where the change is
done. Beyond the paper, as settings: a bonus at the end, shaping by a potential made of the
change's own atoms, an end where something was lost that cannot be had back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Domain
from slap_ros.relational import AtomSpace, State
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array
from slap_ros.shortcuts.action_map import ActionMap
from slap_ros.shortcuts.sight import Sight
from slap_ros.shortcuts.signature import Change, Signature


@dataclass(frozen=True)
class Start:
    """Where a shortcut begins, and what it is to change."""

    state: State
    space: AtomSpace
    change: Change

    @property
    def target(self) -> int:
        """The abstract state to reach."""
        return self.change.apply(self.space.abstract(self.state))


@dataclass(frozen=True)
class Rewards:
    """What a step is worth, in steps; all is multiplied by ``scale``.

    The paper's -1 a step, for ever, adds up to -1 / (1 - discount). Our default has the same
    optimum, but 0 for standing still and that much more for being done: a critic that begins at 0
    is then right about what nothing comes to, and nobody is afraid of the first touch.
    """

    step: float = 0.0
    done: float = 43.0
    lost: float = -5.0
    shaping: float = 1.0
    discount: float = 0.97
    scale: float = 0.1

    def of(self, gain: Array, done: Bools, lost: Bools) -> Array:
        """Rewards of steps that raised the potential by ``gain``, shape (n,).

        The gain is not discounted. Discounted (Ng et al. 1999), shaping changes no return but by
        a constant of the state, which the critic learns; what remains is what there is without
        shaping, and a policy that never succeeded yet finds that nothing is better than nothing.

        Losing ends the episode, so it must cost more than all steps that it saves.
        """
        worst = self.lost + self.step / (1.0 - self.discount)
        return self.scale * (
            self.step + self.done * done + self.shaping * gain + worst * (lost & ~done)
        )


@dataclass(frozen=True)
class Steps:
    """What one step of all episodes came to; ended episodes have begun anew."""

    observations: NDArray[np.float32]  # (n, size)
    rewards: Array  # (n,)
    done: Bools  # the change was achieved
    lost: Bools  # it cannot be any more
    late: Bools  # the horizon was reached first
    lengths: NDArray[np.intp]  # steps taken so far, or until the end
    last: NDArray[np.float32]  # observations before beginning anew, (n, size)

    @property
    def ended(self) -> Bools:
        """Whether the episode is over."""
        return self.done | self.lost | self.late


class Episodes(Protocol):
    """Episodes that are stepped together, wherever they are."""

    @property
    def episodes(self) -> int:
        """How many."""
        ...

    @property
    def horizon(self) -> int:
        """Steps of each at most."""
        ...

    @property
    def actions(self) -> ActionMap:
        """What the policy's actions are."""
        ...

    @property
    def observations(self) -> NDArray[np.float32]:
        """The present ones, shape (episodes, size)."""
        ...

    def step(self, actions: Array) -> Steps:
        """Take the policies' actions, shape (episodes, k), from -1 to 1."""
        ...


class Practice:
    """Episodes side by side. Those that share objects and change are stepped together."""

    def __init__(
        self,
        domain: Domain,
        signature: Signature,
        starts: Sequence[Start],
        episodes: int,
        horizon: int,
        rewards: Rewards,
        rng: np.random.Generator,
    ) -> None:
        """Begin ``episodes`` episodes of at most ``horizon`` steps from random ``starts``."""
        self.horizon, self._rewards = horizon, rewards
        pools = _pools(starts)
        shares = _shares([len(pool) for pool in pools], episodes)
        self._groups = [
            _Group(domain, signature, pool, share, rng)
            for pool, share in zip(pools, shares, strict=True)
            if share
        ]
        self.episodes = sum(group.size for group in self._groups)
        self.actions = self._groups[0].sight.actions
        self._lengths = np.zeros(self.episodes, dtype=np.intp)
        self.observations = np.concatenate([group.observations for group in self._groups])

    def step(self, actions: Array) -> Steps:
        """Take the policies' actions, shape (episodes, k), from -1 to 1."""
        self._lengths += 1
        late = self._lengths >= self.horizon
        commands = self.actions(actions)
        bounds = np.cumsum([group.size for group in self._groups])[:-1]
        parts = [
            group.step(command, timed_out)
            for group, command, timed_out in zip(
                self._groups, np.split(commands, bounds), np.split(late, bounds), strict=True
            )
        ]
        done, lost, before, after, last, now = (
            np.concatenate(values) for values in zip(*parts, strict=True)
        )
        gain = np.where(done, 0.0, after) - before
        lengths = self._lengths.copy()
        self._lengths[done | lost | late] = 0
        rewards = self._rewards.of(gain, done, lost)
        return Steps(now, rewards, done, lost & ~done, late & ~done & ~lost, lengths, last)


class _Group:
    """Episodes with the same objects and the same change."""

    def __init__(
        self,
        domain: Domain,
        signature: Signature,
        pool: Sequence[Start],
        size: int,
        rng: np.random.Generator,
    ) -> None:
        self.size, self._pool, self._rng = size, pool, rng
        self.sight = Sight(domain, pool[0].space, signature, pool[0].change)
        drawn = [self._draw() for _ in range(size)]
        self._targets = [start.target for start in drawn]
        self._worlds = domain.make_vector_world([start.state for start in drawn])
        self._look()

    def _draw(self) -> Start:
        return self._pool[int(self._rng.integers(len(self._pool)))]

    def _look(self) -> None:
        look = self.sight.look(self._worlds.states)
        self.observations, self._potential = look.observations, look.potential

    def step(self, commands: Array, late: Bools) -> tuple[NDArray[Any], ...]:
        """Done, lost, potentials before and after, last observations, present ones."""
        before = self._potential
        state = self._worlds.step(commands)
        look = self.sight.look(state)
        done = self.sight.done(state, look, self._targets)
        self.observations, self._potential = look.observations.copy(), look.potential.copy()
        self._begin_anew(np.flatnonzero(done | look.lost | late))
        return done, look.lost, before, look.potential, look.observations, self.observations

    def _begin_anew(self, ended: NDArray[np.intp]) -> None:
        if not ended.size:
            return
        starts = [self._draw() for _ in ended]
        for i, start in zip(ended, starts, strict=True):
            self._targets[i] = start.target
            self._worlds.reset(int(i), start.state)
        look = self.sight.look(State.batch([start.state for start in starts]))
        self.observations[ended], self._potential[ended] = look.observations, look.potential


def _pools(starts: Sequence[Start]) -> list[list[Start]]:
    """Starts by objects and change."""
    pools: dict[object, list[Start]] = {}
    for start in starts:
        pools.setdefault((start.space.layout.objects, start.change), []).append(start)
    return list(pools.values())


def _shares(sizes: Sequence[int], episodes: int) -> list[int]:
    """So many episodes for each pool, in proportion, the largest remainders rounded up."""
    exact = np.array(sizes) * episodes / sum(sizes)
    shares = np.floor(exact).astype(int)
    for i in np.argsort(shares - exact, kind="stable")[: episodes - shares.sum()]:
        shares[i] += 1
    return [int(share) for share in shares]
