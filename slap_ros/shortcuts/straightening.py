# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Executions of skills, made shorter: straight motions replace stretches of them.

A skill begins with a way of its own: up, over and down. So two skills, one after the other, take
many steps between what they do. The displacements that a stretch commands add up to where it takes
the robot, and the same sum at full speed takes it there straight. With paths, this is random
shortcutting (Geraerts and Overmars 2007). A path is checked for collisions; here a stretch may be
in contact, so the model says whether what follows still ends in the target.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from slap_ros.core import Domain
from slap_ros.errors import InvalidStateError, SkillNotApplicableError
from slap_ros.planning.abstract_graph import Edge
from slap_ros.planning.option_execution import OptionExecution, OptionResult
from slap_ros.relational import AtomSpace, State
from slap_ros.relational.state import Array
from slap_ros.shortcuts.observation_encoder import ObservationEncoder

LONGEST, LATER = 0.7, 0.3  # share of an execution that is replaced at once: at first, and later
SETTLING = 5  # environment steps for which the robot may hold at the end until nothing moves
STRAIGHTENED = "straightened skills"  # in the records of what they found


@dataclass(frozen=True)
class StraightenedExecution:
    """An execution that ends in a shortcut's target.

    Args:
        actions: Actions of a policy, from -1 to 1, shape (steps, actions).
        states: States in which the actions were chosen, then the last one.
    """

    actions: Array
    states: tuple[State, ...]

    @property
    def steps(self) -> int:
        """The number of environment steps."""
        return len(self.actions)


class ChainExecutor:
    """Executes options one after the other, and keeps what they command."""

    def __init__(self, domain: Domain, space: AtomSpace, state: State) -> None:
        """Take a world that nobody else uses.

        Args:
            domain: Domain of the options.
            space: Atoms of the task.
            state: State with the objects of the task.
        """
        self._domain, self._space = domain, space
        self._world = domain.model_world(state)
        self.steps = 0  # environment steps so far

    def commands(self, state: State, chain: Sequence[Edge], nodes: Sequence[int]) -> Array | None:
        """The robot's actions in a chain of options.

        Args:
            state: State in which the first option begins.
            chain: Edges of the options, in order.
            nodes: Nodes of the edges' graph, masks.

        Returns:
            Shape (steps, axes); None where an option does not reach its target.
        """
        actions: list[Array] = []
        self._world.reset(state)
        for edge in chain:
            target = edge.option.target(nodes[edge.target])
            try:
                execution = OptionExecution(
                    edge.option, target, self._space, self._domain.action_space, state
                )
            except SkillNotApplicableError:
                return None
            while not isinstance(
                action := execution.advance(state, self._space.abstract(state)), OptionResult
            ):
                actions.append(np.asarray(action, dtype=np.float64))
                state = self._world.step(action)
                self.steps += 1
            if not target.reached(self._space.abstract(state)):
                return None
        return np.array(actions) if actions else None


