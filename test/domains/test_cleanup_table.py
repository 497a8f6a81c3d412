# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cleanup Table: predicates, tasks, and tables really cleared in PyBullet."""

import math
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.cleanup_table import make
from slap_ros.domains.cleanup_table.features import BLOCK, WALL
from slap_ros.domains.cleanup_table.relations import (
    ASIDE,
    BAND,
    CLEAR,
    HAND_CLEAR,
    LOW,
    OVER,
    SLOW,
    TIP,
)
from slap_ros.domains.cleanup_table.scene import BIN, FLOOR_TOP, TABLE, scene_of
from slap_ros.domains.cleanup_table.shapes import TOYS, WIPER, shipped
from slap_ros.domains.cleanup_table.tasks import make_task
from slap_ros.errors import ErrorCode, InvalidParameterError
from slap_ros.evaluation import experiment
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.geometry.pose import Pose, rotate
from slap_ros.meshes.solid import Solid, cuboid
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.lazy_search import search_lazily
from slap_ros.planning.problem import Problem
from slap_ros.planning.search import search_exhaustively
from slap_ros.relational import Column, State, Target
from slap_ros.worlds.features import BODY_FEATURES
from slap_ros.worlds.joint_space.features import GRASP_FEATURES, ROBOT
from slap_ros.worlds.joint_space.world import PandaWorld
from slap_ros.worlds.panda import JOINT_HIGH, JOINT_LOW, MAX_STEP, grasp_pose
from support.states import changed, fluent_atoms

FAIR, PAPER = get_domain("cleanup_table"), get_domain("cleanup_table", "paper")
PLACES = {"duck": (0.4, 0.1, 0.0), "toy_robot": (0.5, 0.2, 0.0), "dinosaur": (0.6, 0.1, 0.0)}
LAID = make_task({**PLACES, WIPER: (0.5, -0.12, 0.0)}, shipped()).initial_state
FEW = get_domain("cleanup_table", "fair:toys=1")
STILL = np.zeros(8)
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def solve(task, domain=FAIR):
    return experiment.solve(domain, task, PURE_PLANNING)


def atoms(state, domain=FAIR):
    return fluent_atoms(state, domain)


def test_a_table_is_perceived_as_it_is_laid():
    blocks = (*TOYS, WIPER)
    assert atoms(LAID) == {
        "GripperEmpty(robot)",
        "HandReadyPick(robot)",
        *(f"On({block}, table)" for block in blocks),
        *(f"NotHolding(robot, {block})" for block in blocks),
        *(f"NotReadyPick(robot, {block})" for block in blocks),
        *(f"NotAboveEverything({block})" for block in blocks),
    }


def test_static_atoms_tell_things_apart():
    space = FAIR.atom_space(LAID)
    static = {str(atom) for atom in space.decode(space.static_truth)}
    assert {"IsDrawer(bin)", "IsTable(table)", "IsMovable(wiper)", "NotIsMovable(bin)"} <= static
    assert not {"IsDrawer(table)", "IsTable(bin)", "IsMovable(table)"} & static


# -- predicates, spelled out one by one -----------------------------------------------------------


def random_states(initial, rng, count):
    """A batch in which blocks lie, tumble and fall about table and bin, and the hand is about."""
    layout = initial.layout
    data = np.repeat(initial.data[None], count, axis=0)
    (robot,) = layout.of_type(ROBOT)
    home = initial[robot][:7]
    for row in data:
        for block in layout.of_type(BLOCK):
            part = layout.slices[block].start
            row[part : part + 2] = rng.uniform(0.15, 0.85), rng.uniform(-0.35, 0.65)
            row[part + 2] = rng.choice([rng.uniform(-0.35, -0.2), rng.uniform(-0.02, 0.2)])
            turn = rng.normal(size=4) if rng.random() < 0.5 else np.array([0.0, 0.0, 0.3, 1.0])
            row[part + 3 : part + 7] = turn / np.linalg.norm(turn)
            row[part + 7 : part + 10] = rng.normal(size=3) * rng.choice([0.0, 0.1, 1.0])
        if rng.random() < 0.3:
            held = layout.of_type(BLOCK)[rng.integers(len(layout.of_type(BLOCK)))]
            row[layout.column(held, "held")] = 1.0
        q = np.clip(home + rng.normal(0, 0.3, 7), JOINT_LOW, JOINT_HIGH)
        row[layout.slices[robot]][:7] = q
        if rng.random() < 0.6:  # the hand over a block
            block = layout.of_type(BLOCK)[rng.integers(len(layout.of_type(BLOCK)))]
            part = layout.slices[block].start
            x, y, z = grasp_pose(q.tolist()).position
            row[part : part + 3] = np.array([x, y, z - OVER]) + rng.uniform(-0.03, 0.03, 3)
    return State(layout, data)


