# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Demonstrations of a shortcut: the skills that it replaces, executed and made shorter.

Nobody writes or records them. Skills lead from the shortcut's start to its target, or an approach
of an object and a push at it, and :mod:`slap_ros.shortcuts.straightening` makes their execution
shorter.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, permutations, product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError, SlapError
from slap_ros.planning.abstract_graph import AbstractGraph, Edge
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.problem import Problem
from slap_ros.relational import State
from slap_ros.relational.state import Array
from slap_ros.shortcuts.approaches import MOST_STEPS, Approacher, most_steps_of_pushes
from slap_ros.shortcuts.kept_shortcuts import NOTHING_KEPT, KeptShortcuts, graph_of
from slap_ros.shortcuts.observation_encoder import ObservationEncoder
from slap_ros.shortcuts.observation_layout import ObservationLayout, observation_layout
from slap_ros.shortcuts.signature import Signature, concerned
from slap_ros.shortcuts.starts import Start, StartRecord, restore_starts, shortest_paths
from slap_ros.shortcuts.straightening import (
    SETTLING,
    ChainExecutor,
    StraightenedExecution,
    Straightener,
)

MOST_ORDERS = 24  # of the objects in an observation that are learned from
MOST_WAYS = 4  # ways from a start to its target that are executed until one gets there

Shown = tuple[str, Array]  # name of an approach, and the robot's actions, shape (steps, axes)


