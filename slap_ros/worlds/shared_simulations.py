# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Simulations that all worlds of a scene share: a PyBullet client takes 36 MB, and 40 ms to make.

Sharing one is safe because it keeps no state between control periods that a world does not set.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable
from threading import RLock
from typing import Generic, TypeVar
from weakref import WeakValueDictionary, finalize

from slap_ros.worlds.bullet import pybullet

MOST_KEPT = 4  # simulations that stay when no world uses them any more


class BulletClient:
    """A PyBullet client, closed when nothing refers to it any more."""

    def __init__(self) -> None:
        self.client: int = pybullet.connect(pybullet.DIRECT)
        self.lock = RLock()  # to be held by whoever computes: worlds of other threads share it
        self._closing = finalize(self, pybullet.disconnect, self.client)
        self._closing.atexit = False  # a process that ends has nothing to give back

    def close(self) -> None:
        """Give the client back at once."""
        self._closing()


Key = TypeVar("Key", bound=Hashable)
Shared = TypeVar("Shared", bound=BulletClient)


class SharedSimulations(Generic[Key, Shared]):
    """Simulations of one kind, one of each scene."""

    def __init__(self, make: Callable[[Key], Shared]) -> None:
        """``make``: builds the simulation of a scene that has none."""
        self._make = make
        self._known: WeakValueDictionary[Key, Shared] = WeakValueDictionary()
        self._kept: deque[Shared] = deque(maxlen=MOST_KEPT)  # the one used last at the end
        self._lock = RLock()

    def of(self, key: Key) -> Shared:
        """The simulation of a scene, which stays for as long as a world refers to it."""
        with self._lock:
            simulation = self._known.get(key)
            if simulation is None:
                simulation = self._known[key] = self._make(key)
            if simulation in self._kept:
                self._kept.remove(simulation)
            self._kept.append(simulation)
            return simulation

    def forget(self) -> None:
        """Keep none: the next world of a scene has a new one; worlds that are there have theirs."""
        with self._lock:
            self._kept.clear()
            self._known.clear()
