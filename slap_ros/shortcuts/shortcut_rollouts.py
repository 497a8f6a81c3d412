# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rollouts of shortcuts in the planner's model: what a shortcut would do before it is used."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from hashlib import sha256
from itertools import count

import numpy as np

from slap_ros.core import Domain
from slap_ros.portable_math import on_grid
from slap_ros.relational import State
from slap_ros.shortcuts.observation_encoder import ObservationEncoder
from slap_ros.shortcuts.sampling import Sampling
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.shortcut_trial import ShortcutRollout, ShortcutTrial, TrialWorlds
from slap_ros.shortcuts.signature import Change

MAX_NET_FAILURES = 3  # failures, less as many for each success, before a shortcut is given up
MOST_KEPT = 2_000  # states for which successful rollouts are kept
MOST_BEGUN = 16  # trials that are interrupted; each keeps the states of all its rollouts
# Variations of a success are assumed to take half of its steps or more.
VARIED = 2

Key = tuple[str, Change, bytes]


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
        self._worlds = TrialWorlds(domain, initial, sampling)
        self._cache: dict[Key, tuple[ShortcutRollout, ...]] = {}
        self._begun: dict[Key, ShortcutTrial] = {}
        self._failures: Counter[str] = Counter()  # of each shortcut
        self._successes: Counter[str] = Counter()

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
        if key not in self._cache:
            if not self._begin(key, shortcut, encoder, state):
                return ()
            self._finish(key)
        return self._cache[key]

    def raised_bound(
        self, shortcut: Shortcut, encoder: ObservationEncoder, state: State, steps: int
    ) -> int:
        """A lower bound of a shortcut's steps, by trying it out for as long as that takes.

        Args:
            shortcut: Shortcut to try out.
            encoder: Encoder of observations for the change to be made.
            state: State to begin in.
            steps: Environment steps that the shortcut takes at least.

        Returns:
            One more if it does not succeed in so few; ``steps`` if it may, or where it never does.
        """
        key = (shortcut.name, encoder.change, state.key)
        if key in self._cache or not self._begin(key, shortcut, encoder, state):
            return steps
        if self._begun[key].lasts(VARIED * steps):
            return steps + 1
        self._finish(key)
        return steps

    def cached(self) -> Iterator[tuple[str, tuple[ShortcutRollout, ...]]]:
        """The name of each shortcut that was tried, and its successes, once for each state."""
        for key in list(self._begun):
            self._finish(key)
        for (name, _, _), successes in self._cache.items():
            yield name, successes

    def given_up(self, shortcut: Shortcut) -> bool:
        """Whether a shortcut failed so often in this task that it is not tried any more.

        What was begun is finished where that decides about it.
        """
        mine = [key for key in self._begun if key[0] == shortcut.name]
        while mine and self._net_failures(shortcut.name) + len(mine) >= MAX_NET_FAILURES:
            first = self._first_to_end(mine)
            mine.remove(first)
            self._finish(first)
        return self._net_failures(shortcut.name) >= MAX_NET_FAILURES

    def _net_failures(self, name: str) -> int:
        return self._failures[name] - MAX_NET_FAILURES * self._successes[name]

    def forget_failures_since_now(self) -> Callable[[], None]:
        """See :class:`~slap_ros.planning.shortcut_source.ShortcutSource`."""
        before = self._failures.copy()

        def forget() -> None:
            self._failures = before.copy()

        return forget

    def _first_to_end(self, keys: Sequence[Key]) -> Key:
        """The trial that succeeds, or has failed, after the fewest steps: one success decides."""
        for steps in count(1):
            for key in keys:
                if not self._begun[key].lasts(steps):
                    return key
        raise AssertionError("trials end")

    def _begin(
        self, key: Key, shortcut: Shortcut, encoder: ObservationEncoder, state: State
    ) -> bool:
        """Begin a trial unless it was begun before; whether there is one."""
        if key in self._begun:
            return True
        if self.given_up(shortcut):
            return False
        # The seed is a hash of the text of name and change, which must not be worded otherwise,
        # and of the state as far as it is the same on every processor.
        seed = sha256(repr(key[:2]).encode() + on_grid(state.data).tobytes()).digest()[:8]
        rng = np.random.default_rng(int.from_bytes(seed, "little"))
        if len(self._begun) == MOST_BEGUN:
            self._finish(next(iter(self._begun)))  # the oldest
        limit = shortcut.step_limit(self.sampling)
        self._begun[key] = ShortcutTrial(self._worlds, shortcut.policy, encoder, state, rng, limit)
        return True

    def _finish(self, key: Key) -> None:
        """Finish a trial, and keep what came of it."""
        self._cache[key] = self._begun.pop(key).successes()
        outcomes = self._successes if self._cache[key] else self._failures
        outcomes[key[0]] += 1
        if len(self._cache) > MOST_KEPT:
            del self._cache[next(iter(self._cache))]  # the oldest
