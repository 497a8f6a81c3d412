# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A toy domain whose skills are learned in seconds: a hand in the plane carries points to places.

It has no operators and skills of its own, as the domains with contact: `Pick` and `Put` are to be
acquired.
"""

import hashlib
from dataclasses import replace
from functools import partial

import numpy as np

from slap_ros.acquisition.training.skill_env import Initiation
from slap_ros.core import (
    Acquisition,
    ActionSpace,
    Domain,
    Execution,
    GripperAxis,
    LearnerInterface,
    Learning,
    SideApproach,
    Task,
    presets,
)
from slap_ros.relational import (
    Column,
    Feature,
    LiftedAtom,
    LiftedOperator,
    Metric,
    NormalisedForm,
    Predicate,
    RewardTemplate,
    RewardTerm,
    State,
    Type,
    Variable,
)
from slap_ros.relational.metrics import TRUTH, at_most, is_false, is_true

XY = ("x", "y")
POSITION = tuple(Feature(name, "m") for name in XY)
HAND = Type("hand", (*POSITION, Feature("closed", TRUTH)))
PLACE = Type("place", POSITION)
THING = Type("thing", (*POSITION, Feature("held", TRUTH)), PLACE)
AXES = (Feature("dx", "m"), Feature("dy", "m"), Feature("gripper", "1"))
STEP = 0.02  # m, the most that the hand moves in a step
GRASP = 0.009  # m, from the thing, where closing the gripper grasps it
PUSH = 0.04  # m, up to where a hand whose gripper is left alone pushes what is before it
NEAR = 0.01  # m
BEFORE = 0.04  # m, from where a skill acts to where it begins
HORIZON = 12
SCALE = 0.05  # m, of what is observed


def hand_xy(state):
    (hand,) = state.layout.of_type(HAND)
    return state.gather(Column((hand,)), XY)[..., 0, :]


def dis_to_obj(state, place):
    return float(np.linalg.norm(hand_xy(state) - state[place][:2]))


def dis_to_obj_of_all(state, places):
    return np.linalg.norm(state.gather(places, XY) - hand_xy(state)[..., None, :], axis=-1)


def is_held(state, thing):
    return float(state.get(thing, "held"))


def is_held_of_all(state, things):
    return state.stack(things, "held")


def parallel_dis(state, thing, place):
    return float(np.linalg.norm(state[thing][:2] - state[place][:2]))


def parallel_dis_of_all(state, things, places):
    return np.linalg.norm(state.gather(things, XY) - state.gather(places, XY), axis=-1)


NEARER = NormalisedForm.closeness(10.0)
DIS_TO_OBJ = Metric(
    "dis_to_obj", (PLACE,), "m", "Hand to place.", dis_to_obj_of_all, dis_to_obj, NEARER, True
)
IS_HELD = Metric(
    "is_held",
    (THING,),
    TRUTH,
    "Whether it is held.",
    is_held_of_all,
    is_held,
    NormalisedForm.truth(),
    True,
)
PARALLEL_DIS = Metric(
    "parallel_dis",
    (THING, PLACE),
    "m",
    "Thing to place.",
    parallel_dis_of_all,
    parallel_dis,
    NEARER,
)


def _empty(state):
    return ~(state.stack(Column(state.layout.of_type(THING)), "held") > 0.5).any(axis=-1)[..., None]


HAND_EMPTY = Predicate("HandEmpty", (), _empty, description="nothing is held")
HOLDING = Predicate.of("Holding", (THING,), [is_true(IS_HELD)])
LOOSE = Predicate.of("Loose", (THING,), [is_false(IS_HELD)])
AT = Predicate.of("At", (THING, PLACE), [at_most(PARALLEL_DIS, NEAR), is_false(IS_HELD, 0)])

T, P = Variable("?thing", THING), Variable("?place", PLACE)
PICK = LiftedOperator(
    "Pick",
    (T,),
    frozenset({LiftedAtom(HAND_EMPTY, ()), LiftedAtom(LOOSE, (T,))}),
    frozenset({LiftedAtom(HOLDING, (T,))}),
    frozenset({LiftedAtom(HAND_EMPTY, ()), LiftedAtom(LOOSE, (T,))}),
)
PUT = LiftedOperator(
    "Put",
    (T, P),
    frozenset({LiftedAtom(HOLDING, (T,))}),
    frozenset({LiftedAtom(HAND_EMPTY, ()), LiftedAtom(LOOSE, (T,)), LiftedAtom(AT, (T, P))}),
    frozenset({LiftedAtom(HOLDING, (T,))}),
)
REWARDS = {
    "Pick": RewardTemplate("Pick", (RewardTerm(DIS_TO_OBJ, (T,), 0.5),)),
    "Put": RewardTemplate("Put", (RewardTerm(PARALLEL_DIS, (T, P), 0.5),)),
}


class Points:
    """Many worlds at once: the hand moves by the action, and takes along what it holds."""

    def __init__(self, states):
        self.layout, self._data = states[0].layout, np.stack([s.data for s in states])
        (self._hand,) = (self.layout.slices[hand] for hand in self.layout.of_type(HAND))
        self._things = [self.layout.slices[thing] for thing in self.layout.of_type(THING)]

    @property
    def states(self):
        return State(self.layout, self._data.copy())

    def reset(self, world, state):
        self._data[world] = state.data

    def step(self, actions):
        for row, action in zip(self._data, actions, strict=True):
            self._move(row, action)
        return self.states

    def _move(self, row, action):
        hand = row[self._hand]
        hand[:2] += action[:2]
        hand[2] = 1.0 if action[2] > 0 else 0.0 if action[2] < 0 else hand[2]
        held = [part for part in self._things if row[part][2] > 0.5]
        for part in held:
            row[part][:2], row[part][2] = hand[:2], hand[2]
        if not held and action[2] > 0:
            for part in self._things:
                if np.linalg.norm(row[part][:2] - hand[:2]) <= GRASP:
                    row[part][:2], row[part][2] = hand[:2], 1.0
                    return


class PushedPoints(Points):
    """The same, but an empty hand whose gripper is left alone pushes what is before it."""

    def _move(self, row, action):
        if action[2] == 0 and not any(row[part][2] > 0.5 for part in self._things):
            for part in self._things:
                way = row[part][:2] - row[self._hand][:2]
                if GRASP < np.linalg.norm(way) <= PUSH and way @ action[:2] > 0:
                    row[part][:2] += action[:2]
        super()._move(row, action)


class Point:
    """One of these worlds by itself."""

    def __init__(self, state, worlds=Points):
        self._world = worlds([state])

    @property
    def state(self):
        states = self._world.states
        return State(states.layout, states.data[0])

    def reset(self, state):
        self._world.reset(0, state)

    def step(self, action):
        ACTIONS.check(action)
        self._world.step(action[None])
        return self.state


ACTIONS = ActionSpace(AXES, (-STEP, -STEP, -1.0), (STEP, STEP, 1.0), GripperAxis("gripper"))


def approach(state, objects):
    """Straight to a point before the last object, at an angle that the state decides."""
    seed = hashlib.sha256(state.key + objects[-1].name.encode()).digest()[:8]
    angle = np.random.default_rng(int.from_bytes(seed, "little")).uniform(0.0, 2.0 * np.pi)
    goal = state[objects[-1]][:2] + BEFORE * np.array([np.cos(angle), np.sin(angle)])

    def policy(now):
        way = goal - hand_xy(now)
        if np.linalg.norm(way) < 1e-6:
            return None
        opens = 0.0 if now.stack(Column(now.layout.of_type(THING)), "held").any() else -1.0
        return np.array([*np.clip(way, -STEP, STEP), opens])

    return policy


def sides(state, obj):
    """Behind a thing, as seen from each place, so that the hand pushes it there."""
    if not obj.type.is_a(THING):
        return ()
    places = (place for place in state.layout.of_type(PLACE) if not place.type.is_a(THING))
    return tuple(_behind(state, obj, place) for place in places)


def _behind(state, thing, place):
    way = state[place][:2] - state[thing][:2]
    way = way / np.linalg.norm(way)
    goal = state[thing][:2] - BEFORE * way

    def policy(now):
        left = goal - hand_xy(now)
        return None if np.linalg.norm(left) < 1e-6 else np.array([*np.clip(left, -STEP, STEP), 0.0])

    return SideApproach(policy, np.array([*STEP * way / np.abs(way).max(), 0.0]), "behind")


def _script(gripper):
    """Straight to the last object, then the gripper does its part."""

    def script(state, objects):
        goal = state[objects[-1]][:2]

        def policy(now):
            way = goal - hand_xy(now)
            there = np.linalg.norm(way) < 1e-6
            return np.array([*np.clip(way, -STEP, STEP), gripper if there else 0.0])

        return policy

    return script


SCRIPTS = {"Pick": _script(1.0), "Put": _script(-1.0)}


def _robot(state, hand):
    return state.stack(Column(state.layout.of_type(HAND)), "closed")


def _objects(state, hand, column):
    relative = (state.gather(column, XY) - hand[..., None, :]) / SCALE
    if not column.objects[0].type.is_a(THING):
        return relative
    return np.concatenate([relative, state.gather(column, ("held",))], axis=-1)


def _distance(state, hand, column):
    return np.linalg.norm(state.gather(column, XY) - hand[..., None, :], axis=-1)


def _separation(state, obj, column):
    return np.linalg.norm(state.gather(column, XY) - state[obj][..., None, :2], axis=-1)


def reach(opens):
    """A script: go to the last object with a closed hand; there, open it if that is meant."""

    def script(state, objects):
        before = approach(state, objects)
        near = False

        def policy(now):
            nonlocal near
            action = None if near else before(now)
            if action is not None:
                return action
            near = True
            way = now[objects[-1]][:2] - hand_xy(now)
            there = np.linalg.norm(way) < NEAR / 2
            return np.array([*np.clip(way, -STEP, STEP), -1.0 if there and opens else 1.0])

        return policy

    return script


def begin(operator, tasks, seed=5):
    """Where a skill begins in some tasks, the approach done, with groundings in turn."""
    found = []
    for index in tasks:
        state = POINTS.task(seed, index).initial_state
        names = state.layout.by_name
        thing, place = names[f"thing{index % 2}"], names[f"place{index // 2 % 2}"]
        objects = (thing,) if operator is PICK else (thing, place)
        if operator is PUT:
            x, y, _ = state[thing]
            hand = names["hand"]
            state = state.replace(
                {(hand, "x"): x, (hand, "y"): y, (hand, "closed"): 1.0, (thing, "held"): 1.0}
            )
        world, policy = Point(state), approach(state, objects)
        while (action := policy(world.state)) is not None:
            world.step(action)
        found.append(Initiation(world.state, objects))
    return found


SCRIPTS = {"Pick": reach(opens=False), "Put": reach(opens=True)}


def sample_task(rng, things=2):
    hand = HAND("hand")
    loose, places = ([kind(f"{kind}{i}") for i in range(things)] for kind in (THING, PLACE))
    spots = iter(rng.permutation(np.linspace(-0.3, 0.3, 4 * things)))
    features = {hand: {"x": 0.0, "y": 0.3, "closed": 0.0}}
    for obj in (*loose, *places):
        features[obj] = {"x": next(spots), "y": rng.uniform(-0.1, 0.1)}
        features[obj] |= {"held": 0.0} if obj.type.is_a(THING) else {}
    state = State.build(features)
    return Task(state, goal_of(state), 400)


def sample_line(rng, things=1):
    """Hand, thing, place, next thing and its place, in a line: a hand may push things along it."""
    task = sample_task(rng, things)
    angle = rng.uniform(0.0, 2.0 * np.pi)
    way = 0.05 * np.array([np.cos(angle), np.sin(angle)])
    (hand,) = task.initial_state.layout.of_type(HAND)
    pairs = (atom.objects for atom in sorted(task.goal, key=str))
    line = (hand, *(obj for pair in pairs for obj in pair))
    positions = {obj: number * way for number, obj in enumerate(line)}
    changes = {(obj, f): v for obj, xy in positions.items() for f, v in zip(XY, xy, strict=True)}
    return replace(task, initial_state=task.initial_state.replace(changes))


def goal_of(state):
    things = [obj for obj in state.objects if obj.type == THING]
    places = [obj for obj in state.objects if obj.type == PLACE]
    return frozenset(AT(thing, place) for thing, place in zip(things, places, strict=True))


def swapped(state):
    things = [obj for obj in state.objects if obj.type == THING]
    places = [obj for obj in state.objects if obj.type == PLACE]
    return frozenset(AT(thing, place) for thing, place in zip(things, places[::-1], strict=True))


SAMPLERS = {
    "two": sample_task,
    "three": lambda rng: sample_task(rng, 3),
    "line": sample_line,
    "long_line": lambda rng: sample_line(rng, 2),
}


def _make(preset):
    worlds = PushedPoints if preset.endswith("line") else Points
    return Domain(
        name="points",
        preset=preset,
        types=(HAND, PLACE, THING),
        predicates=(HAND_EMPTY, HOLDING, LOOSE, AT),
        action_space=ACTIONS,
        sample_task=SAMPLERS[preset],
        make_world=partial(Point, worlds=worlds),
        default_goal=goal_of,
        step_limit=400,
        execution=Execution(0.05),
        metrics=(DIS_TO_OBJ,),
        static=frozenset(),
        goals={"train": goal_of, "swapped": swapped},
        robot_types=frozenset({HAND}),
        learning=Learning(
            LearnerInterface(
                hand_xy,
                _robot,
                _objects,
                _distance,
                _separation,
                grasping=frozenset({HAND_EMPTY, HOLDING, LOOSE}),
            ),
            make_vector_world=worlds,
        ),
        acquisition=Acquisition(approach, (PICK, PUT), REWARDS, SCRIPTS, HORIZON, sides=sides),
    )


make = presets(*SAMPLERS)(_make)
POINTS = _make("two")

assert POINTS.learning is not None
INTERFACE = POINTS.learning.interface