def one_by_one(state):
    """The fluent relations of places that hold in a single state."""
    blocks = state.layout.of_type(BLOCK)
    held = [b for b in blocks if state.get(b, "held") > 0.5]
    (robot,) = state.layout.of_type(ROBOT)
    hand = grasp_pose(state[robot][:7].tolist()).position
    tops = {b: extent(state, b)[1] for b in blocks if b not in held}
    table_top = TABLE.pose.position[2] + TABLE.half[2]
    found = set()
    for b in blocks:
        place, (bottom, _) = state[b][:3], extent(state, b)
        for surface, box in (("table", TABLE), ("bin", BIN)):
            wall = WALL if surface == "bin" else 0.0
            off = np.abs(place - box.pose.position)
            over = (off[:2] <= np.array(box.half[:2]) - wall).all()
            slow = np.linalg.norm(state[b][7:10]) <= SLOW
            if surface == "bin":
                on = over and off[2] <= box.half[2] and slow and b not in held
            else:
                on = over and abs(bottom - table_top) <= LOW
            if on:
                found.add(f"On({b}, {surface})")
        highest = max([table_top, *(top for other, top in tops.items() if other != b)])
        above = bottom - highest >= CLEAR
        found.add(f"{'' if above else 'Not'}AboveEverything({b})")
        aside = math.dist(hand[:2], place[:2])
        ready = aside <= ASIDE and abs(hand[2] - place[2] - OVER) <= BAND and not held
        found.add(f"{'' if ready else 'Not'}ReadyPick(robot, {b})")
    if not held and hand[2] - TIP >= max([table_top, *tops.values()]) + HAND_CLEAR:
        found.add("HandReadyPick(robot)")
    return found


def extent(state, block):
    """Heights of the lowest and highest points of the box around a block."""
    *_, hx, hy, hz, mx, my, mz, _, _ = state[block].tolist()
    pose = Pose(tuple(state[block][:3]), tuple(state[block][3:7]))
    up = [rotate(pose.quaternion, axis)[2] for axis in AXES]
    middle = pose.apply((mx, my, mz))[2]
    reach = sum(abs(u) * h for u, h in zip(up, (hx, hy, hz), strict=True))
    return middle - reach, middle + reach


PLACES = ("On", "AboveEverything", "NotAboveEverything", "ReadyPick", "NotReadyPick")


def test_states_are_perceived_as_spelled_out_one_by_one():
    rng, seen = np.random.default_rng(0), []
    for seed in range(4):
        initial = FAIR.task(seed).initial_state
        space = FAIR.atom_space(initial)
        names = (*PLACES, "HandReadyPick")
        mask = space.mask(atom for atom in space.atoms if atom.predicate.name in names)
        batch = random_states(initial, rng, 100)
        for row, abstract in zip(batch.data, space.abstract_each(batch), strict=True):
            state = State(initial.layout, row)
            found = {str(atom) for atom in space.decode(space.abstract(state) & mask)}
            assert found == one_by_one(state)
            assert space.abstract(state) == abstract  # a batch is perceived like its states
            seen += found
    for common in ("On(duck, table)", "On(duck, bin)", "ReadyPick(robot, duck)"):
        assert seen.count(common) > 5
    assert seen.count("AboveEverything(duck)") > 5
    assert seen.count("HandReadyPick(robot)") > 5


