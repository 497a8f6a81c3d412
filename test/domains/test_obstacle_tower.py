# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: predicates, tasks, and towers really taken apart in PyBullet."""

import math
from dataclasses import replace

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.obstacle_tower.features import BLOCK, TowerObjectIndex
from slap_ros.domains.obstacle_tower.skills import stand_apart
from slap_ros.domains.obstacle_tower.support import MARGINS, SUPPORT, margins, support
from slap_ros.domains.obstacle_tower.tasks import (
    PaperTowerTasks,
    RandomTowerTasks,
    TowerArrangement,
)
from slap_ros.domains.tabletop.state_access import joints_of
from slap_ros.errors import ErrorCode, InvalidStateError, UnsolvableError
from slap_ros.evaluation import experiment
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.geometry.pose import Pose, from_rotation_vector, rotate
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.lazy_search import search_lazily
from slap_ros.planning.model import Model
from slap_ros.planning.planner import make_planner
from slap_ros.planning.problem import Problem
from slap_ros.planning.search import search_exhaustively
from slap_ros.relational import State
from slap_ros.worlds.bodies import Material
from slap_ros.worlds.features import POSE_FEATURES, pose_of
from slap_ros.worlds.joint_space.features import GRASP_FEATURES
from slap_ros.worlds.joint_space.scene import CUBE_EDGE
from slap_ros.worlds.panda import MAX_STEP, hand_pose
from support.marks import slow
from support.random_states import random_states
from support.states import fluent_atoms

FAIR, PAPER = get_domain("obstacle_tower"), get_domain("obstacle_tower", "paper")


def solve(task, domain=FAIR):
    return experiment.solve(domain, task, PURE_PLANNING)


def atoms(state, domain=FAIR):
    return fluent_atoms(state, domain)


def test_a_tower_is_perceived_as_it_stands():
    assert atoms(PAPER.task(0).initial_state) == {
        "On(block1, table)",
        "On(block2, target)",
        "On(block3, block2)",
        "On(block4, block3)",
        "NothingOn(block1)",
        "NothingOn(block4)",
        "NothingOn(table)",
        "GripperEmpty(robot)",
        *(f"NotHolding(robot, block{i})" for i in range(1, 5)),
    }


def test_a_block_half_on_the_target_is_on_the_table_and_leaves_no_room():
    arrangement = TowerArrangement(
        target=(0.5, 0.0, 0.4), target_block=(0.4, 0.2, 0), tower=((0.54, 0.0, 0.9),)
    )
    seen = atoms(arrangement.task().initial_state)
    assert "On(block2, table)" in seen
    assert "On(block2, target)" not in seen
    assert "NothingOn(target)" not in seen


def test_blocks_in_the_air_or_on_edge_lie_on_nothing():
    state = TowerArrangement((0.5, 0.0, 0.0), (0.4, 0.2, 0.0), ()).task().initial_state
    block = state.layout.object("block1")
    lifted = state.replace({(block, "z"): float(state.get(block, "z")) + 0.006})
    assert "On(block1, table)" not in atoms(lifted)
    tilt = math.radians(20)
    tilted = state.replace({(block, "qx"): math.sin(tilt / 2), (block, "qw"): math.cos(tilt / 2)})
    assert "On(block1, table)" not in atoms(tilted)


def test_a_batch_is_perceived_like_its_states_whether_they_stand_or_tumble():
    rng, seen = np.random.default_rng(0), 0
    for seed in range(5):
        initial = FAIR.task(seed).initial_state
        space = FAIR.atom_space(initial)
        batch = random_states(initial, rng, 200)
        truth = space.truth(batch)
        square = State(initial.layout, batch.data.reshape(10, 20, -1))
        assert (space.truth(square).reshape(200, -1) == truth).all()
        for row, one in zip(batch.data, truth, strict=True):
            state = State(initial.layout, row)
            assert (space.truth(state) == one).all()
            assert space.mask(a for a, t in zip(space.atoms, one, strict=True) if t) == (
                space.abstract(state)
            )
        seen += int(truth.sum(axis=0).astype(bool).sum())
    assert seen > 150  # atoms that hold somewhere


