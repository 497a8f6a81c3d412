# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A learned shortcut, and how it is tried out in the planner's model before it is used."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256

import numpy as np

from slap_ros.core import Action, Domain, VectorWorld
from slap_ros.core import Policy as Control
from slap_ros.errors import SkillNotApplicableError
from slap_ros.relational import Object, State
from slap_ros.shortcuts.policy import Policy, Weights
from slap_ros.shortcuts.sight import Sight
from slap_ros.shortcuts.signature import Change, Signature

HOPE = 3  # failures, on top of as many for each success, before a shortcut is given up
DARING = 2.0  # temperature of the last of a crowd against that of the first
NARROWER = 0.7  # of the spread of variations from one round to the next
SAME = 1e-6  # in any feature's unit: up to here a state is the one that was foreseen
ALIKE = 0.02  # in any feature's unit: up to here a robot is where it was foreseen to be


@dataclass(frozen=True)
class Shortcut:
    """What was learned, for any objects.

    Args:
        signature: What it changes.
        policy: How.
        shortest: Environment steps of the shortest success in training; half is the lower bound.
        record: How it was trained: figures and settings by name.
    """

    signature: Signature
    policy: Policy
    shortest: int
    record: Mapping[str, str | int | float] = field(default_factory=dict, compare=False)

    @property
    def name(self) -> str:
        """The signature's name."""
        return self.signature.name


@dataclass(frozen=True)
class Sampling:
    """How a shortcut is tried out when planning; ``PAPER`` is what the paper does.

    Args:
        samples: Attempts, the first without noise.
        crowd: Attempts in place of each further one, all at once, where a domain's worlds can be
            stepped together.
        ends: Attempts kept besides that without noise: each ends in a state of its own, and what
            comes next may take less from where a longer one ends.
        refinements: Rounds of random variations of the best, a cross-entropy search's last ones.
        horizon: Environment steps of an attempt (the paper's T_eval).
        temperature: Of the noise, against training's: in a model, daring costs nothing.
        patience: Failed attempts after which, without any success, it is given up.
        spread: Standard deviation of the first refinement, of actions from -1 to 1.
    """

    samples: int = 16
    crowd: int = 32
    ends: int = 3
    refinements: int = 1
    temperature: float = 2.0
    horizon: int = 40
    patience: int = 16
    spread: float = 0.35


DEFAULT = Sampling()
PAPER = Sampling(samples=1, refinements=0, temperature=1.0, horizon=100)


@dataclass(frozen=True)
class Attempt:
    """A run of a shortcut in the model that succeeded."""

    choices: tuple[Weights, ...]  # the policy's actions, from -1 to 1
    states: tuple[State, ...]  # in which they were chosen

    @property
    def steps(self) -> int:
        """Environment steps."""
        return len(self.choices)


@dataclass
class _Found:
    """Attempts that succeeded: that without noise, and the shortest others."""

    ends: int  # others at most
    calm: Attempt | None
    others: list[Attempt] = field(default_factory=list)  # the shortest first

    @property
    def attempts(self) -> list[Attempt]:
        """All of them, the shortest first."""
        calm = [] if self.calm is None else [self.calm]
        return sorted((*calm, *self.others), key=_steps)

    def limit(self, most: int) -> int:
        """Environment steps, of at most so many, that one more may take to be kept."""
        return most if len(self.others) < self.ends else min(most, self.others[-1].steps - 1)

    def add(self, attempts: Sequence[Attempt]) -> None:
        """Keep those that are worth keeping."""
        self.others = sorted((*self.others, *attempts), key=_steps)[: self.ends]


def _steps(attempt: Attempt) -> int:
    return attempt.steps


Choose = Callable[[int, Weights], Weights]  # step and observations, (n, size), to (n, actions)


