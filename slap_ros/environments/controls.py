# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an action of a learner does: move the joints, run a skill or a primitive, or either."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, Protocol

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from slap_ros.core import Action, Domain, World
from slap_ros.core.acquisition import Primitive
from slap_ros.environments.episode import TaskEpisode
from slap_ros.errors import InvalidCommandError, NoSkillsError, SkillNotApplicableError
from slap_ros.planning.option_execution import OptionExecution, OptionResult
from slap_ros.planning.options import Option
from slap_ros.planning.problem import GroundedOptions, ground_options
from slap_ros.policies.action_map import ActionMap
from slap_ros.portable_math import on_grid
from slap_ros.relational import AtomSpace, State, Target
from slap_ros.relational.state import Array

ACTIVE = 0.5  # activation from which on a skill is run
NEAR = 0.05  # m, within which a primitive is about what a plan is about
FAR = 0.1  # m, over which its affordance falls from there on


class Control(Protocol):
    """What actions are, and what they do."""

    @property
    def space(self) -> spaces.Space[Any]:
        """The space of actions."""
        ...

    def act(self, action: Any, episode: TaskEpisode, world: World) -> Iterator[State]:
        """Act, one environment step after the other.

        Args:
            action: Action, one of the space.
            episode: Episode, which is told of each state before the next is asked for.
            world: World in the episode's state.

        Returns:
            The state after each step.

        Raises:
            InvalidCommandError: The action is not in the space; nothing moved.
        """
        ...


class JointControl:
    """Each axis of the learned actions, from -1 to 1: one environment step."""

    def __init__(self, domain: Domain) -> None:
        self._map = ActionMap(domain, gripper=True)
        self.space = spaces.Box(-1.0, 1.0, (self._map.size,), np.float32)

    def act(self, action: Any, episode: TaskEpisode, world: World) -> Iterator[State]:
        """See :class:`Control`."""
        del episode
        yield world.step(self._map(checked(action, self.space)))


class SkillControl:
    """A ground skill, which runs to its end; one that does not apply holds still for a step."""

    def __init__(self, domain: Domain, space: AtomSpace) -> None:
        """Ground the skills.

        Args:
            domain: Domain with the skills.
            space: Atoms of the tasks, which all have the same objects.

        Raises:
            NoSkillsError: The domain has no skills.
        """
        self.options: GroundedOptions = ground_options(domain, space)
        self.space = spaces.Discrete(len(self.options))

    def act(self, action: Any, episode: TaskEpisode, world: World) -> Iterator[State]:
        """See :class:`Control`."""
        if not self.space.contains(action):
            raise InvalidCommandError(
                f"an action is the number of a skill from 0 to {len(self.options) - 1}, "
                f"not {action!r}"
            )
        yield from run_option(self.options, int(action), episode, world)

    def mask(self, episode: TaskEpisode) -> NDArray[np.bool_]:
        """Whether each skill's preconditions hold, shape (skills,)."""
        abstract = episode.abstract
        return np.array([ground.applicable(abstract) for ground, _ in self.options])


class MixedControl:
    """Joints, and an activation of each skill: the highest above one half runs to its end."""

    def __init__(self, domain: Domain, space: AtomSpace) -> None:
        """See :class:`SkillControl`."""
        self.joints, self.skills = JointControl(domain), SkillControl(domain, space)
        (axes,) = self.joints.space.shape
        self._axes = int(axes)
        size = self._axes + len(self.skills.options)
        self.space = spaces.Box(-1.0, 1.0, (size,), np.float32)

    def act(self, action: Any, episode: TaskEpisode, world: World) -> Iterator[State]:
        """See :class:`Control`."""
        given = checked(action, self.space)
        activations = given[self._axes :]
        if activations.max(initial=-1.0) > ACTIVE:
            chosen = int(activations.argmax())
            yield from run_option(self.skills.options, chosen, episode, world)
        else:
            yield from self.joints.act(given[: self._axes], episode, world)

    def mask(self, episode: TaskEpisode) -> NDArray[np.bool_]:
        """See :meth:`SkillControl.mask`."""
        return self.skills.mask(episode)


class ChoiceSpace(spaces.Box):
    """A score for each choice, then the numbers that each takes, all from -1 to 1."""

    def __init__(self, sizes: Sequence[int]) -> None:
        """Make room for the choices.

        Args:
            sizes: How many numbers each choice takes.
        """
        self.sizes = tuple(sizes)
        super().__init__(-1.0, 1.0, (len(self.sizes) + sum(self.sizes),), np.float32)

    @property
    def takes(self) -> NDArray[np.bool_]:
        """Which of the numbers after the scores each choice takes, shape (choices, numbers)."""
        choices = np.arange(len(self.sizes))
        takes: NDArray[np.bool_] = np.repeat(choices, self.sizes) == choices[:, None]
        return takes

    def chosen(self, action: Action) -> int:
        """The choice with the highest score in an action of the space."""
        return int(action[: len(self.sizes)].argmax())

    def numbers(self, action: Action, choice: int) -> Action:
        """The numbers of an action of the space that a choice takes."""
        taken: Action = action[len(self.sizes) :][self.takes[choice]]
        return taken


