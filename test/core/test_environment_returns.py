# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Environments as others write them: what is wrong with what they return, and what is wanted."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest

from slap_ros.core.gymnasium_world import GymnasiumWorld
from slap_ros.core.kinder_world import KinderBridge
from slap_ros.core.rebuild_each_step import RebuildEachStep
from slap_ros.errors import InvalidDomainError, InvalidStateError
from slap_ros.relational import Layout, State

gymnasium = pytest.importorskip("gymnasium")
import marbles  # noqa: E402
from gymnasium.wrappers import (  # noqa: E402
    FlattenObservation,
    PassiveEnvChecker,
    TimeLimit,
    TransformObservation,
)
from marbles.environment import MarblesEnv  # noqa: E402

DOMAIN = marbles.make("fair")
INITIAL = DOMAIN.task(0).initial_state
REST = np.zeros(4)


def returning(reset=lambda told: told, step=lambda told: told):
    """A kind of the environment that returns something else."""

    class Other(MarblesEnv):
        def reset(self, **options):
            return reset(super().reset(**options))

        def step(self, action):
            return step(super().step(action))

    return Other()


def observing(change):
    """One whose observations are changed."""
    return returning(*[lambda told: (change(told[0]), *told[1:])] * 2)


def world(environment):
    return GymnasiumWorld(environment, INITIAL, DOMAIN.action_space)


def single(observation):
    return {name: features.astype(np.float32) for name, features in observation.items()}


def by_feature(observation):
    return observation | {"hand": dict(zip("xyz", observation["hand"], strict=True))}


def spaces():
    return gymnasium.spaces.Dict({name: gymnasium.spaces.Box(0, 1, (3,)) for name in names()})


def names():
    return [obj.name for obj in INITIAL.layout.objects]


def with_spaces(environment=None):
    environment = environment or MarblesEnv()
    environment.observation_space = spaces()
    return environment


AT_RESET = {
    "float32": (lambda: observing(single), r"float32: 0\.\d+ became 0\.\d{9,} \(hand\.x\)"),
    "float32 inside": (
        lambda: observing(lambda o: {k: v.astype(np.float64) for k, v in single(o).items()}),
        "keeps states in float32",
    ),
    "the observation alone": (
        lambda: returning(lambda told: told[0]),
        r"reset of Other returned a dictionary with hand, .*must return \(observation, info",
    ),
    "nothing": (lambda: returning(lambda _: None), "returned None; it must return"),
    "three": (lambda: returning(lambda told: (*told, {})), "returned a tuple of 3; it must"),
    "no options": (lambda: OldEnvironment(), r"reset of Old\w+ raised TypeError: .*options"),
    "an array": (lambda: observing(lambda o: np.concatenate([*o.values()])), r"of shape \(\d+,"),
    "an entry": (
        lambda: observing(lambda o: {"observation": o, "desired_goal": 1}),
        "observes desired_goal, observation; .*in its entry 'observation'",
    ),
    "numbers as keys": (lambda: observing(lambda o: {1: o, "a": o}), "observes 1, a; "),
    "features by name": (
        lambda: observing(by_feature),
        "hand as a dictionary with x, y, z; a robot has x, y, z, one array of them in this order",
    ),
    "text": (lambda: observing(lambda o: o | {"hand": "here"}), "hand as a value of type str"),
    "a batch": (lambda: observing(lambda o: o | {"hand": o["hand"][None]}), r"shape \(1, 3\)"),
    "no numbers": (lambda: observing(lambda o: o | {"hand": [0, np.nan, 0]}), "hand.y as nan"),
    "flattened": (
        lambda: FlattenObservation(with_spaces()),
        r"an array of shape .*wrapped in FlattenObservation.*give env\.unwrapped",
    ),
    "transformed": (
        lambda: TransformObservation(TimeLimit(with_spaces(), 9), single, spaces()),
        r"float32: .*wrapped in TransformObservation, TimeLimit",
    ),
    "checked": (
        lambda: PassiveEnvChecker(with_spaces(returning(lambda told: told[0]))),
        "returned a dictionary .*wrapped in PassiveEnvChecker",
    ),
}  # fmt: skip


