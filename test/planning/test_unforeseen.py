# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans from where operators do not lead to the goal, and skills do."""

from dataclasses import replace

import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import UnsolvableError
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.evaluation.experiment import solve
from slap_ros.geometry.pose import rotate
from slap_ros.planning.planner import make_planner
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.worlds.features import pose_of
from support.states import fluent_atoms

DOMAIN = get_domain("obstacle_tower", "fair:obstacles=0,distractors=0")
TASK = DOMAIN.task(0)
WITH_TOWER = get_domain("obstacle_tower", "fair:obstacles=3,distractors=0")
TOWER = WITH_TOWER.task(0)
WITH_TOYS = get_domain("cleanup_table", "fair:toys=1")
TABLE = WITH_TOYS.task(0)
HALF_OPEN = 0.05  # m, of a drawer: neither open nor closed


def half_on_target(beside):
    """The task with its block half on the target, as one that was dropped there."""
    state = TASK.initial_state
    block, target = (state.layout.object(name) for name in ("block1", "target"))
    x, y = (float(state.get(target, axis)) for axis in ("x", "y"))
    return state.replace({(block, "x"): x + beside, (block, "y"): y})


@pytest.mark.parametrize("planner", ["lazy", "anytime"])
def test_a_block_half_on_the_target_is_picked_up_and_put_down_again(planner):
    state = half_on_target(0.02)
    space = DOMAIN.atom_space(state)
    on_table = space.bit(space.atom("On", ("block1", "table")))
    room = space.bit(space.atom("NothingOn", ("target",)))
    assert space.abstract(state) & (on_table | room) == on_table
    episode = solve(DOMAIN, replace(TASK, initial_state=state), PURE_PLANNING, planner)
    assert episode.success
    assert episode.replans == 0
    assert [edge.option for edge in episode.edges] == ["Pick", "PlaceInTarget"]


def pushed_towers():
    """A tower of three that was pushed off its target, but not far, with the way that it went."""
    state = TOWER.initial_state
    named = state.layout.object
    x, y = (float(state.get(named("target"), axis)) for axis in ("x", "y"))
    for dx, dy in ((0.05, 0.03), (0.055, 0.0), (0.0, 0.055)):
        moved = {(named(f"block{i}"), "x"): x + dx for i in (2, 3, 4)}
        moved |= {(named(f"block{i}"), "y"): y + dy for i in (2, 3, 4)}
        yield state.replace(moved)


@pytest.mark.parametrize("planner", ["lazy", "anytime"])
def test_a_tower_that_leaves_no_room_at_the_target_is_taken_down(planner):
    """It stands half on the target, where no operator makes room; or so near that no hand fits."""
    rooms = set()
    for state in pushed_towers():
        space = WITH_TOWER.atom_space(state)
        room = space.bit(space.atom("NothingOn", ("target",)))
        rooms.add(bool(space.abstract(state) & room))
        task = replace(TOWER, initial_state=state)
        episode = solve(WITH_TOWER, task, PURE_PLANNING, planner)
        assert episode.success, episode.error
        assert episode.replans == 0
        assert episode.edges[0].option == "Unstack"
    assert rooms == {False, True}


@pytest.mark.parametrize("planner", ["lazy", "anytime"])
def test_what_was_lifted_half_of_the_way_is_lifted_on(planner):
    """Off the table and not above everything: no operator begins there, as none ends there."""
    state = TABLE.initial_state
    about = tuple(map(state.layout.object, ("robot", "wiper", "table")))
    with WITH_TOYS.make_world(state) as world:
        for skill, steps in (("Reach", -1), ("Grasp", -1), ("Lift", 3)):
            policy = WITH_TOYS.skills[skill].start(world.state, about)
            while steps and (action := policy(world.state)) is not None:
                world.step(action)
                steps -= 1
        lifted = world.state
    atoms = fluent_atoms(lifted, WITH_TOYS)
    assert "Holding(robot, wiper)" in atoms
    assert not {"On(wiper, table)", "AboveEverything(wiper)"} & atoms
    goal = WITH_TOYS.atom_space(lifted).mask(TABLE.goal)
    plan = make_planner(planner, WITH_TOYS, lifted).plan(lifted, goal).plan
    lift, drop, *_ = map(str, (edge.option for edge in plan.edges))
    assert (lift, drop) == ("Lift(robot, wiper, table)", "Drop(robot, wiper, bin)")


def half_open():
    """A drawer that was left half open, with what stands in it: no operator begins there."""
    state = get_domain("make_coffee").task(300).initial_state
    cabinet, pod = (state.layout.object(name) for name in ("cabinet", "pod"))
    way = rotate(pose_of(state, cabinet).quaternion, (0.0, HALF_OPEN, 0.0))
    there = {(pod, axis): state.get(pod, axis) + w for axis, w in zip("xyz", way, strict=True)}
    return state.replace({(cabinet, "opening"): HALF_OPEN} | there)


@pytest.mark.parametrize("measured", [True, False])
def test_acquired_skills_go_on_from_where_a_robot_stopped(measured):
    """And in the planner's own world, they end where they did in training, or fail."""
    pytest.importorskip("pybullet")
    domain, state = open_domain(DomainChoice("make_coffee", measured=measured)), half_open()
    space = domain.atom_space(state)
    goal = space.bit(space.atom("IsCabinetClose", ("cabinet",)))
    planner = make_planner("lazy", domain, state)
    if measured:
        edges = planner.plan(state, goal).plan.edges
        assert [edge.option.skill.name for edge in edges] == ["Open", "Close"]
    else:
        with pytest.raises(UnsolvableError, match="IsCabinetClose"):
            planner.plan(state, goal)


def test_what_no_skill_can_do_stays_unsolvable():
    """The block is on the floor, out of reach."""
    state = half_on_target(0.0)
    block = state.layout.object("block1")
    state = state.replace({(block, "x"): -0.9, (block, "z"): -0.4})
    space = DOMAIN.atom_space(state)
    with pytest.raises(UnsolvableError, match="On\\(block1, target\\)"):
        make_planner("lazy", DOMAIN, state).plan(state, space.mask(TASK.goal))
