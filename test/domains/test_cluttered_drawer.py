# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cluttered Drawer: what blocks what, and blocks really taken out of it in PyBullet."""

import math
from dataclasses import replace

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.cluttered_drawer.blocking import SIDES, FingerClearance
from slap_ros.domains.cluttered_drawer.features import BLOCK
from slap_ros.domains.cluttered_drawer.scene import BOTTOM, FRONT, HALF_WIDTH, MIDDLE
from slap_ros.domains.cluttered_drawer.skills import FRONT_BACK, LEFT_RIGHT, _transit_to_grasp
from slap_ros.domains.cluttered_drawer.tasks import (
    NEIGHBOUR,
    DrawerArrangement,
    PaperDrawerTasks,
    RandomDrawerTasks,
)
from slap_ros.domains.tabletop.grasps import from_above
from slap_ros.domains.tabletop.state_access import joints_of
from slap_ros.errors import InvalidParameterError, InvalidStateError, SkillNotApplicableError
from slap_ros.evaluation import experiment
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.geometry.pose import multiply, rotate
from slap_ros.motion import linear_motion, nearest_configurations, retime
from slap_ros.planning.abstract_graph import build_abstract_graph
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.lazy_search import search_lazily
from slap_ros.planning.model import Model
from slap_ros.planning.options import given_option
from slap_ros.planning.problem import Problem
from slap_ros.planning.search import search_exhaustively
from slap_ros.relational import Column, State, Target
from slap_ros.worlds.features import pose_of
from slap_ros.worlds.joint_space.scene import TABLE_TOP
from slap_ros.worlds.panda import MAX_STEP, grasp_pose
from support.states import changed, fluent_atoms

FAIR, PAPER = get_domain("cluttered_drawer"), get_domain("cluttered_drawer", "paper")
HALF = 0.025  # m, half a block
TURN = -math.pi / 2  # rad
TARGET = (MIDDLE, 0.0, 0.0)
LEFT_BLOCKER = (MIDDLE, NEIGHBOUR, 0.0)


def solve(task, domain=FAIR):
    return experiment.solve(domain, task, PURE_PLANNING)


def atoms(state, domain=FAIR):
    return fluent_atoms(state, domain)


def sides(state, domain=FAIR):
    """What is said of the sides of the target block."""
    return {atom for atom in atoms(state, domain) if "Blocking" in atom or "Clear" in atom}


def random_states(initial, rng, count):
    """A batch: blocks around the target block, in the air, on their sides, tumbling; hands over."""
    layout = initial.layout
    data = np.repeat(initial.data[None], count, axis=0)
    over = from_above((MIDDLE, 0.0, BOTTOM + 0.08), 0.0)
    (joints,) = nearest_configurations([over], joints_of(initial))
    for row in data:
        for block in layout.of_type(BLOCK):
            part = layout.slices[block].start
            spread = 0.01 if block.name == "block1" else rng.choice([0.08, 0.3])
            row[part : part + 2] = rng.uniform(-spread, spread, 2)
            row[part] += MIDDLE
            row[part + 2] = BOTTOM + HALF + rng.choice([0.0, 0.003, 0.02, 0.06, 0.1])
            row[part + 3 : part + 7] = _turn(rng)
        robot = layout.slices[layout.object("robot")].start
        row[robot : robot + 7] = joints + rng.normal(0.0, 0.03, 7)
        if rng.random() < 0.3:
            held = layout.of_type(BLOCK)[rng.integers(len(layout.of_type(BLOCK)))]
            row[layout.column(held, "held")] = 1.0
    return State(layout, data)


def _turn(rng):
    if rng.random() < 0.2:
        turn = rng.normal(size=4)
        return turn / np.linalg.norm(turn)
    yaw, roll = rng.uniform(-math.pi, math.pi), rng.choice([0.0, 0.0, 0.5, 1.0, -0.5]) * math.pi
    return multiply(
        (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)),
        (math.sin(roll / 2), 0.0, 0.0, math.cos(roll / 2)),
    )