class Straightener:
    """Makes executions shorter that begin in one state and end in a shortcut's target."""

    def __init__(self, domain: Domain, encoder: ObservationEncoder, start: State) -> None:
        """Take a world that nobody else uses.

        Args:
            domain: Domain of the shortcut.
            encoder: Encoder for the change that the shortcut makes.
            start: State in which executions begin.
        """
        self._encoder, self._start = encoder, start
        self._world = domain.model_world(start)
        self._targets = [encoder.change.apply(encoder.space.abstract(start))]
        self._hold = np.asarray(domain.action_space.hold, dtype=np.float64)
        displacements = set(domain.learned_actions.displacement_indices)
        self._axes = [k for k, axis in enumerate(encoder.action_map.axes) if axis in displacements]
        self.steps = 0  # environment steps so far

    def shorten(
        self, commands: Array, tries: int, rng: np.random.Generator
    ) -> StraightenedExecution | None:
        """Replace stretches by straight motions, again and again, as long as the target is reached.

        Args:
            commands: Robot's actions in an execution, shape (steps, axes).
            tries: Number of stretches that are tried.
            rng: Generator that draws the stretches.

        Returns:
            The shortest execution; None where already the first misses the target, as one does
            that acts with a gripper which the shortcut has not.
        """
        # A skill may end while things still move, as in a drawer that shuts; a shortcut may not.
        settling = np.repeat(self._hold[None], SETTLING, axis=0)
        actions = self._encoder.action_map.inverse(np.concatenate([commands, settling]))
        best = self.execute(actions)
        for number in range(tries if best is not None else 0):
            assert best is not None
            share = LONGEST if 2 * number < tries else LATER
            first = int(rng.integers(max(1, best.steps - 1)))
            length = int(rng.integers(2, max(3, int(share * best.steps))))
            stretch = straight(best.actions[first : first + length], self._axes)
            if stretch is None:
                continue
            after = np.concatenate([stretch, best.actions[first + length :]])
            shorter = self._reach(best.states[first], after)
            if shorter is not None and first + shorter.steps < best.steps:
                best = StraightenedExecution(
                    np.concatenate([best.actions[:first], shorter.actions]),
                    (*best.states[:first], *shorter.states),
                )
        return best

    def execute(self, actions: Array) -> StraightenedExecution | None:
        """Act from the start until the target is reached; None where it is not.

        Args:
            actions: Actions of a policy, from -1 to 1, shape (steps, actions).
        """
        return self._reach(self._start, actions)

    def come_back(self, actions: Array, noise: Array) -> StraightenedExecution | None:
        """Act with noise, and say in each step what leads back to the execution without any.

        Displacements add up, so what noise has added is what is to be taken back (as in DART,
        Laskey et al. 2017, where a supervisor says it).

        Args:
            actions: Actions of a policy that reach the target from the start, from -1 to 1, shape
                (steps, actions).
            noise: Noise on displacements, shape (steps, displacements).

        Returns:
            The execution, with what would have led back in the place of what was done; None where
            the target is not reached.
        """
        done, back, off = actions.copy(), actions.copy(), np.zeros(len(self._axes))
        for step, planned in enumerate(actions[:, self._axes]):
            wanted = np.clip(planned - off, -1.0, 1.0)
            back[step, self._axes] = wanted
            done[step, self._axes] = np.clip(wanted + noise[step], -1.0, 1.0)
            off += done[step, self._axes] - planned
        reached = self.execute(done)
        return None if reached is None else replace(reached, actions=back[: reached.steps])

    @property
    def displacements(self) -> int:
        """The number of actions that are displacements."""
        return len(self._axes)

    def _reach(self, state: State, actions: Array) -> StraightenedExecution | None:
        """The execution from any state on, up to the target; None where that is not reached."""
        try:
            self._world.reset(state)
        except InvalidStateError:  # pressed in so far that nothing can begin there
            return None
        states = [state]
        for step, command in enumerate(self._encoder.action_map(actions)):
            states.append(self._world.step(command))
            self.steps += 1
            batch = states[-1].alone()
            encoding = self._encoder.encode(batch)
            if self._encoder.success(batch, encoding, self._targets)[0]:
                return StraightenedExecution(actions[: step + 1], tuple(states))
            if encoding.failure[0]:
                return None
        return None


def straight(stretch: Array, axes: Sequence[int]) -> Array | None:
    """The straight motion with the displacements of a stretch, as fast as can be.

    Args:
        stretch: Actions of a policy, from -1 to 1, shape (steps, actions).
        axes: Numbers of the actions that are displacements. The others are taken from the stretch
            as it is passed through.

    Returns:
        Shape (fewer steps, actions); None where the stretch is as fast.
    """
    whole = stretch[:, axes].sum(axis=0)
    steps = max(1, math.ceil(float(np.abs(whole).max(initial=0.0)) - 1e-9))
    if steps >= len(stretch):
        return None
    passed = ((np.arange(steps) + 0.5) * len(stretch) / steps).astype(np.intp)
    motion = stretch[passed].copy()
    motion[:, axes] = whole / steps
    return motion
