# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A learned shortcut, and how it is tried out in the planner's model before it is used."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256

import numpy as np

from slap_ros.domains import Policy as Control
from slap_ros.domains import World
from slap_ros.domains.domain import Action
from slap_ros.errors import InvalidCommandError, SkillNotApplicableError
from slap_ros.relational import Object, State
from slap_ros.shortcuts.policy import Policy, Weights
from slap_ros.shortcuts.sight import Sight
from slap_ros.shortcuts.signature import Change, Signature

HOPE = 3  # failures, on top of as many for each success, before a shortcut is given up
# Environment steps by which another attempt must be shorter to be taken instead: without noise a
# policy ends where training did, mostly well for what comes next; noise ends anywhere.
WORTH = 2
NARROWER = 0.7  # of the spread of variations from one round to the next
SAME = 1e-6  # in any feature's unit: up to here a state is the one that was foreseen


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
        samples: Attempts, the first without noise. The shortest that succeeds is used.
        refinements: Rounds of random variations of the best, a cross-entropy search's last ones.
        horizon: Environment steps of an attempt (the paper's T_eval).
        temperature: Of the noise, against training's: in a model, daring costs nothing.
        patience: Failed attempts after which, without any success, it is given up.
        spread: Standard deviation of the first refinement, of actions from -1 to 1.
    """

    samples: int = 16
    refinements: int = 1
    temperature: float = 2.0
    horizon: int = 40
    patience: int = 16
    spread: float = 0.35


DEFAULT = Sampling()
PAPER = Sampling(samples=1, refinements=0, temperature=1.0, horizon=100)


@dataclass(frozen=True)
class Attempt:
    """One run of a shortcut in the model."""

    choices: tuple[Weights, ...]  # the policy's actions, from -1 to 1
    states: tuple[State, ...]  # in which they were chosen
    reached: bool

    @property
    def steps(self) -> int:
        """Environment steps."""
        return len(self.choices)


Choose = Callable[[int, Weights], Weights]  # step and observation, (1, size), to (actions,)


class Rehearsal:
    """Tries shortcuts out in a world of its own, and remembers what came of it.

    The outcome is a function of the shortcut, the change and the state: noise comes from a
    generator that is seeded with them. So planner, skill server and replay agree.
    """

    def __init__(self, world: World, sampling: Sampling) -> None:
        """Rehearse in ``world``, which nobody else may use."""
        self.sampling = sampling
        self._world = world
        self._memory: dict[tuple[str, Change, bytes], Attempt] = {}
        self._failures: Counter[str] = Counter()  # more than expected, of each shortcut

    def best(self, shortcut: Shortcut, sight: Sight, state: State) -> Attempt:
        """The shortest attempt that succeeded; if none did, any.

        One that was given up is not tried.
        """
        key = (shortcut.name, sight.change, state.key)
        if key not in self._memory and self.gave_up(shortcut):
            return Attempt((), (), False)
        if key not in self._memory:
            seed = sha256(repr(key[:2]).encode() + state.key).digest()[:8]
            rng = np.random.default_rng(int.from_bytes(seed, "little"))
            best = self._sample(shortcut.policy, sight, state, rng)
            self._memory[key] = self._refine(best, sight, state, rng)
            self._failures[shortcut.name] += -HOPE if best.reached else 1
        return self._memory[key]

    def gave_up(self, shortcut: Shortcut) -> bool:
        """Whether it failed again and again in this task: a useless one shall not cost much."""
        return self._failures[shortcut.name] >= HOPE

    def _sample(
        self, policy: Policy, sight: Sight, state: State, rng: np.random.Generator
    ) -> Attempt:
        def choose(_: int, seen: Weights) -> Weights:
            noisy: Weights = policy.sample(seen, rng, self.sampling.temperature)[0]
            return noisy

        best = self._attempt(sight, state, lambda _, seen: policy.mean(seen)[0])
        for failures in range(1, self.sampling.samples):
            if not best.reached and failures >= self.sampling.patience:
                break
            noisy = self._attempt(sight, state, choose, _shorter(best))
            best = noisy if noisy.reached else best
        return best

    def _refine(
        self, best: Attempt, sight: Sight, state: State, rng: np.random.Generator
    ) -> Attempt:
        """The shortest of random variations of the best, then of that one, and so on."""
        sampling, spread = self.sampling, self.sampling.spread
        for _ in range(sampling.refinements if best.reached else 0):
            middle = np.clip(np.array(best.choices), -1.0, 1.0)
            for _ in range(sampling.samples):
                varied = middle + spread * rng.standard_normal(middle.shape, dtype=np.float32)
                attempt = self._attempt(sight, state, _scripted(varied), _shorter(best))
                best = attempt if attempt.reached else best
            spread *= NARROWER
        return best

    def _attempt(
        self, sight: Sight, state: State, choose: Choose, limit: int | None = None
    ) -> Attempt:
        """Run for at most ``limit`` steps, the horizon if None."""
        target = sight.change.apply(sight.space.abstract(state))
        self._world.reset(state)
        seen = sight.look(state.alone()).observations
        choices: list[Weights] = []
        states: list[State] = []
        for step in range(self.sampling.horizon if limit is None else limit):
            choice = choose(step, seen)
            states.append(state)
            choices.append(choice)
            try:
                state = self._world.step(sight.actions(choice.astype(np.float64)))
            except InvalidCommandError:  # a policy that wants what is no number
                break
            batch = state.alone()
            look = sight.look(batch)
            if sight.done(batch, look, [target])[0]:
                return Attempt(tuple(choices), tuple(states), True)
            if sight.view.lost(batch)[0]:
                break
            seen = look.observations
        return Attempt(tuple(choices), tuple(states), False)


def _shorter(best: Attempt) -> int | None:
    """How long an attempt may be to be worth taking instead of the best; None: any length."""
    return best.steps - WORTH if best.reached else None


def _scripted(script: Weights) -> Choose:
    return lambda step, _: script[step]


@dataclass(frozen=True)
class GroundShortcut:
    """A shortcut for given objects: the skill behind a shortcut edge."""

    shortcut: Shortcut
    change: Change
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
        """Try it out, and follow the best attempt.

        Raises:
            SkillNotApplicableError: No attempt succeeded.
        """
        attempt = self.rehearsal.best(self.shortcut, self.sight, state)
        if not attempt.reached:
            raise SkillNotApplicableError(
                f"{self.name}({', '.join(obj.name for obj in objects)}) does not reach its target "
                f"within {self.step_limit} steps in the model"
            )
        return Performance(self, attempt)

    def act(self, choice: Weights) -> Action:
        """The robot's action for a choice of the policy."""
        return self.sight.actions(choice.astype(np.float64))


class Performance:
    """Follows an attempt as long as all goes as foreseen; then the policy, closed loop."""

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
            if np.abs(state.data - foreseen.data).max() <= SAME:
                self._step += 1
                return self._skill.act(choice)
        self._foreseen = ()
        seen = self._skill.sight.look(state.alone()).observations
        return self._skill.act(self._skill.shortcut.policy.mean(seen)[0])