def test_a_hemmed_in_block_is_perceived_as_it_stands():
    assert atoms(PAPER.task(0).initial_state, PAPER) == {
        "BlockingFront(block2, block1)",
        "BlockingBack(block3, block1)",
        "BlockingLeft(block4, block1)",
        "BlockingRight(block5, block1)",
        "HandReadyPick(robot)",
        "GripperEmpty(robot)",
        *(f"On(block{i}, drawer)" for i in range(1, 6)),
        *(f"NotHolding(robot, block{i})" for i in range(1, 6)),
        *(f"NotReadyPick(robot, block{i})" for i in range(1, 6)),
    }


def test_the_abstract_graph_is_as_large_as_the_references():
    task = PAPER.task(0)
    problem = Problem.of(PAPER, task.initial_state)
    space = problem.model.space
    graph = build_abstract_graph(
        space.abstract(task.initial_state), space.mask(task.goal), problem.operators
    )
    assert (len(graph.nodes), len(graph.edges), len(graph.candidates())) == (116, 130, 6540)


def test_a_batch_is_perceived_like_its_states_and_margins_tell_the_truth():
    rng, seen = np.random.default_rng(0), 0
    for seed in range(3):
        initial = FAIR.task(seed).initial_state
        space = FAIR.atom_space(initial)
        batch = random_states(initial, rng, 200)
        truth = space.truth(batch)
        for row, one in zip(batch.data[:60], truth, strict=False):
            assert (space.truth(State(initial.layout, row)) == one).all()
        for i, atom in enumerate(space.atoms):
            if atom.predicate.margin is not None:
                columns = [Column((obj,)) for obj in atom.objects]
                positive = atom.predicate.margin(batch, *columns)[..., 0] >= 0.0
                assert (positive == truth[:, i]).all()
        changing = truth.any(axis=0) & ~truth.all(axis=0)
        seen += len({a.predicate.name for a, c in zip(space.atoms, changing, strict=True) if c})
    assert seen == 3 * (4 + 4 + 3 + 1 + 3)  # blocked and clear sides, hand, On, gripper


def corners(x, y, yaw, half_x=HALF, half_y=HALF):
    turn = complex(math.cos(yaw), math.sin(yaw))
    offsets = (complex(half_x * a, half_y * b) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1)))
    return [complex(x, y) + turn * offset for offset in offsets]


def overlap(one, other):
    """What two convex polygons share, by cutting one along the edges of the other."""
    for a, b in zip(other, [*other[1:], other[0]], strict=True):
        inside = [((b - a).conjugate() * (p - a)).imag for p in one]
        cut = []
        for i, p in enumerate(one):
            before, u, v = one[i - 1], inside[i - 1], inside[i]
            if u * v < 0:
                cut.append(before + (p - before) * u / (u - v))
            if v >= 0:
                cut.append(p)
        one = cut
    return one


def test_what_blocks_is_what_shares_the_room_of_a_finger():
    rng, room, found = np.random.default_rng(0), FingerClearance(), 0
    space = FAIR.atom_space(DrawerArrangement(TARGET, (LEFT_BLOCKER,)).task().initial_state)
    for _ in range(400):
        yaw = rng.uniform(-0.78, 0.78)
        other = (MIDDLE + rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), rng.uniform(-3, 3))
        state = DrawerArrangement((MIDDLE, 0.0, yaw), (other,)).task().initial_state
        seen = {str(atom) for atom in space.decode(space.abstract(state))}
        for side, towards in zip(SIDES, (-1, 1, 1j, -1j), strict=True):
            turn = complex(math.cos(yaw), math.sin(yaw))
            middle = MIDDLE + turn * towards * (HALF + room.reach / 2)
            facing = yaw + math.atan2(complex(towards).imag, complex(towards).real)
            free = corners(middle.real, middle.imag, facing, room.reach / 2, room.half_width)
            blocks = bool(overlap(free, corners(*other)))
            assert (f"Blocking{side}(block2, block1)" in seen) == blocks
            assert (f"{side}Clear(block1)" in seen) != blocks
            found += blocks
    assert 200 < found < 1400