@dataclass(frozen=True)
class ShortcutDemonstration:
    """A demonstration as it is written to files and sent to other processes.

    Args:
        start: Start of the shortcut in which it begins.
        actions: Actions of the policy, from -1 to 1, one tuple per step.
        replaced: Environment steps of the skills, or of approach and push, before their execution
            was made shorter.
        environment_steps: Environment steps that it took to find.
        approach: Name of the approach that it begins with; empty where skills showed it.
    """

    start: StartRecord
    actions: tuple[tuple[float, ...], ...]
    replaced: int
    environment_steps: int
    approach: str = ""

    def as_json(self) -> dict[str, Any]:
        """A JSON object, which names an approach only where there is one."""
        return {
            "start": self.start.as_json(),
            "actions": [list(action) for action in self.actions],
            "replaced": self.replaced,
            "environment_steps": self.environment_steps,
            **({"approach": self.approach} if self.approach else {}),
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> ShortcutDemonstration:
        """The demonstration of :meth:`as_json`.

        Raises:
            KeyError, TypeError, ValueError: The data is no demonstration.
        """
        actions = tuple(tuple(float(value) for value in action) for action in data["actions"])
        if not actions or len({len(action) for action in actions}) > 1:
            raise ValueError("its actions are not all of one size")
        start = StartRecord.from_json(data["start"])
        replaced, steps = int(data["replaced"]), int(data["environment_steps"])
        return cls(start, actions, replaced, steps, str(data.get("approach", "")))


@dataclass(frozen=True)
class DemonstrationAttempt:
    """What came of trying to demonstrate a shortcut from one of its starts.

    Args:
        shown: Demonstration; None where nothing shows the shortcut.
        environment_steps: Environment steps that it took to find, or to find none.
    """

    shown: ShortcutDemonstration | None
    environment_steps: int

    def as_json(self) -> dict[str, Any]:
        """A JSON object: the demonstration, or the environment steps that were in vain."""
        if self.shown is None:
            return {"environment_steps": self.environment_steps}
        return self.shown.as_json()

    @classmethod
    def from_json(cls, data: Mapping[str, Any] | None) -> DemonstrationAttempt:
        """The attempt of :meth:`as_json`.

        Args:
            data: JSON object; None where an earlier version has counted no steps in vain.

        Raises:
            KeyError, TypeError, ValueError: The data is no attempt.
        """
        if data is None:
            return cls(None, 0)
        shown = ShortcutDemonstration.from_json(data) if "start" in data else None
        return cls(shown, int(data["environment_steps"]))

    def total_steps(self, repetitions: int) -> int:
        """Environment steps with those of making the demonstration again.

        Args:
            repetitions: Number of times that it is made again, from its start to its end.
        """
        again = 0 if self.shown is None else repetitions * len(self.shown.actions)
        return self.environment_steps + again


class Demonstrated(NamedTuple):
    """What a policy learns from: steps of all demonstrations.

    Attributes:
        observations: Shape (n, size).
        actions: Shape (n, actions), from -1 to 1.
        shortest: Environment steps of the shortest demonstration.
    """

    observations: NDArray[np.float32]
    actions: NDArray[np.float32]
    shortest: int


@dataclass(frozen=True)
class NoisyRepetitions:
    """Noise with which demonstrations are made again, to learn how to come back to them.

    Args:
        number: Number of times that each is made again.
        scale: Standard deviation of the noise, of actions from -1 to 1.
        seed: Seed of the noise.
    """

    number: int = 0
    scale: float = 0.0
    seed: int = 0

    def of(
        self, straightener: Straightener, actions: Array, place: int
    ) -> Iterator[StraightenedExecution]:
        """Make a demonstration again with noise.

        Args:
            straightener: Straightener at the start of the demonstration.
            actions: Actions of the demonstration, shape (steps, actions).
            place: Place of the demonstration among all: each has a noise of its own.

        Yields:
            The executions that reach the target in spite of noise.
        """
        rng = np.random.default_rng([self.seed, place])
        for _ in range(self.number):
            noise = rng.normal(scale=self.scale, size=(len(actions), straightener.displacements))
            if (execution := straightener.come_back(actions, noise)) is not None:
                yield execution


NOT_REPEATED = NoisyRepetitions()


def demonstrate(
    domain: Domain,
    record: StartRecord,
    signature: Signature,
    tries: int,
    rng: np.random.Generator,
    kept: KeptShortcuts = NOTHING_KEPT,
    push: int = 0,
) -> DemonstrationAttempt:
    """Execute what leads from a start to its target, and make the execution shorter.

    Args:
        domain: Domain with the skills.
        record: Start of the shortcut.
        signature: Signature of the shortcut.
        tries: Number of stretches that are tried.
        rng: Generator that draws the stretches.
        kept: Shortcuts that are skills like any other.
        push: Environment steps of pushes, where approaches with pushes lead there; 0 where skills
            do.

    Returns:
        The demonstration; none where they do not lead to the target, or with actions that the
        shortcut has not.
    """
    (start,) = restore_starts(domain, [record])
    encoder = ObservationEncoder(domain, start.space, signature, start.change)
    straightener = Straightener(domain, encoder, start.state)
    model: Approacher | ChainExecutor
    shown: Iterator[Shown]
    if push:
        model = Approacher(domain, start.state)
        pushes = model.pushes(start.state, concerned(start.change, start.space), push, rng)
        shown = _reaching(pushes, encoder, straightener)
    else:
        problem = Problem.of(domain, start.state)
        model = ChainExecutor(domain, problem.model.space, start.state)
        shown = _executed(model, kept.planner(domain, problem, start.state), start)
    for approach, commands in shown:
        found = straightener.shorten(commands, tries, rng)
        if found is not None:
            actions = tuple(tuple(row) for row in found.actions.tolist())
            steps = model.steps + straightener.steps
            made = ShortcutDemonstration(record, actions, len(commands), steps, approach)
            return DemonstrationAttempt(made, steps)
    return DemonstrationAttempt(None, model.steps + straightener.steps)


def most_demonstration_steps(
    domain: Domain, signature: Signature, executions: int, horizon: int, push: int = 0
) -> int:
    """Count the environment steps that a demonstration takes at most, as a rule.

    Args:
        domain: Domain with the skills.
        signature: Signature of the shortcut.
        executions: Number of times that it is executed after it was found, to make it shorter and
            to learn from it.
        horizon: Environment steps that skills take at most, as a rule.
        push: Environment steps of pushes that follow approaches; 0 where skills show it.

    Returns:
        Environment steps with those of finding it.
    """
    if push:
        longest = MOST_STEPS + push
        finding = most_steps_of_pushes(domain, len(signature.roles), push)
    else:
        longest, finding = horizon, MOST_WAYS * horizon
    return finding + executions * (longest + SETTLING)


def _executed(executor: ChainExecutor, planner: GraphPlanner, start: Start) -> Iterator[Shown]:
    """Yield the robot's actions in ways that lead to the start's target; no approaches."""
    try:
        graph = graph_of(planner, start.space.abstract(start.state), start.target)
    except SlapError:  # no operators lead there
        return
    for way in _ways(graph):
        commands = executor.commands(start.state, way, graph.nodes)
        if commands is not None:
            yield "", commands


def _reaching(
    pushes: Iterable[Shown], encoder: ObservationEncoder, straightener: Straightener
) -> Iterator[Shown]:
    """Yield the actions that reach the target, up to there, and the approach that they begin with.

    Args:
        pushes: Approaches with pushes.
        encoder: Encoder for the change that the shortcut makes.
        straightener: Straightener at the start of the shortcut.
    """
    for approach, commands in pushes:
        execution = straightener.execute(encoder.action_map.inverse(commands))
        if execution is not None:
            yield approach, commands[: execution.steps]


def _ways(graph: AbstractGraph) -> Iterator[tuple[Edge, ...]]:
    """Ways to the target, those with the fewest edges first."""
    goals = set(graph.goal_nodes)
    to_goal = (path for path in shortest_paths(graph) if path and path[-1].target in goals)
    return islice(to_goal, MOST_WAYS)


def demonstrated(
    domain: Domain,
    signature: Signature,
    demonstrations: Sequence[ShortcutDemonstration],
    repetitions: NoisyRepetitions = NOT_REPEATED,
) -> Demonstrated:
    """Make demonstrations again in the model, to see what a policy observes in them.

    Args:
        domain: Domain of the demonstrations.
        signature: Signature of the shortcut.
        demonstrations: Demonstrations of the shortcut, one at least.
        repetitions: Noise with which each is made again some more times.

    Returns:
        The steps of those that end in the target again, once for each order of the objects of a
        kind: which of them comes first is a matter of their names.

    Raises:
        InvalidParameterError: None does: they were made in another physics.
    """
    observations, actions = [], []
    starts = restore_starts(domain, [shown.start for shown in demonstrations])
    for place, (start, shown) in enumerate(zip(starts, demonstrations, strict=True)):
        encoder = ObservationEncoder(domain, start.space, signature, start.change)
        whole = np.array(shown.actions)
        straightener = Straightener(domain, encoder, start.state)
        again = straightener.execute(whole)
        if again is None:
            continue
        for execution in (again, *repetitions.of(straightener, again.actions, place)):
            seen = State.batch(execution.states[:-1])
            observations.append(encoder.encode(seen).observations)
            actions.append(execution.actions)
    if not actions:
        raise InvalidParameterError(
            f"no demonstration of {signature.name} ends in its target again; remove the work "
            "folder to make others"
        )
    layout = observation_layout(domain, signature, starts[0].state)
    assert layout is not None  # the task has the shortcut's objects
    orders = list(slot_orders(layout))
    seen_once = np.concatenate(observations)
    return Demonstrated(
        np.concatenate([seen_once[:, order] for order in orders]),
        np.tile(np.concatenate(actions).astype(np.float32), (len(orders), 1)),
        min(len(shown.actions) for shown in demonstrations),
    )


def slot_orders(layout: ObservationLayout) -> Iterator[NDArray[np.intp]]:
    """Yield the columns of an observation in which the objects of a kind have other slots.

    Args:
        layout: Layout of the observation.

    Yields:
        Shape (size,); the first order is that of the observation, and there are no more than
        ``MOST_ORDERS``.
    """
    begin, kinds = layout.robot, []
    for kind, count in layout.slots.items():
        slots = np.arange(begin, begin + count * layout.widths[kind]).reshape(count, -1)
        kinds.append([slots[list(order)].ravel() for order in permutations(range(count))])
        begin += slots.size
    robot = np.arange(layout.robot)
    for orders in islice(product(*kinds), MOST_ORDERS):
        yield np.concatenate([robot, *orders])
