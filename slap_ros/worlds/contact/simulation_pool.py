# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Contact simulations lent to worlds and used again."""

from __future__ import annotations

from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.contact.simulation import ContactSimulation
from slap_ros.worlds.simulation_pool import SimulationPool

_pool: SimulationPool[ContactScene, ContactSimulation] = SimulationPool(ContactSimulation)
acquire = _pool.acquire
close_idle = _pool.close_idle


def release(simulation: ContactSimulation) -> None:
    """Keep a simulation for the next world."""
    _pool.release(simulation.scene, simulation)
