# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A pool of simulations for worlds: building one takes longer than hundreds of steps.

Using one again is safe because it keeps no state between control periods that a world does not set.
"""

from __future__ import annotations

from collections import deque
from threading import RLock

from slap_ros.physics.scene import Scene
from slap_ros.physics.simulation import Simulation, Stepping

MAX_IDLE = 4  # simulations kept for later

_idle: deque[Simulation] = deque()  # the one that waited longest first
_lock = RLock()  # a world may be collected, and give back, while another is being made


def acquire(scene: Scene, stepping: Stepping) -> Simulation:
    """A simulation of the scene that nobody else uses."""
    with _lock:
        for _ in range(len(_idle)):
            simulation = _idle.popleft()
            if (simulation.scene, simulation.stepping) == (scene, stepping):
                return simulation
            _idle.append(simulation)
    return Simulation(scene, stepping)


def release(simulation: Simulation) -> None:
    """Keep a simulation for the next world; close the one that waited longest if there are many."""
    with _lock:
        _idle.append(simulation)
        if len(_idle) > MAX_IDLE:
            _idle.popleft().close()


def close_idle() -> None:
    """Close all simulations that no world uses."""
    with _lock:
        while _idle:
            _idle.popleft().close()
