# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A whole task as a Markov decision process, for any learner that knows Gymnasium.

::

    import gymnasium
    import slap_ros.environments

    env = gymnasium.make("slap_ros/ObstacleTower-v0", preset="fair")
    observation, info = env.reset(seed=500, options={"index": 3})
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import count, islice
from numbers import Integral
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from slap_ros.core import Domain, PictureSize, Task, World, task_with_goal
from slap_ros.drawing.body_pictures import canvas_of, draw_bodies, viewpoint, visible
from slap_ros.environments.controls import (
    JointControl,
    MixedControl,
    PrimitiveControl,
    SkillControl,
)
from slap_ros.environments.episode import TaskEpisode
from slap_ros.environments.observations import (
    FeatureObservation,
    ViewObservation,
    vector_space,
)
from slap_ros.environments.slots import ObjectSlots
from slap_ros.environments.task_rewards import DenseReward, SparseReward, StagedReward, TaskReward
from slap_ros.errors import InvalidParameterError, InvalidStateError
from slap_ros.relational import AtomSpace, State
from slap_ros.skills.domain_choice import DomainChoice, open_domain

CENSUS = 32  # tasks that are looked at for how many objects there can be
MOST_DRAWN = 1_000  # tasks, until one has objects that fit
REWARDS: Mapping[str, type[SparseReward | DenseReward | StagedReward]] = {
    "sparse": SparseReward,
    "dense": DenseReward,
    "stages": StagedReward,
}
OBSERVATIONS = ("state", "view")
CONTROLS = ("joints", "skills", "both", "primitives")
# What reset may be told of the task, and of which type.
OPTIONS: Mapping[str, type] = {"index": Integral, "goal": str, "state": State, "task": Task}
PICTURE = PictureSize(480, 360)  # pixels


