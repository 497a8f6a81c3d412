# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A pool of simulations for worlds: building one takes longer than hundreds of steps.

Using one again is safe because it keeps no state between control periods that a world does not set.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from threading import RLock
from typing import Generic, Protocol, TypeVar

MAX_IDLE = 4  # simulations kept for later


class Closable(Protocol):
    """What holds a PyBullet client."""

    def close(self) -> None:
        """Give the client back."""
        ...


Key = TypeVar("Key")
Pooled = TypeVar("Pooled", bound=Closable)


class SimulationPool(Generic[Key, Pooled]):
    """Simulations of one kind that no world uses, by what they are simulations of."""

    def __init__(self, make: Callable[[Key], Pooled]) -> None:
        """``make``: builds one where none is idle."""
        self._make = make
        self._idle: deque[tuple[Key, Pooled]] = deque()  # the one that waited longest first
        self._lock = RLock()  # a world may be collected, and release, while another is being made

    def acquire(self, key: Key) -> Pooled:
        """A simulation of this that nobody else uses."""
        with self._lock:
            for _ in range(len(self._idle)):
                known, simulation = self._idle.popleft()
                if known == key:
                    return simulation
                self._idle.append((known, simulation))
        return self._make(key)

    def release(self, key: Key, simulation: Pooled) -> None:
        """Keep a simulation for the next world; of many, close the one that waited longest."""
        with self._lock:
            self._idle.append((key, simulation))
            if len(self._idle) > MAX_IDLE:
                self._idle.popleft()[1].close()

    def close_idle(self) -> None:
        """Close all simulations that no world uses."""
        with self._lock:
            while self._idle:
                self._idle.popleft()[1].close()