def test_compiled_code_perceives_the_same():
    pytest.importorskip("numba")
    rng, rests = np.random.default_rng(1), 0
    for seed in range(3):
        initial = FAIR.task(seed).initial_state
        index = TowerObjectIndex.of(initial.layout)
        for row in random_states(initial, rng, 100).data:
            labels = (row.take(places) > 0.5 for places in (index.is_movable, index.is_target))
            given = row.take(index.boxes), index.blocks, *labels
            (on, room), (other_on, other_room) = support(*given), SUPPORT.compiled()(*given)
            assert (on == other_on).all() and (room == other_room).all()
            rests += int(on.sum())
        for many in (row, random_states(initial, rng, 40).data.reshape(2, 20, -1)):
            by_numpy, by_kernel = margins(index, many), MARGINS.compiled()(index, many)
            for found, other in zip(by_numpy, by_kernel, strict=True):
                assert found.shape == other.shape and (found == other).all()
    assert rests > 100


@pytest.mark.parametrize("axis", [0.0, 0.4, 2.0])
def test_a_block_on_its_head_lies_where_it_lies(axis):
    """Such quaternions have no yaw: both parts that turn about the vertical are 0."""
    state = PAPER.task(0).initial_state
    turned = {"qx": math.cos(axis), "qy": math.sin(axis), "qz": 0.0, "qw": 0.0}
    on_head = state.replace({(state.layout.object("block2"), n): v for n, v in turned.items()})
    assert atoms(on_head, PAPER) == atoms(state, PAPER)
    above = on_head.layout.object("block3")
    for aside in (0.045, 0.055):
        moved = on_head.replace(
            {
                (above, "x"): 0.5 + aside * math.cos(2 * axis),
                (above, "y"): aside * math.sin(2 * axis),
            }
        )
        yaw = {"qz": math.sin(axis), "qw": math.cos(axis)}  # faces along the way it is moved
        moved = moved.replace({(above, name): value for name, value in yaw.items()})
        assert ("On(block3, block2)" in atoms(moved, PAPER)) == (aside < 0.05)


def test_tasks_differ_and_stand_by_themselves():
    tasks = [FAIR.task(seed) for seed in range(30)]
    assert len({task.initial_state.key for task in tasks}) == 30
    assert len({len(task.initial_state.layout.of_type(BLOCK)) for task in tasks}) == 3
    for task in tasks[:10]:
        world = FAIR.make_world(task.initial_state)
        for _ in range(5):
            after = world.step(np.zeros(8))
        assert after == task.initial_state


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_random_towers_are_taken_apart_within_the_speed_limit(seed):
    task = FAIR.task(seed)
    episode = solve(task)
    assert episode.success, episode.error
    assert episode.replans == 0
    assert all(atom.holds(episode.states[-1]) for atom in task.goal)
    steps = np.abs(np.diff([state.data[:7] for state in episode.states], axis=0))
    assert (steps <= np.array(MAX_STEP) + 1e-9).all()


@pytest.mark.slow
def test_the_paper_tower_is_solved_the_same_way_twice():
    first, second = solve(PAPER.task(0), PAPER), solve(PAPER.task(1), PAPER)
    assert first.success
    assert [s.key for s in first.states] == [s.key for s in second.states]


def test_without_obstacles_it_is_pick_and_place():
    task = TowerArrangement((0.5, 0.0, 0.0), (0.4, 0.2, 0.3), ()).task()
    episode = solve(task)
    assert episode.success
    assert episode.plan_length < 40