class PrimitiveControl:
    """A score for one step of the joints and for each primitive: what has the highest is done.

    An action has the scores, then the joints' axes, then the parameters of each primitive.
    Positions are relative to what the present operator of the task's plan acts on.
    """

    def __init__(self, domain: Domain) -> None:
        """Find the primitives.

        Args:
            domain: Domain that has them.

        Raises:
            NoSkillsError: It has none.
        """
        if domain.acquisition is None or domain.acquisition.primitives is None:
            raise NoSkillsError(
                f"domain {domain.name} has no primitives for control='primitives'; those at the "
                "benches have"
            )
        self.primitives = domain.acquisition.primitives
        self.joints = JointControl(domain)
        (axes,) = self.joints.space.shape
        sizes = [self.primitives.sizes[name] for name in self.primitives.policies]
        self.space = ChoiceSpace([int(axes), *sizes])

    def act(self, action: Any, episode: TaskEpisode, world: World) -> Iterator[State]:
        """See :class:`Control`."""
        given = np.clip(checked(action, self.space), -1.0, 1.0)
        chosen = self.space.chosen(given)
        if chosen == 0 or not episode.stage:  # without a plan there is nothing to aim at
            yield from self.joints.act(self.space.numbers(given, 0), episode, world)
            return
        primitive = list(self.primitives.policies.values())[chosen - 1]
        parameters = self._parameters(self.space.numbers(given, chosen), episode)
        yield from self._run(primitive, parameters, episode, world)

    def affordance(self, action: Action) -> float:
        """How near an action's point is to what the plan's present operator acts on, 0 to 1.

        MAPLE's affordance score (Nasiriany et al. 2022, §III), with what the plan is about for its
        keypoints. It is 1 within :data:`NEAR`, and for what has no point.

        Args:
            action: Action, one of the space.
        """
        chosen = self.space.chosen(action)
        told = self.space.numbers(action, chosen)
        if chosen == 0 or not len(told):
            return 1.0
        distance = float(np.linalg.norm(self._values(told)[:3]))
        return 1.0 - math.tanh(max(distance - NEAR, 0.0) / FAR)

    def _parameters(self, told: Action, episode: TaskEpisode) -> Array:
        """The parameters of a primitive, from numbers between -1 and 1."""
        parameters = self._values(told)
        parameters[:3] += self.primitives.target_of(episode.state, episode.stage)
        return on_grid(parameters)

    def _values(self, told: Action) -> Array:
        """The parameters relative to the target; those that a primitive does not take are 0."""
        low, high = self.primitives.low, self.primitives.high
        values, size = np.zeros(len(low)), len(told)
        values[:size] = low[:size] + 0.5 * (told + 1.0) * (high[:size] - low[:size])
        return values

    def _run(
        self, primitive: Primitive, parameters: Array, episode: TaskEpisode, world: World
    ) -> Iterator[State]:
        """Run a primitive to its end; hold still for a step where it has nothing to do."""
        policy = primitive(episode.state, parameters)
        command = policy(episode.state)
        if command is None:
            yield world.step(episode.domain.action_space.hold)
        while command is not None:
            yield world.step(command)
            command = policy(episode.state)


def checked(action: Any, space: spaces.Box) -> Action:
    """An action of a space of numbers; ones beyond its limits are left to what takes them.

    Raises:
        InvalidCommandError: It has another shape, or numbers that are not finite.
    """
    given: Action = np.asarray(action, dtype=np.float64)
    if given.shape != space.shape or not np.isfinite(given).all():
        raise InvalidCommandError(
            f"an action is {space.shape[0]} finite numbers from -1 to 1, not {action!r}"
        )
    return given


def run_option(
    options: GroundedOptions, number: int, episode: TaskEpisode, world: World
) -> Iterator[State]:
    """Run a skill until it ends, or hold still for a step where it does not apply.

    Args:
        options: Ground operators with their options.
        number: Number of the option.
        episode: Episode, which is told of each state before the next is asked for.
        world: World in the episode's state.

    Returns:
        The state after each step.
    """
    ground, option = options[number]
    actions, abstract = episode.domain.action_space, episode.abstract
    execution: OptionExecution | None = None
    if ground.applicable(abstract):
        target = option.target(ground.apply(abstract))
        execution = _begun(option, target, episode)
    command = None if execution is None else execution.advance(episode.state, abstract)
    if execution is None or command is None or isinstance(command, OptionResult):
        yield world.step(actions.hold)
        return
    while not isinstance(command, OptionResult):
        yield world.step(command)
        command = execution.advance(episode.state, episode.abstract)


def _begun(option: Option, target: Target, episode: TaskEpisode) -> OptionExecution | None:
    """The execution of an option; None where its skill finds no way from here."""
    try:
        return OptionExecution(
            option, target, episode.space, episode.domain.action_space, episode.state
        )
    except SkillNotApplicableError:
        return None