def test_margins_say_how_far_a_blocker_is_to_be_moved():
    state = DrawerArrangement(TARGET, (LEFT_BLOCKER,)).task().initial_state
    predicate = next(p for p in FAIR.predicates if p.name == "LeftClear")
    column = Column((state.layout.object("block1"),))

    def margin(y):
        return predicate.margin(changed(state, "block2", y=y), column)[0]

    for y in (0.0675, 0.08, 0.09):
        assert margin(y) == pytest.approx(y - (HALF + FingerClearance().reach + HALF))
    assert margin(0.0675) < 0 < margin(0.1)


@pytest.mark.parametrize("factor", [0.5, 1.5, 2.0])
def test_thresholds_are_a_presets(factor):
    reach = FingerClearance().reach * factor
    noisy = get_domain("cluttered_drawer", f"fair:reach={reach}")
    edge = 2 * HALF + reach
    for y, blocked in ((edge - 0.001, True), (edge + 0.001, False)):
        state = DrawerArrangement(TARGET, ((MIDDLE, y, 0.0),)).task().initial_state
        assert ("BlockingLeft(block2, block1)" in sides(state, noisy)) == blocked
    assert noisy.task(3).initial_state == FAIR.task(3).initial_state  # tasks are the same


def test_only_a_block_that_stands_in_the_drawer_is_blocked():
    state = DrawerArrangement(TARGET, (LEFT_BLOCKER,)).task().initial_state
    free = {f"{side}Clear(block1)" for side in SIDES}
    assert "BlockingLeft(block2, block1)" in sides(state)
    assert sides(changed(state, "block1", z=BOTTOM + HALF + 0.02)) == free
    on_table = changed(state, "block1", x=FRONT + 0.1, z=TABLE_TOP + HALF)
    assert sides(on_table) == free
    assert "On(block1, table)" in atoms(on_table)
    assert "BlockingLeft(block2, block1)" in sides(changed(state, "block2", z=BOTTOM + HALF + 0.02))
    assert sides(changed(state, "block2", z=BOTTOM + HALF + 0.06)) == free


@pytest.mark.parametrize("turns", [FRONT_BACK, LEFT_RIGHT])
def test_a_hand_fits_where_sides_are_clear_and_not_where_blockers_stand(turns):
    wanted = ("Front", "Back") if turns is FRONT_BACK else ("Left", "Right")
    fits = {True: 0, False: 0}
    for seed in range(12):
        settings = RandomDrawerTasks(obstacles=(seed % 4, seed % 4))
        state = settings.sample(np.random.default_rng(seed)).initial_state
        target = state.layout.object("block1")
        clear = {f"{side}Clear(block1)" for side in wanted} <= atoms(state)
        try:
            _transit_to_grasp(state, target, turns).paths()
            fitted = True
        except SkillNotApplicableError:
            fitted = False
        assert fitted == clear
        fits[clear] += 1
    assert min(fits.values()) > 2


def test_tasks_differ_and_stand_by_themselves():
    tasks = [FAIR.task(seed) for seed in range(20)]
    assert len({task.initial_state.key for task in tasks}) == 20
    assert {len(task.initial_state.layout.of_type(BLOCK)) for task in tasks} == {5, 6, 7}
    for task in tasks[:5]:
        world = FAIR.make_world(task.initial_state)
        for _ in range(5):
            after = world.step(np.zeros(8))
        assert after == task.initial_state
        assert {f"Blocking{side}" for side in SIDES} == {
            atom.partition("(")[0] for atom in sides(task.initial_state)
        }


@pytest.mark.parametrize("preset", ["fair:obstacles=8", "fair:obstacles=2"])
def test_the_block_is_taken_out_within_the_speed_limit(preset):
    domain = get_domain("cluttered_drawer", preset)
    task = domain.task(1)
    episode = solve(task, domain)
    assert episode.success, episode.error
    assert episode.replans == 0
    assert all(atom.holds(episode.states[-1]) for atom in task.goal)
    steps = np.abs(np.diff([state.data[:7] for state in episode.states], axis=0))
    assert (steps <= np.array(MAX_STEP) + 1e-9).all()