def test_a_margin_is_positive_exactly_where_its_atom_holds():
    initial = FAIR.task(0).initial_state
    batch = random_states(initial, np.random.default_rng(1), 300)
    space = FAIR.atom_space(initial)
    truth = space.truth(batch)
    for i, atom in enumerate(space.atoms):
        if atom.predicate.margin is not None:
            columns = [Column((obj,)) for obj in atom.objects]
            positive = atom.predicate.margin(batch, *columns)[..., 0] >= 0.0
            assert (positive == truth[:, i]).all()


def margin(state, name, *objects):
    predicate = next(p for p in FAIR.predicates if p.name == name)
    columns = [Column((state.layout.object(obj),)) for obj in objects]
    return predicate.margin(state, *columns)[..., 0]


def test_what_is_swept_towards_the_bin_comes_ever_nearer_to_being_in_it():
    state = LAID
    ways = np.linspace(0.1, 0.3, 100)
    data = np.repeat(state.data[None], len(ways), axis=0)
    data[:, state.layout.column(state.layout.object("duck"), "y")] = ways
    found = margin(State(state.layout, data), "On", "duck", "bin")
    assert (np.diff(found) > 0).all()
    assert found[-1] - found[0] == pytest.approx(0.2)  # metre for metre


# -- the bin --------------------------------------------------------------------------------------


def fallen(state, steps=30):
    with PandaWorld(scene_of(state, shipped()), state) as world:
        for _ in range(steps):
            world.step(STILL)
        return world.state


def test_what_falls_into_the_bin_stays_in_it_and_nothing_passes_its_floor():
    rng = np.random.default_rng(0)
    for seed in range(10):
        state = FAIR.task(seed).initial_state
        for number, block in enumerate(state.layout.of_type(BLOCK)):
            turn = rng.normal(size=4)
            turn /= np.linalg.norm(turn)
            if block.name == WIPER:
                turn = np.array([0.0, 0.0, 0.0, 1.0])
            x, y = rng.uniform(0.4, 0.6), rng.uniform(0.38, 0.52)
            z = (0.05, 0.12, 0.19, -0.1)[number]  # 0.4 m and more over the floor: 3 m/s
            pose = dict(zip(("x", "y", "z", "qx", "qy", "qz", "qw"), (x, y, z, *turn), strict=True))
            state = changed(state, block.name, **pose)
        after = fallen(state)
        for block in TOYS:
            assert f"On({block}, bin)" in atoms(after)
            _, top = extent(after, after.layout.object(block))
            assert top > FLOOR_TOP + 0.02


def test_a_block_in_the_bin_is_on_nothing_until_it_has_landed_or_while_it_is_held():
    state = changed(LAID, "duck", x=0.5, y=0.45, z=-0.28)
    assert "On(duck, bin)" in atoms(state)
    assert not {"On(duck, bin)", "On(duck, table)"} & atoms(changed(state, "duck", vz=-2.0))
    assert "On(duck, bin)" not in atoms(changed(state, "duck", held=1.0))
    assert "On(duck, bin)" not in atoms(changed(state, "duck", y=0.61))  # on the floor beside it


# -- skills and plans -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    "domain", [pytest.param(FAIR, marks=pytest.mark.slow), PAPER], ids=["fair", "paper"]
)
def test_tables_are_cleared(domain):
    task = domain.task(0)
    episode = solve(task, domain)
    assert episode.success
    assert episode.replans == 0
    final = episode.states[-1]
    assert {f"On({block}, bin)" for block in (*TOYS, WIPER)} <= atoms(final)
    if domain is FAIR:
        limit = np.array([*MAX_STEP, 1.0]) + 1e-9
        assert (np.abs(episode.actions) <= limit).all()
    settled = fallen(final, 20)
    assert atoms(settled) == atoms(final)  # it was no fluke of the moment