@pytest.mark.parametrize("gap", [0.001, 0.004])
def test_a_block_that_stands_close_to_the_target_need_not_be_taken_away(gap):
    beside = 0.5 + CUBE_EDGE + gap
    task = TowerArrangement((0.5, 0.0, 0.0), (0.4, 0.2, 0.0), ((beside, 0.0, 0.0),)).task()
    episode = solve(task)
    assert episode.success
    assert episode.plan_length < 50  # it is picked and placed, no more
    before, after = task.initial_state, episode.states[-1]
    stood = pose_of(before, before.layout.object("block2")).position
    stands = pose_of(after, after.layout.object("block2")).position
    assert stands == pytest.approx(stood, abs=0.005)


def test_a_single_obstacle_and_six_can_be_sampled():
    for count in (1, 6):
        settings = RandomTowerTasks(obstacles=(count, count), distractors=(0, 0))
        task = settings.sample(np.random.default_rng(0))
        assert len(task.initial_state.layout.of_type(BLOCK)) == count + 1


def test_a_block_out_of_reach_makes_the_task_unsolvable():
    task = TowerArrangement((0.5, 0.0, 0.0), (0.74, 0.39, 0.0), ()).task()
    far = task.initial_state.layout.object("block1")
    state = task.initial_state.replace({(far, "x"): 0.9, (far, "z"): -0.4})  # fell off the table
    episode = solve(replace(task, initial_state=state))
    assert not episode.success
    assert episode.error.code is ErrorCode.UNSOLVABLE


def test_blocks_inside_one_another_are_refused():
    task = TowerArrangement((0.5, 0.0, 0.0), (0.4, 0.2, 0.0), ((0.41, 0.21, 0.0),)).task()
    with pytest.raises(InvalidStateError, match="block"):
        FAIR.make_world(task.initial_state)


def test_masses_and_frictions_are_sampled_last_and_alike_for_all_blocks():
    wide = RandomTowerTasks(mass=(0.1, 2.0), friction=(0.2, 1.2))
    seen = set()
    for seed in range(10):
        plain = FAIR.task(seed).initial_state
        state = wide.sample(np.random.default_rng([seed, 0])).initial_state
        blocks = state.layout.of_type(BLOCK)
        (mass,) = {float(state.get(block, "mass")) for block in blocks}
        (friction,) = {float(state.get(block, "friction")) for block in blocks}
        assert 0.1 < mass < 2.0
        assert 0.2 < friction < 1.2
        seen.add((mass, friction))
        usual = {(b, f): v for b in blocks for f, v in (("mass", 0.5), ("friction", 0.9))}
        assert state.replace(usual) == plain
    assert len(seen) == 10


@pytest.mark.parametrize("material", [Material(0.05, 0.3), Material(3.0, 1.2)])
def test_towers_of_other_materials_are_taken_apart_too(material):
    arrangement = replace(PaperTowerTasks().arrangement, material=material)
    episode = solve(arrangement.task())
    assert episode.success, episode.error
    blocks = episode.states[-1].layout.of_type(BLOCK)
    assert all(episode.states[-1].get(b, "mass") == material.mass_kg for b in blocks)


class WatchedModel(Model):
    """A model that compares each roll-out with its bound."""

    def _simulate(self, option, state, target):
        bound = option.skill.lower_bound(state, option.objects)
        rollout = super()._simulate(option, state, target)
        if rollout.reached:
            assert option.skill.least_steps <= bound <= rollout.steps
            self.slack.append(rollout.steps - bound)
        return rollout


@pytest.mark.parametrize("preset", ["fair", "paper"])
@pytest.mark.parametrize("seed", [0, *slow(1)])
def test_the_lazy_search_is_bounded_truly_and_finds_the_cost_of_the_exhaustive(preset, seed):
    domain = {"fair": FAIR, "paper": PAPER}[preset]
    settings = RandomTowerTasks(obstacles=(1 + seed, 1 + seed), distractors=(1 - seed, 1 - seed))
    task = settings.sample(np.random.default_rng(seed))
    costs, rolled_out, slack = [], [], []
    for search in (search_lazily, search_exhaustively):
        model = WatchedModel.of(domain, task.initial_state)
        model.slack = slack
        problem = replace(Problem.of(domain, task.initial_state), model=model)
        plan = GraphPlanner(problem, search).plan(task.initial_state, model.space.mask(task.goal))
        costs.append(plan.plan.predicted_steps)
        rolled_out.append(plan.edges_rolled_out)
    assert costs[0] == costs[1]
    assert rolled_out[0] < rolled_out[1]
    assert preset == "paper" or np.median(slack) <= 1  # mostly nothing is in the way


