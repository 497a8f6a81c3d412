# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Simulations of the joint-space world, lent to worlds and used again."""

from __future__ import annotations

from slap_ros.worlds.joint_space.scene import Scene
from slap_ros.worlds.joint_space.simulation import Simulation, Stepping
from slap_ros.worlds.simulation_pool import SimulationPool

_pool: SimulationPool[tuple[Scene, Stepping], Simulation] = SimulationPool(
    lambda key: Simulation(*key)
)
close_idle = _pool.close_idle


def acquire(scene: Scene, stepping: Stepping) -> Simulation:
    """A simulation of the scene that nobody else uses."""
    return _pool.acquire((scene, stepping))


def release(simulation: Simulation) -> None:
    """Keep a simulation for the next world; close the one that waited longest if there are many."""
    _pool.release((simulation.scene, simulation.stepping), simulation)