class OldEnvironment:
    """As Gym had it: no options, and the observation alone."""

    def reset(self):
        return {}


@pytest.mark.filterwarnings("ignore")  # Gymnasium's own, about the same
@pytest.mark.parametrize("name", AT_RESET)
def test_what_a_reset_returns_is_named_with_what_is_wanted(name):
    make, words = AT_RESET[name]
    with pytest.raises(InvalidDomainError, match=words):
        world(make())


AT_STEP = {
    "the observation alone": (lambda told: told[0], r"step of Other returned a d.*must return \("),
    "nothing": (lambda _: None, "returned None; it must return"),
    "nothing of it": (lambda told: (None, *told[1:]), "observes None; a dictionary is wanted"),
    "infinity": (lambda told: (told[0] | {"hand": [np.inf] * 3}, *told[1:]), "hand.x as inf"),
}  # fmt: skip


@pytest.mark.parametrize("name", AT_STEP)
def test_what_a_step_returns_is_named_with_what_is_wanted(name):
    change, words = AT_STEP[name]
    played = world(returning(step=change))
    with pytest.raises(InvalidDomainError, match=words):
        played.step(REST)
    assert played.state is INITIAL


def test_a_step_as_it_was_before_truncation_is_taken():
    assert world(returning(step=lambda told: (*told[:3], told[4]))).step(REST) == INITIAL


def test_an_environment_that_refuses_our_numbers_is_told_its_precision():
    class Strict(MarblesEnv):
        def step(self, action):
            assert self.action_space.contains(action), "invalid action"
            return super().step(action)

    with pytest.raises(
        InvalidDomainError, match=r"AssertionError: invalid .*space is float32, and"
    ):
        world(Strict()).step(REST)


def test_errors_of_ours_pass_unchanged():
    def refuse(told):
        raise InvalidStateError("as it is")

    with pytest.raises(InvalidStateError, match=r"^as it is$"):
        world(returning(refuse))


# -- simulators that are rebuilt -----------------------------------------------------------------


def rebuilt(step, **more):
    """A world of simulators that return this."""
    return RebuildEachStep(
        lambda state: SimpleNamespace(step=lambda _: step(state), **more),
        INITIAL,
        DOMAIN.action_space,
    )


FEWER = State(Layout.of(INITIAL.layout.objects[:1]), INITIAL[INITIAL.layout.objects[0]])
SIMULATED = {
    "a tuple": (lambda _: ({}, 0.0, False, False, {}), "returned a tuple of 5; it must return"),
    "an array": (lambda state: state.data.copy(), r"returned an array of shape .* the State"),
    "other objects": (lambda _: FEWER, "returned a state of hand; the objects are hand, marble1"),
    "no numbers": (lambda s: State(s.layout, s.data * np.nan), "returned hand.x as nan"),
}  # fmt: skip


@pytest.mark.parametrize("name", SIMULATED)
def test_what_a_simulator_returns_is_named_with_what_is_wanted(name):
    step, words = SIMULATED[name]
    played = rebuilt(step)
    with pytest.raises(InvalidDomainError, match=words):
        played.step(REST)
    assert played.state is INITIAL


def test_a_simulator_that_rounds_its_state_or_cannot_be_stepped_is_refused():
    rounded = State(INITIAL.layout, INITIAL.data.astype(np.float32))
    with pytest.raises(InvalidDomainError, match="float32"):
        rebuilt(lambda state: state, state=rounded)
    with pytest.raises(InvalidDomainError, match=r"make_simulator.* must continue from it exactly"):
        rebuilt(lambda state: state, state=State(INITIAL.layout, INITIAL.data + 0.5))
    with pytest.raises(
        InvalidDomainError, match="returned a dictionary with a; it must return some"
    ):
        RebuildEachStep(lambda _: {"a": 1}, INITIAL, DOMAIN.action_space)
    assert rebuilt(lambda state: state, state=INITIAL).step(REST) is INITIAL