class Rehearsal:
    """Tries shortcuts out in worlds of its own, and remembers what came of it.

    The outcome is a function of the shortcut, the change and the state: noise comes from a
    generator that is seeded with them. So planner, skill server and replay agree.
    """

    def __init__(self, domain: Domain, initial: State, sampling: Sampling) -> None:
        """Rehearse with the objects of ``initial``."""
        self.sampling = sampling
        together = domain.steps_together
        self._count = (sampling.samples - 1) * (sampling.crowd if together else 1)  # with noise
        self._at_once = self._count + 1 if together else 1
        self._alone = domain.make_vector_world([initial])
        self._crowd = (
            domain.make_vector_world([initial] * self._at_once) if together else self._alone
        )
        self._memory: dict[tuple[str, Change, bytes], tuple[Attempt, ...]] = {}
        self._failures: Counter[str] = Counter()  # more than expected, of each shortcut

    def attempts(self, shortcut: Shortcut, sight: Sight, state: State) -> tuple[Attempt, ...]:
        """Attempts that succeeded, the shortest first; none of one that was given up."""
        key = (shortcut.name, sight.change, state.key)
        if key not in self._memory and self.gave_up(shortcut):
            return ()
        if key not in self._memory:
            seed = sha256(repr(key[:2]).encode() + state.key).digest()[:8]
            rng = np.random.default_rng(int.from_bytes(seed, "little"))
            self._memory[key] = self._try(shortcut.policy, sight, state, rng)
            self._failures[shortcut.name] += -HOPE if self._memory[key] else 1
        return self._memory[key]

    def gave_up(self, shortcut: Shortcut) -> bool:
        """Whether it failed again and again in this task: a useless one shall not cost much."""
        return self._failures[shortcut.name] >= HOPE

    def _try(
        self, policy: Policy, sight: Sight, state: State, rng: np.random.Generator
    ) -> tuple[Attempt, ...]:
        sampling = self.sampling
        daring = sampling.temperature * np.linspace(1.0, DARING, self._at_once, dtype=np.float32)

        def choose(_: int, seen: Weights) -> Weights:
            return policy.sample(seen, rng, daring[:, None])

        def calmly(_: int, seen: Weights) -> Weights:
            return policy.mean(seen)

        calm = self._attempt(self._alone, sight, state, calmly, sampling.horizon)
        found = _Found(sampling.ends, next(iter(calm), None))
        for failures in range(0, self._count, self._at_once):
            if not found.attempts and failures + 1 >= sampling.patience:
                break
            limit = found.limit(sampling.horizon)
            found.add(self._attempt(self._crowd, sight, state, choose, limit))
        for number in range(sampling.refinements if found.attempts else 0):
            self._refine(found, sight, state, sampling.spread * NARROWER**number, rng)
        return tuple(found.attempts)

    def _refine(
        self, found: _Found, sight: Sight, state: State, spread: float, rng: np.random.Generator
    ) -> None:
        """Try random variations of the shortest: a round of a cross-entropy search."""
        middle = np.clip(np.array(found.attempts[0].choices), -1.0, 1.0)[:, None]
        shape = (len(middle), self._at_once, middle.shape[-1])
        for _ in range(0, self._count + 1, self._at_once):
            script = _scripted(middle + spread * rng.standard_normal(shape, dtype=np.float32))
            limit = found.limit(len(middle))
            found.add(self._attempt(self._crowd, sight, state, script, limit))

    def _attempt(
        self, worlds: VectorWorld, sight: Sight, state: State, choose: Choose, limit: int
    ) -> list[Attempt]:
        """Run in all of the worlds for at most ``limit`` steps, and stop when enough succeeded."""
        target = sight.change.apply(sight.space.abstract(state))
        count = len(worlds.states.data)
        for world in range(count):
            worlds.reset(world, state)
        states = worlds.states
        seen = sight.look(states).observations
        alive = np.ones(count, dtype=bool)
        past: list[tuple[State, Weights]] = []
        reached: list[Attempt] = []
        for step in range(limit):
            choices = choose(step, seen)
            past.append((states, choices))
            alive &= ~np.isnan(choices).any(axis=-1)  # a policy may want what is no number
            states = worlds.step(sight.actions(np.nan_to_num(choices).astype(np.float64)))
            look = sight.look(states)
            done = alive & sight.done(states, look, [target] * count)
            reached += [_run(past, int(world)) for world in np.flatnonzero(done)]
            alive &= ~done & ~look.lost
            if not alive.any() or len(reached) >= self.sampling.ends:
                break
            seen = look.observations
        return reached


def _run(past: Sequence[tuple[State, Weights]], world: int) -> Attempt:
    """What happened in one of the worlds."""
    return Attempt(
        tuple(choices[world] for _, choices in past),
        tuple(State(states.layout, states.data[world]) for states, _ in past),
    )


def _scripted(script: Weights) -> Choose:
    return lambda step, _: script[step]


@dataclass(frozen=True)
class GroundShortcut:
    """A shortcut for given objects: the skill behind a shortcut edge.

    Args:
        attempt: Which of its attempts, the shortest first.
    """

    shortcut: Shortcut
    change: Change
    attempt: int
    sight: Sight = field(compare=False, repr=False)
    rehearsal: Rehearsal = field(compare=False, repr=False)

    @property
    def name(self) -> str:
        """The shortcut's name."""
        return self.shortcut.name

    @property
    def step_limit(self) -> int:
        """Environment steps after which it counts as failed."""
        return self.rehearsal.sampling.horizon

    @property
    def least_steps(self) -> int:
        """Half of the shortest success in training, which sampling may well beat."""
        return max(1, self.shortcut.shortest // 2)

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """The same from every state."""
        del state, objects
        return self.least_steps

    def start(self, state: State, objects: tuple[Object, ...]) -> Control:
        """Try it out, and follow an attempt.

        Raises:
            SkillNotApplicableError: Not so many attempts succeeded.
        """
        attempts = self.rehearsal.attempts(self.shortcut, self.sight, state)
        if self.attempt >= len(attempts):
            raise SkillNotApplicableError(
                f"{self.name}({', '.join(obj.name for obj in objects)}) reaches its target "
                f"{len(attempts)} times within {self.step_limit} steps in the model; attempt "
                f"{self.attempt + 1} was asked for"
            )
        return Performance(self, attempts[self.attempt])

    def act(self, choice: Weights) -> Action:
        """The robot's action for a choice of the policy."""
        return self.sight.actions(choice.astype(np.float64))


class Performance:
    """Follows an attempt as long as all goes as foreseen; then the policy, closed loop.

    Things that are pushed never move quite as foreseen in a real world, nor are they seen while
    they move. As long as the robot itself is where it should be, what was rehearsed is still the
    best guess: it ends where the next option can begin, which the bare policy does not promise.
    """

    def __init__(self, skill: GroundShortcut, attempt: Attempt) -> None:
        self._skill = skill
        self._foreseen: Sequence[tuple[State, Weights]] = list(
            zip(attempt.states, attempt.choices, strict=True)
        )
        self._step = 0

    def __call__(self, state: State) -> Action:
        """The next action."""
        if self._step < len(self._foreseen):
            foreseen, choice = self._foreseen[self._step]
            if self._as_foreseen(state, foreseen):
                self._step += 1
                return self._skill.act(choice)
        self._foreseen = ()
        seen = self._skill.sight.look(state.alone()).observations
        return self._skill.act(self._skill.shortcut.policy.mean(seen)[0])

    def _as_foreseen(self, state: State, foreseen: State) -> bool:
        off = np.abs(state.data - foreseen.data)
        if off.max() <= SAME:
            return True
        own = self._skill.sight.robot_features
        return bool(own.size and off[own].max() <= ALIKE)
