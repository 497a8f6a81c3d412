# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a Markov state costs in other engines: ``python -m benchmarks.markov ENGINE [--json]``.

``pymunk``: KinDER's DynObstruction2D (see ``examples/kinder_obstruction``), running on against
rebuilt in each step, taking turns. ``mujoco``: a row of blocks that a slider pushes, reset to
positions, velocities and activations, or to those and ``qacc_warmstart``. Each says how many steps
come out differently from a reset, and steps a second of CPU time.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

import numpy as np

from benchmarks.printing import show
from slap_ros.relational import State
from slap_ros.relational.state import Array

STEPS = 200
TURNS = 3  # of one variant and the other, as others share the machine
BLOCKS = 6
SUBSTEPS = 20
MODEL = """<mujoco><option timestep="0.005"/><worldbody><geom type="plane" size="5 5 .1"/>{blocks}
<body pos="-.5 0 .1"><joint type="slide" axis="1 0 0" damping="5" name="x"/>
<geom type="box" size=".05 .1 .05" mass="1"/></body></worldbody>
<actuator><velocity joint="x" kv="50"/></actuator></mujoco>"""
BLOCK = """<body pos="{x} 0 {z}"><freejoint/>
<geom type="box" size=".05 .05 .05" mass=".2"/></body>"""


def steps_per_s(*variants: Callable[[], Any]) -> list[float]:
    """Steps a second of CPU time of each variant, which makes ``STEPS``; the median of turns."""
    seconds: list[list[float]] = [[] for _ in variants]
    for _ in range(TURNS):
        for number, variant in enumerate(variants):
            began = process_time()
            variant()
            seconds[number].append(process_time() - began)
    return [STEPS / median(each) for each in seconds]


def pymunk() -> dict[str, Any]:
    """KinDER's environment, running on and rebuilt."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "examples" / "kinder_obstruction"))
    import kinder_obstruction
    from kinder_obstruction.environment import BRIDGE

    domain = kinder_obstruction.make()
    initial = domain.task(0).initial_state
    space, rng = domain.action_space, np.random.default_rng(0)
    actions = rng.uniform(space.low, space.high, (STEPS, len(space.low)))

    def run_on() -> list[Array]:
        simulator = BRIDGE.simulator(initial)
        return [simulator.step(action).data for action in actions]

    def rebuilt() -> list[Array]:
        world = domain.make_world(initial)
        return [world.step(action).data for action in actions]

    figures: dict[str, Any] = {}
    for name, run in (("running_on", run_on), ("rebuilt", rebuilt)):
        after = run()
        states = [initial.data, *after[:-1]]
        differing = 0
        for data, action, expected in zip(states, actions, after, strict=True):
            found = BRIDGE.simulator(State(initial.layout, data)).step(action).data
            differing += not np.array_equal(found, expected)
        figures[name] = {"differing": differing, "of": STEPS}
    for name, rate in zip(figures, steps_per_s(run_on, rebuilt), strict=True):
        figures[name]["steps_per_s"] = rate
    return figures


def mujoco() -> dict[str, Any]:
    """Blocks that are pushed, reset with and without the warm start."""
    import mujoco as engine

    blocks = "".join(
        BLOCK.format(x=0.12 * (i % 3), z=0.06 + 0.105 * (i // 3)) for i in range(BLOCKS)
    )
    model = engine.MjModel.from_xml_string(MODEL.format(blocks=blocks))
    commands = np.random.default_rng(0).uniform(-1.0, 1.0, STEPS)
    figures = {}
    for name, parts in (
        ("qpos, qvel, act", ("qpos", "qvel", "act")),
        ("with qacc_warmstart", ("qpos", "qvel", "act", "qacc_warmstart")),
    ):
        world = _MujocoWorld(engine, model, parts)

        def run_on(world: _MujocoWorld = world) -> list[Array]:
            world.reset(world.initial)
            return [world.step(command) for command in commands]

        def reset_each_step(world: _MujocoWorld = world) -> None:
            state = world.initial
            for command in commands:
                world.reset(state)
                state = world.step(command)

        after = run_on()
        states = [world.initial, *after[:-1]]
        differing = 0
        for i in np.random.default_rng(1).permutation(STEPS):
            world.reset(states[i])
            differing += not np.array_equal(world.step(commands[i]), after[i])
        rates = steps_per_s(run_on, reset_each_step)
        figures[name] = {
            "differing": differing,
            "of": STEPS,
            "running_on_steps_per_s": rates[0],
            "reset_each_step_steps_per_s": rates[1],
        }
    return figures


class _MujocoWorld:
    """A model whose state is some arrays of its data."""

    def __init__(self, engine: Any, model: Any, parts: tuple[str, ...]) -> None:
        self._engine, self._model, self._parts = engine, model, parts
        self._data = engine.MjData(model)
        self.initial = self._state()

    def _state(self) -> Array:
        return np.concatenate([getattr(self._data, part) for part in self._parts])

    def reset(self, state: Array) -> None:
        self._engine.mj_resetData(self._model, self._data)
        at = 0
        for part in self._parts:
            array = getattr(self._data, part)
            array[:] = state[at : at + len(array)]
            at += len(array)

    def step(self, command: float) -> Array:
        self._data.ctrl[0] = command
        for _ in range(SUBSTEPS):
            self._engine.mj_step(self._model, self._data)
        return self._state()


ENGINES: dict[str, Callable[[], dict[str, Any]]] = {"pymunk": pymunk, "mujoco": mujoco}


def main() -> None:
    """Measure one engine."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("engine", choices=ENGINES)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    show(ENGINES[arguments.engine](), arguments.json)


if __name__ == "__main__":
    main()