# -- object-centric environments, as KinDER has them --------------------------------------------


@dataclass(frozen=True)
class Kind:
    name: str = "disc"
    parent: object = None


@dataclass(frozen=True)
class Thing:
    name: str
    type: Kind = Kind()


@dataclass
class Seen:
    data: dict = field(default_factory=dict)

    def copy(self):
        return Seen({thing: features.copy() for thing, features in self.data.items()})


class Discs:
    """Two discs on a line."""

    type_features = {Kind(): ["x", "radius"]}  # noqa: RUF012
    initial_constant_state = None
    action_space = SimpleNamespace(low=np.array([-1.0]), high=np.array([1.0]))
    dtype = np.float64

    def reset(self, *, seed=None, options=None):
        sampled = {Thing(name): np.array([0.1, 0.2]) for name in ("a", "b")}
        begun = options["init_state"].data if options else sampled
        self.seen = Seen({thing: f.astype(self.dtype) for thing, f in begun.items()})
        return self.seen.copy(), {}

    def step(self, action):
        self.seen.data[Thing("a")][0] += action[0]
        return self.seen.copy(), 0.0, False, False, {}


class Wrapped:
    """Hides all but Gymnasium's own methods, as its wrappers do."""

    def __init__(self, env):
        self.env, self.reset, self.step = env, env.reset, env.step


def discs(**changed):
    return lambda: type("Other", (Discs,), changed)()


def test_an_environment_that_keeps_to_it_is_a_world():
    bridge = KinderBridge(Discs)
    simulator = bridge.simulator(bridge.sample(0))
    assert simulator.step(np.array([0.25])).data.tolist() == [0.35, 0.2, 0.1, 0.2]


KINDER = {
    "the state alone": (discs(reset=lambda *_, **__: Seen()), r"must return \(observation, info\)"),
    "an array": (discs(reset=lambda *_, **__: (np.zeros(4), {})), "features by object is wanted"),
    "a dictionary": (discs(reset=lambda *_, **__: ({"a": 1}, {})), "ObjectCentric"),
    "wrapped": (lambda: Wrapped(Discs()), "type_features of Wrapped .*give env.unwrapped"),
    "raises": (discs(reset=lambda *_, **__: 1 / 0), "reset of Other raised ZeroDivisionError"),
}  # fmt: skip


@pytest.mark.parametrize("name", KINDER)
def test_what_is_no_object_centric_environment_is_named(name):
    make, words = KINDER[name]
    with pytest.raises(InvalidDomainError, match=words):
        KinderBridge(make)


def test_object_centric_states_are_checked_as_observations_are():
    bridge = KinderBridge(discs(dtype=np.float32))
    layout = bridge.layout
    with pytest.raises(InvalidDomainError, match=r"float32: 0\.1 became 0\.10000000149 \(a\.x\)"):
        bridge.simulator(State(layout, [0.1, 0.2, 0.1, 0.2]))
    assert bridge.simulator(bridge.sample(0)).step(np.array([0.5]))  # those of its own come back
    short = Seen({Thing(name): np.zeros(n) for name, n in (("a", 2), ("b", 1))})
    with pytest.raises(InvalidDomainError, match=r"observes b with shape \(1,\)"):
        bridge.state_of(short)
    with pytest.raises(InvalidDomainError, match="observes None"):
        bridge.state_of(None)


def test_a_step_of_an_object_centric_environment_is_checked():
    for step, words in (
        (lambda *_: Seen(), "step of Other returned a value of type Seen; it must return"),
        (lambda *_: (None, 0, False, False, {}), "observes None"),
        (lambda *_: [][0], "step of Other raised IndexError"),
    ):
        bridge = KinderBridge(discs(step=step))
        with pytest.raises(InvalidDomainError, match=words):
            bridge.simulator(bridge.sample(0)).step(np.zeros(1))