@pytest.mark.slow
def test_the_papers_drawer_is_solved_the_same_way_twice():
    first, second = solve(PAPER.task(0), PAPER), solve(PAPER.task(1), PAPER)
    assert first.success
    assert [s.key for s in first.states] == [s.key for s in second.states]


class WatchedModel(Model):
    """A model that compares each roll-out with its bound."""

    def _simulate(self, option, state, target):
        bound = option.skill.lower_bound(state, option.objects)
        rollout = super()._simulate(option, state, target)
        if rollout.reached:
            assert option.skill.least_steps <= bound <= rollout.steps
        return rollout


@pytest.mark.parametrize("preset", ["fair", "paper"])
def test_the_lazy_search_is_bounded_truly_and_finds_the_cost_of_the_exhaustive(preset):
    domain = {"fair": FAIR, "paper": PAPER}[preset]
    task = RandomDrawerTasks(obstacles=(3, 3)).sample(np.random.default_rng(0))
    costs = []
    for search in (search_lazily, search_exhaustively):
        model = WatchedModel.of(domain, task.initial_state)
        problem = replace(Problem.of(domain, task.initial_state), model=model)
        plan = GraphPlanner(problem, search).plan(task.initial_state, model.space.mask(task.goal))
        costs.append(plan.plan.predicted_steps)
    assert costs[0] == costs[1]


def test_a_hand_that_turns_around_the_block_frees_two_sides_and_holds_nothing():
    """The shortcut that is there to be found: its end is a node of the graph, exactly."""
    task = PAPER.task(0)
    problem = Problem.of(PAPER, task.initial_state)
    space = problem.model.space
    start = space.abstract(task.initial_state)
    graph = build_abstract_graph(start, space.mask(task.goal), problem.operators)
    robot, target = (task.initial_state.layout.object(name) for name in ("robot", "block1"))
    reach = next(g for g, _ in problem.operators if str(g) == "Reach(robot, block1)")
    option = given_option(PAPER, "Reach", (robot, target))
    reached = Target.exactly(reach.apply(start))
    state = problem.model.roll_out(option, task.initial_state, reached).final
    world = PAPER.make_world(state)
    x, y, z = pose_of(state, target).position
    ahead = rotate(grasp_pose(joints_of(state)).quaternion, (1.0, 0.0, 0.0))
    yaw = math.atan2(ahead[1], ahead[0])
    for height, turn in ((z + 0.05, 0.0), (z, 0.0), (z, TURN)):
        goal = from_above((x, y, height), yaw + turn)
        for position in retime(linear_motion(joints_of(state), goal)):
            action = np.clip(position - joints_of(state), -np.array(MAX_STEP), MAX_STEP)
            state = world.step(np.array([*action, 0.0]))
    for _ in range(5):
        state = world.step(np.zeros(8))
    assert PAPER.learning.interface.at_rest(state.alone())[0]
    assert not PAPER.learning.interface.failed(state.alone())[0]
    clear = {atom for atom in sides(state, PAPER) if "Clear" in atom}
    assert clear in (
        {"FrontClear(block1)", "BackClear(block1)"},
        {"LeftClear(block1)", "RightClear(block1)"},
    )
    assert space.abstract(state) in graph.nodes


def test_a_drawer_that_is_too_full_is_refused():
    with pytest.raises(InvalidParameterError, match="no room for 20 obstacles"):
        RandomDrawerTasks(obstacles=(20, 20)).sample(np.random.default_rng(0))


@pytest.mark.parametrize(
    ("place", "culprit"),
    [((MIDDLE + 0.01, 0.0, 0.0), "block"), ((MIDDLE, HALF_WIDTH, 0.0), "block2 is inside a fixed")],
)
def test_blocks_inside_one_another_or_in_a_wall_are_refused(place, culprit):
    task = replace(PaperDrawerTasks().scenery, blockers=(place,)).task()
    with pytest.raises(InvalidStateError, match=culprit):
        FAIR.make_world(task.initial_state)