class TaskEnv(gymnasium.Env[Any, Any]):
    """The tasks of a domain; an episode ends when the goal holds, or at the task's step limit.

    ``reset(seed=S, options={"index": I, "goal": NAME})`` begins the task that ``slap evaluate`` has
    at that seed and index; without a seed, the next index follows. ``options={"state": STATE}``
    begins in a state, with the domain's goal for it, and ``options={"task": TASK}`` a task.
    ``info`` has ``atoms`` and ``goal`` (names of atoms), ``success`` and ``is_success``, ``steps``,
    with stages ``progress`` (share of them that is done), and with skills ``action_mask``.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}  # noqa: RUF012 -- Gymnasium's own

    def __init__(
        self,
        domain: str,
        preset: str = "",
        *,
        skills: str = "shipped",
        obs: str = "state",
        reward: str = "sparse",
        control: str = "joints",
        goal: str | None = None,
        like: str | None = None,
        render_mode: str | None = None,
    ) -> None:
        """Look at some tasks, for what there is to be seen.

        Args:
            domain: Name of the domain.
            preset: Preset, maybe with settings, as ``fair:obstacles=4``; empty for the first.
            skills: Choice of the skills, as of :func:`slap_ros.make`.
            obs: Observation: ``state`` (features of all objects) or ``view`` (what shortcuts see).
            reward: Reward: ``sparse`` (-1 a step), ``dense`` (the potential that shortcuts get on
                the way to the goal) or ``stages`` (on the way to each state of a plan).
            control: Actions: ``joints``, ``skills`` (a number for each ground skill), ``both``
                (joints and an activation of each skill) or ``primitives`` (a score for each
                movement of the domain's, and their parameters; only with ``stages``).
            goal: Goal of every task, by name or as atoms; None for each task's own.
            like: Preset whose tasks say for how many objects observations have room, and how
                features are scaled; None for the environment's own.
            render_mode: ``rgb_array``, or None; ``gymnasium.wrappers.HumanRendering`` shows it.

        Raises:
            InvalidParameterError: There is no such preset, observation, reward, control or render
                mode.
            InvalidDomainError: The domain has no learner's interface, for ``view`` and for rewards
                other than ``sparse``.
            NoSkillsError: The domain has no skills to run.
            UnknownGoalError: There is no goal of that name.
        """
        _require("obs", obs, OBSERVATIONS)
        _require_control(control, reward)
        if render_mode is not None:
            _require("render_mode", render_mode, self.metadata["render_modes"])
        chosen = DomainChoice(domain, preset, "" if skills == "shipped" else skills)
        self.domain: Domain = open_domain(chosen)
        self.render_mode, self._obs, self._goal = render_mode, obs, goal
        task_with_goal(self.domain, 0, 0, goal)  # refused here rather than in the first reset
        model = self.domain if like is None else open_domain(replace(chosen, preset=like))
        census = [model.task(0, index) for index in range(CENSUS)]
        atoms = [self.domain.atom_space(task.initial_state) for task in census]
        self._first = atoms[0]
        self._slots = ObjectSlots.of(atoms)
        self.encode = self._encoder(census, atoms)
        self._reward: TaskReward = REWARDS[reward]()
        self._control = self._make_control(control)
        self.action_space = self._control.space
        self.observation_space = self._make_observation_space()
        self._seed: int | None = None
        self._index = -1
        self._episode: TaskEpisode | None = None
        self._world: World | None = None

    # -- Gymnasium's interface --------------------------------------------------------------------

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin a task; see the class.

        Raises:
            InvalidParameterError: An option is not known.
            InvalidStateError: The task has more objects than there is room for.
            UnknownGoalError: There is no goal of that name.
        """
        super().reset(seed=seed)
        chosen = dict(options or {})
        for name, value in chosen.items():
            _require("option", name, list(OPTIONS))
            if value is not None and not isinstance(value, OPTIONS[name]):
                raise InvalidParameterError(
                    f"option {name!r} is {value!r:.80}; it must be of type {OPTIONS[name].__name__}"
                )
        task = self._task(seed, **chosen)
        self._episode = TaskEpisode.of(self.domain, task)
        self._enter(task.initial_state)
        self._reward.begin(self._episode)
        return self._observe(), self._info()

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Act until the action is over, the goal holds, or the task's steps are used up.

        Raises:
            InvalidParameterError: No episode has begun.
            InvalidCommandError: The action is not in the action space; nothing moved.
        """
        episode = self._under_way
        assert self._world is not None
        total = self._advance(self._control.act(action, episode, self._world))
        solved = episode.solved
        return self._observe(), total, solved, episode.at_limit and not solved, self._info()

    def _advance(self, states: Iterator[State]) -> float:
        """Go through states until the goal holds or the steps are used up; the reward of all."""
        episode, total = self._under_way, 0.0
        for state in states:
            episode.state, episode.steps = state, episode.steps + 1
            total += self._reward.of(episode)
            if episode.solved or episode.at_limit:
                break
        return total

    def render(self) -> NDArray[np.uint8] | None:
        """A picture of the newest state, shape (height, width, 3); None without a render mode."""
        if self.render_mode is None:
            return None
        episode = self._under_way
        first = visible(self.domain.display, episode.task.initial_state)
        view = viewpoint([first])
        canvas = canvas_of([first], view, PICTURE)
        bodies = visible(self.domain.display, episode.state)
        return np.asarray(draw_bodies(bodies, view, canvas, PICTURE), dtype=np.uint8)

    @property
    def observed_features(self) -> int:
        """Number of features in an observation, those of goals as well."""
        return int(spaces.flatdim(self.observation_space))

    def close(self) -> None:
        """Give the world back."""
        close = getattr(self._world, "close", None)
        if close is not None:
            close()
        self._world = None

    def action_masks(self) -> NDArray[np.bool_]:
        """Which skills apply, shape (skills,), as masked learners ask for it.

        Raises:
            InvalidParameterError: Actions run no skills, or no episode has begun.
        """
        if self._skills is None:
            raise InvalidParameterError("joints and primitives run no skills, so there is no mask")
        return self._skills.mask(self._under_way)

    # -- making it --------------------------------------------------------------------------------

    def _encoder(
        self, census: list[Task], atoms: list[AtomSpace]
    ) -> FeatureObservation | ViewObservation:
        """What encodes states; ``view`` is measured on a task with an object of each kind."""
        states = [task.initial_state for task in census]
        if self._obs != "view":
            return FeatureObservation(self._slots, list(zip(states, atoms, strict=True)))
        most = max(range(CENSUS), key=lambda i: len(atoms[i].layout.objects))
        return ViewObservation(self.domain, self._slots, atoms[most], states[most])

    def _make_control(
        self, name: str
    ) -> JointControl | PrimitiveControl | SkillControl | MixedControl:
        if name == "joints":
            return JointControl(self.domain)
        if name == "primitives":
            return PrimitiveControl(self.domain)
        made = SkillControl if name == "skills" else MixedControl
        return made(self.domain, self._first)

    def _make_observation_space(self) -> spaces.Space[Any]:
        return vector_space(self.encode.size)

    @property
    def _needs_same_objects(self) -> bool:
        """Whether goals or actions are numbered over the objects of the first task."""
        return self._skills is not None

    @property
    def _skills(self) -> SkillControl | MixedControl | None:
        """The control, where actions run skills."""
        control = self._control
        return control if isinstance(control, (SkillControl, MixedControl)) else None

    # -- an episode -------------------------------------------------------------------------------

    def _task(
        self,
        seed: int | None,
        index: int | None = None,
        goal: str | None = None,
        state: State | None = None,
        task: Task | None = None,
    ) -> Task:
        """The task that begins: the one that is asked for, or the next that fits."""
        if state is not None:
            task = Task(state, self.domain.default_goal(state), self.domain.step_limit)
        if task is not None:
            self._require_fit(task)
            return task
        if seed is not None or self._seed is None:
            drawn = int(self.np_random.integers(2**31)) if seed is None else seed
            self._seed, self._index = drawn, -1
        if index is None:
            task = self.first_task(self._seed, count(self._index + 1), goal)
            self._index = task.index
            return task
        self._index = index
        task = task_with_goal(self.domain, self._seed, index, goal or self._goal)
        self._require_fit(task)
        return task

    def first_task(self, seed: int, indices: Iterator[int], goal: str | None = None) -> Task:
        """The first of some tasks that can be observed and acted in.

        Args:
            seed: Seed of the tasks.
            indices: Indices of the tasks, of which as many are taken as are looked at.
            goal: Goal of the task; None for that of the environment.

        Raises:
            InvalidStateError: None of a thousand can.
        """
        return next(self.fitting_tasks(seed, indices, goal))[1]

    def fitting_tasks(
        self, seed: int, indices: Iterator[int], goal: str | None = None
    ) -> Iterator[tuple[int, Task]]:
        """The tasks that can be observed and acted in, each with its index.

        Args:
            seed: Seed of the tasks.
            indices: Indices of the tasks, of which as many are taken as are looked at.
            goal: Goal of the tasks; None for that of the environment.

        Returns:
            The tasks, without end as far as there are indices.

        Raises:
            InvalidStateError: None of a thousand in a row can.
        """
        reason: str | None = None
        while True:
            for index in islice(indices, MOST_DRAWN):
                task = task_with_goal(self.domain, seed, index, goal or self._goal)
                reason = self._why_unfit(task)
                if reason is None:
                    yield index, task
                    break
            else:
                raise InvalidStateError(
                    f"{reason}; so have the {MOST_DRAWN} before it: reset(seed=0, "
                    'options={"index": 0}) begins in the first task'
                )

    def _require_fit(self, task: Task) -> None:
        if reason := self._why_unfit(task):
            raise InvalidStateError(reason)

    def _why_unfit(self, task: Task) -> str | None:
        """Why a task cannot be observed or acted in; None where it can."""
        if self._needs_same_objects:
            own, wanted = task.initial_state.layout, self._first.layout
            if own != wanted:
                return (
                    f"the task has other objects ({', '.join(own.by_name)}) than those that goals "
                    f"and skills are numbered over ({', '.join(wanted.by_name)})"
                )
            return None
        try:
            list(self._slots.columns(self.domain.atom_space(task.initial_state)))
        except InvalidStateError as error:
            return str(error)
        return None

    def _enter(self, state: State) -> None:
        """A world in a state: the one that is there, where it has the same objects."""
        if self._world is not None and self._world.state.layout == state.layout:
            self._world.reset(state)
            return
        self.close()
        self._world = self.domain.make_world(state)

    @property
    def _under_way(self) -> TaskEpisode:
        if self._episode is None:
            raise InvalidParameterError("no episode has begun: call reset() first")
        return self._episode

    def _observe(self) -> Any:
        episode = self._under_way
        return self.encode(episode.state.alone(), episode.space)[0]

    def _info(self) -> dict[str, Any]:
        episode = self._under_way
        solved = episode.solved
        info: dict[str, Any] = {
            "atoms": episode.atom_names,
            "goal": episode.goal_names,
            "success": solved,
            "is_success": solved,
            "steps": episode.steps,
        }
        if isinstance(self._reward, StagedReward):
            info["progress"] = 1.0 if solved else self._reward.progress
        if self._skills is not None:
            info["action_mask"] = self._skills.mask(episode)
        return info


def _require(what: str, name: str, known: tuple[str, ...] | list[str]) -> None:
    """Refuse a name that is not known.

    Raises:
        InvalidParameterError: It is not; says which there are.
    """
    if name not in known:
        raise InvalidParameterError(f"unknown {what} {name!r}; there are {', '.join(known)}")


def _require_control(control: str, reward: str) -> None:
    """Refuse actions or a reward that are not known, or do not go together."""
    _require("reward", reward, tuple(REWARDS))
    _require("control", control, CONTROLS)
    if control == "primitives":
        _require("reward for control='primitives'", reward, ("stages",))