def test_operators_say_exactly_what_skills_bring_about():
    task = FEW.task(0)
    problem = Problem.of(FEW, task.initial_state)
    episode = solve(task, FEW)
    space = problem.model.space
    names = []
    state = task.initial_state
    for edge in GraphPlanner(problem).plan(state, space.mask(task.goal)).plan.edges:
        skill, objects = edge.option.skill, edge.option.objects
        bound = skill.lower_bound(state, objects)
        rollout = problem.model.roll_out(edge.option, state, edge.target)
        assert rollout.reached
        # What is bounded is planned; only what falls takes as long as it takes.
        assert (rollout.steps > bound) if skill.name == "Drop" else (rollout.steps == bound)
        assert Target.exactly(space.abstract(rollout.final)) == edge.target
        state = rollout.final
        names.append(edge.option.skill.name)
    assert names == ["Reach", "Grasp", "Lift", "Drop"] * 2
    assert episode.states[-1] == state


def test_lazy_search_finds_what_exhaustive_search_finds():
    for seed in range(2):
        task = FEW.task(seed)
        problem = Problem.of(FEW, task.initial_state)
        goal = problem.model.space.mask(task.goal)
        costs = [
            GraphPlanner(problem, search=search).plan(task.initial_state, goal).plan.predicted_steps
            for search in (search_lazily, search_exhaustively)
        ]
        assert costs[0] == costs[1]


def test_the_same_task_is_planned_and_executed_alike():
    first, second = (solve(FEW.task(3), FEW) for _ in range(2))
    assert first.states == second.states


# -- tasks ----------------------------------------------------------------------------------------


def test_tasks_are_different_and_seeds_fix_them():
    states = {FAIR.task(seed).initial_state.key for seed in range(20)}
    assert len(states) == 20
    assert FAIR.task(3, 1).initial_state == FAIR.task(3, 1).initial_state


def test_the_paper_draws_toys_and_leaves_the_wiper_where_it_is():
    states = [PAPER.task(seed).initial_state for seed in range(20)]
    assert len({state.key for state in states}) == 20
    wiper = states[0].layout.object(WIPER)
    assert {tuple(state[wiper][:2]) for state in states} == {(0.5, -0.12)}
    assert PAPER.task(3).initial_state == PAPER.task(3).initial_state


def test_settings_of_a_preset_can_be_changed():
    domain = get_domain("cleanup_table", "fair:toys=6,mass=0.05")
    blocks = domain.task(0).initial_state.layout.of_type(BLOCK)
    assert [b.name for b in blocks] == [*TOYS, *(f"{toy}2" for toy in TOYS), WIPER]
    state = domain.task(0).initial_state
    assert {float(state.get(b, "mass")) for b in blocks} == {0.05}
    crowded = get_domain("cleanup_table", "fair:toys=20")
    with pytest.raises(InvalidParameterError, match="room for 20 toys"):
        crowded.task(0)


def test_toys_of_any_shape_will_do():
    shapes = {"brick": Solid.of([cuboid((0.03, 0.02, 0.025))]), WIPER: shipped()[WIPER]}
    domain = make("fair", {"toys": "1"}, shapes=shapes)
    episode = solve(domain.task(0), domain)
    assert episode.success


def test_what_the_fingers_do_not_fit_around_is_left_and_said_so():
    shapes = {"slab": Solid.of([cuboid((0.06, 0.06, 0.025))]), WIPER: shipped()[WIPER]}
    domain = make("fair", {"toys": "1"}, shapes=shapes)
    episode = solve(domain.task(0), domain)
    assert episode.error.code == ErrorCode.UNSOLVABLE


def test_blocks_side_by_side_are_taken_one_after_the_other():
    places = {"duck": (0.45, 0.15, 0.0), "toy_robot": (0.55, 0.15, 0.0), WIPER: (0.5, -0.12, 0.0)}
    task = make_task(places, shipped())
    assert solve(task).success


# -- skills on a robot, which is not quite where it should be -------------------------------------


def named(state, *names):
    return tuple(map(state.layout.object, names))


def carry_out(world, skill, *names):
    """To the end of its motion, whatever holds on the way."""
    policy = FAIR.skills[skill].start(world.state, named(world.state, *names))
    return carry_on(world, policy)