@pytest.mark.parametrize("place", [(1.2, 0.0), (0.5, 0.7), (0.8, 0.42)])
@pytest.mark.parametrize("planner", ["lazy", "ff"])
def test_a_target_off_the_table_makes_the_task_unsolvable(place, planner):
    """Far away, beside the table, and where the arm could reach it in mid-air."""
    task = TowerArrangement((*place, 0.0), (0.4, 0.2, 0.0), ()).task()
    space = FAIR.atom_space(task.initial_state)
    with pytest.raises(UnsolvableError, match=r"no path through|leads to the goal"):
        make_planner(planner, FAIR, task.initial_state).plan(
            task.initial_state, space.mask(task.goal)
        )


def run(world, skill, objects):
    policy = skill.start(world.state, objects)
    while (action := policy(world.state)) is not None:
        world.step(action)


def features(obj, group, pose):
    values = (*pose.position, *pose.quaternion)
    return {(obj, item.name): value for item, value in zip(group, values, strict=True)}


@pytest.mark.parametrize("turn", [(0.0, 0.3, 0.0), (0.05, -0.35, 0.1)])
def test_a_block_that_turned_in_the_hand_is_put_down_flat(turn):
    """Fingers of a robot hold by friction: what they push against others turns between them."""
    task = FAIR.task(1)
    with FAIR.make_world(task.initial_state) as world:
        robot, block, table = map(task.initial_state.layout.object, ("robot", "block1", "table"))
        run(world, FAIR.skills["Pick"], (robot, block, table))
        held = world.state
        hand = hand_pose(joints_of(held))
        grasp = hand.inverse().compose(pose_of(held, block))
        x, y, z = grasp.position
        slid = Pose((x, y, z - 0.008), grasp.quaternion)
        turned = slid.compose(Pose(quaternion=from_rotation_vector(turn)))
        changes = features(robot, GRASP_FEATURES, turned)
        changes |= features(block, POSE_FEATURES, hand.compose(turned))
        world.reset(held.replace(changes))
        run(world, FAIR.skills["Place"], (robot, block, table))
        assert {"On(block1, table)", "GripperEmpty(robot)"} <= atoms(world.state)
        up = rotate(pose_of(world.state, block).quaternion, (0.0, 0.0, 1.0))
        assert sorted(map(abs, up))[2] == pytest.approx(1.0, abs=1e-3)


def test_blocks_that_stand_close_let_the_hand_travel_less():
    apart = TowerArrangement((0.5, 0.0, 0.0), (0.4, 0.2, 0.0), ((0.5, 0.0, 0.0),) * 3)
    close = replace(apart, distractors=((0.45, 0.25, 0.0),))  # 0.07 m from the target block
    initial = [one.task().initial_state for one in (apart, close)]
    assert [stand_apart(state) for state in initial] == [True, False]
    for name, skill in FAIR.skills.items():
        least = [skill.least_steps_in_plans(state, follows=True) for state in initial]
        assert least[0] == least[1] + 1
        assert least[1] == skill.least_steps_in_plans(initial[0], follows=False), name


def test_random_tasks_let_the_hand_travel():
    for preset in ("fair", "fair:obstacles=8", "fair:distractors=5", "fair:towers=3"):
        domain = get_domain("obstacle_tower", preset)
        assert all(stand_apart(domain.task(seed).initial_state) for seed in range(10))
