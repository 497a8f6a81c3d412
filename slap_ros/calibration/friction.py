# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Friction by least squares: the same pushes are rolled out with one coefficient after another.

Of a thing's material, only friction can be told from pushes by an arm that goes where it is told:
no force is measured, and how far a thing slides does not depend on its mass. So every thing keeps
the mass that it has; what twice the mass would change is measured, and reported.

In a roll-out, the arm goes where the recorded one was, not where it was sent: a robot lags behind
its commands, and that is not friction.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import exp, log, sqrt

import numpy as np

from slap_ros.calibration.pushes import RecordedPush
from slap_ros.core import Action, Domain, World
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.statistics import NORMAL_95
from slap_ros.relational import Layout, State
from slap_ros.relational.state import Array

LOWEST, HIGHEST = 0.05, 2.0  # coefficients that are tried
TRIED = 25  # coefficients in this range, each the same factor apart
CLOSER = 8  # roll-outs of all pushes to come closer to the best of them
GOLDEN = (sqrt(5.0) - 1.0) / 2.0
NUDGE = 0.02  # share by which the coefficient is changed, to see what it changes
LEAST_EFFECT_M = 0.0005  # root mean square, for a quarter more friction: less says nothing of it
QUARTER = 0.25


@dataclass(frozen=True)
class IdentifiedFriction:
    """What pushes say of friction.

    Args:
        friction: Coefficient of every thing that can be pushed. That of a thing and what it lies
            on is the product of both.
        plus_minus: Half of its 95 % interval, from the residuals.
        rms_m: Root mean square of how far things are from where they were recorded, m.
        rms_before_m: The same with the friction that the recorded states have.
        mass_effect_m: Root mean square of how far twice the mass would move things, m.
        pushes: Number of pushes.
    """

    friction: float
    plus_minus: float
    rms_m: float
    rms_before_m: float
    mass_effect_m: float
    pushes: int


def identify_friction(domain: Domain, pushes: Sequence[RecordedPush]) -> IdentifiedFriction:
    """Find the friction with which the planner's model repeats pushes best.

    Args:
        domain: Domain that was recorded.
        pushes: Recorded pushes, one at least.

    Returns:
        The coefficient with its uncertainty.

    Raises:
        InvalidParameterError: The pushes do not depend on friction, or fit best at an end of the
            range that is tried.
    """
    world = domain.model_world(pushes[0].states[0])
    rollouts = [_Rollouts(domain, world, push) for push in pushes]

    def residuals(friction: float | None, mass: float = 1.0) -> Array:
        return np.concatenate([one.residuals(friction, mass) for one in rollouts])

    friction = _least(lambda value: float(np.square(residuals(value)).sum()))
    best = residuals(friction)
    change = residuals(friction * (1.0 + NUDGE)) - residuals(friction * (1.0 - NUDGE))
    slope = change / (2.0 * NUDGE * friction)
    if _rms(slope) * QUARTER * friction < LEAST_EFFECT_M:
        raise InvalidParameterError(
            f"{len(pushes)} pushes say nothing of friction: a quarter more of it would move "
            f"things by {1e3 * _rms(slope) * QUARTER * friction:.2f} mm; push faster, so that "
            "things slide on when the hand has stopped"
        )
    variance = float(np.square(best).sum()) / max(1, len(best) - 1)
    deviation = sqrt(variance / float(np.square(slope).sum()))
    return IdentifiedFriction(
        friction,
        NORMAL_95 * deviation,
        _rms(best),
        _rms(residuals(None)),
        _rms(residuals(friction, 2.0) - best),
        len(pushes),
    )


@dataclass
class _Rollouts:
    """A push in the planner's model, with materials other than those of the recording."""

    domain: Domain
    world: World
    push: RecordedPush
    _recorded: Array = field(init=False)
    _joints: list[int] = field(init=False)  # columns of what an action displaces

    def __post_init__(self) -> None:
        layout = self.push.states[0].layout
        self._recorded = self.push.places(self.push.states)
        names = [axis.name for axis in self.domain.action_space.displacement_axes]
        robot = next(obj for obj in layout.objects if set(names) <= set(obj.type.column))
        self._joints = [layout.column(robot, name) for name in names]

    def residuals(self, friction: float | None, mass: float) -> Array:
        """How far pushed things are from where they were recorded, along x and y, in every state.

        Args:
            friction: Coefficient of all things; None for that of the recorded states.
            mass: Factor of the mass of all things.
        """
        self.world.reset(_of_material(self.push.states[0], friction, mass))
        states = [self.world.state]
        for action, recorded in zip(self.push.actions, self.push.states[1:], strict=True):
            states.append(self.world.step(self._following(action, states[-1], recorded)))
        return (self.push.places(states) - self._recorded).ravel()

    def _following(self, action: Action, state: State, recorded: State) -> Action:
        """The action that takes the arm to where it was recorded next; the gripper's is kept."""
        actions = self.domain.action_space
        at = list(actions.displacement_indices)
        followed = action.copy()
        wanted = recorded.data[self._joints] - state.data[self._joints]
        followed[at] = np.clip(wanted, np.array(actions.low)[at], np.array(actions.high)[at])
        return followed


def _of_material(state: State, friction: float | None, mass: float) -> State:
    """The state with things of another material."""
    data = state.data.copy()
    data[_columns(state.layout, "mass")] *= mass
    if friction is not None:
        data[_columns(state.layout, "friction")] = friction
    return State(state.layout, data)


def _columns(layout: Layout, feature: str) -> list[int]:
    return [layout.column(obj, feature) for obj in layout.objects if feature in obj.type.column]


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _least(cost: Callable[[float], float]) -> float:
    """The friction of least cost: the best of a range, and then the best around it.

    Raises:
        InvalidParameterError: It is at an end of the range.
    """
    tried = np.geomspace(LOWEST, HIGHEST, TRIED)
    best = int(np.argmin([cost(float(value)) for value in tried]))
    if best in (0, TRIED - 1):
        raise InvalidParameterError(
            f"the pushes fit best with a friction of {tried[best]:g} or beyond, an end of the "
            f"range that is tried ({LOWEST:g} to {HIGHEST:g}); is the preset that of the recording?"
        )
    return exp(_golden_section(lambda x: cost(exp(x)), log(tried[best - 1]), log(tried[best + 1])))


def _golden_section(cost: Callable[[float], float], low: float, high: float) -> float:
    """Where a function of one minimum between two numbers is least."""
    inner = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)]
    costs = [cost(value) for value in inner]
    for _ in range(CLOSER):
        if costs[0] <= costs[1]:
            high, inner[1], costs[1] = inner[1], inner[0], costs[0]
            inner[0] = high - GOLDEN * (high - low)
            costs[0] = cost(inner[0])
        else:
            low, inner[0], costs[0] = inner[0], inner[1], costs[1]
            inner[1] = low + GOLDEN * (high - low)
            costs[1] = cost(inner[1])
    return inner[0] if costs[0] <= costs[1] else inner[1]