def carry_on(world, policy):
    """To the end of a policy; how many steps that takes."""
    steps = 0
    while (action := policy(world.state)) is not None:
        world.step(action)
        steps += 1
    return steps


@contextmanager
def in_hand(block):
    with PandaWorld(scene_of(LAID, shipped()), LAID) as world:
        for skill in ("Reach", "Grasp"):
            carry_out(world, skill, "robot", block, "table")
        assert f"Holding(robot, {block})" in atoms(world.state)
        yield world


def test_what_slips_while_it_is_lifted_is_lifted_above_everything_all_the_same():
    lift = FAIR.skills["Lift"]
    with in_hand("duck") as world:
        robot, duck, _ = about = named(world.state, "robot", "duck", "table")
        policy = lift.start(world.state, about)
        for _ in range(lift.lower_bound(world.state, about)):
            world.step(policy(world.state))
        above = margin(world.state, "AboveEverything", "duck")
        assert 0.0 <= above < 0.01  # where nothing slips, its work is done
        slipped = above + 0.003  # m, down, which is along the hand's z
        low = float(world.state.get(robot, "grasp_z")) + slipped
        sunk = float(world.state.get(duck, "z")) - slipped
        world.reset(world.state.replace({(robot, "grasp_z"): low, (duck, "z"): sunk}))
        assert "AboveEverything(duck)" not in atoms(world.state)
        carry_on(world, policy)
        assert "AboveEverything(duck)" in atoms(world.state)


def test_a_hand_turns_where_a_joint_is_at_its_limit_before_a_toy_is_above_everything():
    joints = (-0.0349, 0.6708, 0.4636, -2.0744, 2.5548, 3.6674, 0.9595)  # rad; the sixth up to 3.75
    places = {"toy_robot": (0.3968, 0.1226, 2.2576), WIPER: (0.5, -0.12, 0.0)}
    state = make_task(places, shipped()).initial_state
    (robot,) = named(state, "robot")
    state = state.replace({(robot, f"joint{i}"): q for i, q in enumerate(joints, start=1)})
    with PandaWorld(scene_of(state, shipped()), state) as world:
        world.step(np.array([*STILL[:7], 1.0]))
        assert "Holding(robot, toy_robot)" in atoms(world.state)
        carry_out(world, "Lift", "robot", "toy_robot", "table")
        assert "AboveEverything(toy_robot)" in atoms(world.state)


def test_what_is_lifted_may_touch_what_it_has_pushed():
    with in_hand(WIPER) as world:
        world.reset(changed(world.state, "dinosaur", x=0.55, y=-0.095))
        carry_out(world, "Lift", "robot", WIPER, "table")
        assert {"AboveEverything(wiper)", "On(dinosaur, table)"} <= atoms(world.state)


def test_nothing_is_waited_for_where_a_tool_fell_out_of_the_hand():
    with in_hand(WIPER) as world:
        carry_out(world, "Lift", "robot", WIPER, "table")
        robot, wiper, _ = about = named(world.state, "robot", WIPER, "bin")
        policy = FAIR.skills["Drop"].start(world.state, about)
        world.step(policy(world.state))
        lost = {(wiper, f.name): float(LAID.get(wiper, f.name)) for f in BODY_FEATURES}
        lost |= {(robot, f.name): float(LAID.get(robot, f.name)) for f in GRASP_FEATURES}
        world.reset(world.state.replace(lost | {(robot, "finger"): 0.04}))
        assert carry_on(world, policy) < 30
        assert "On(wiper, table)" in atoms(world.state)


def test_a_duck_on_its_side_is_cleared_away():
    """It is as wide as open fingers, and its middle is beside its centre of mass."""
    task = make_task({"duck": (0.45, 0.15, 0.4), WIPER: (0.5, -0.12, 0.0)}, shipped())
    half = math.sqrt(0.5)
    turned = changed(task.initial_state, "duck", z=0.03, qx=half, qy=0.0, qz=0.0, qw=half)
    state = fallen(turned)
    assert extent(state, state.layout.object("duck"))[1] < 0.056  # lower than on its feet
    assert solve(replace(task, initial_state=state)).success
