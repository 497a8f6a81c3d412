# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot in MuJoCo: its model is the task's state, and what it holds, it holds by friction."""

import math
import sys
from dataclasses import dataclass, replace

import numpy as np
import pytest

from slap_ros.core import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.domains.tabletop.grasps import from_above
from slap_ros.errors import InvalidParameterError, InvalidSceneError
from slap_ros.motion.inverse_kinematics import inverse_kinematics
from slap_ros.planning.execution import Executor
from slap_ros.planning.planner import make_planner
from slap_ros.robot.mujoco.installed import require_mujoco
from slap_ros.worlds.bodies import RigidBody
from slap_ros.worlds.joint_space.scene import Scene

mujoco = pytest.importorskip("mujoco")

from slap_ros.robot.mujoco.closed_loop import ClosedLoopWorld  # noqa: E402
from slap_ros.robot.mujoco.model import compiled, scene_around, scene_spec  # noqa: E402
from slap_ros.robot.mujoco.plant import MujocoPlant  # noqa: E402

SHIFT = 0.002  # m, by which bodies may settle
FORCE = 60.0  # N, which the bridge asks for
LIFT = 0.1  # m


@pytest.fixture(scope="module")
def tower():
    domain = get_domain("obstacle_tower")
    return domain, domain.task(3).initial_state


def position(state, name):
    return [float(state.get(state.layout.object(name), axis)) for axis in "xyz"]


def passed(plant, seconds):
    end = plant.time_s + seconds
    while plant.time_s < end:
        plant.step()


def moved(plant, target, seconds):
    """Pulled there evenly, as by a controller."""
    start, since = np.array(plant.joints), plant.time_s
    while plant.time_s < since + seconds:
        plant.command(start + (np.array(target) - start) * (plant.time_s - since) / seconds)
        plant.step()
    plant.command(target)
    passed(plant, 0.5)


def pressed(plant, name):
    """By how much each finger presses, N."""
    model, data = plant._model, plant._data
    force, total = np.zeros(6), dict.fromkeys(("panda_leftfinger", "panda_rightfinger"), 0.0)
    for i in range(data.ncon):
        touching = {model.body(model.geom_bodyid[geom]).name for geom in data.contact[i].geom}
        if name in touching and (finger := touching & set(total)):
            mujoco.mj_contactForce(model, data, i, force)
            total[finger.pop()] += force[0]
    return list(total.values())


@pytest.mark.parametrize("name", ["obstacle_tower", "cluttered_drawer", "cleanup_table"])
def test_every_panda_domain_of_slap_stands_as_its_task_says(name):
    domain = get_domain(name)
    state = domain.task(2).initial_state
    plant = MujocoPlant.of(domain, state)
    poses = plant.poses()
    assert len(poses) > 2
    assert all(math.dist(poses[o].position, position(state, o)) < SHIFT for o in poses)
    passed(plant, 2.0)
    later = plant.poses()
    assert all(math.dist(poses[o].position, later[o].position) < SHIFT for o in poses)


def test_masses_and_friction_are_those_of_the_state(tower):
    domain, state = tower
    block = state.layout.object("block1")
    heavy = state.replace({(block, "mass"): 0.7, (block, "friction"): 0.4})
    model = compiled(scene_spec(scene_around(domain, heavy), heavy))
    assert model.body("block1").mass[0] == pytest.approx(0.7)
    assert model.geom("block1").friction[0] == pytest.approx(0.4)
    assert model.body("block2").mass[0] == pytest.approx(state.get(block, "mass"))


def test_a_state_that_is_restored_has_the_same_future_to_the_bit(tower):
    domain, state = tower
    plant, other = MujocoPlant.of(domain, state), MujocoPlant.of(domain, state)
    rng, steps = np.random.default_rng(0), []
    for _ in range(12):
        before, command = plant.save(), np.array(plant.joints) + rng.normal(0.0, 0.05, 7)
        plant.command(command)
        passed(plant, 0.05)
        steps.append((before, command, plant.save()))
    for before, command, after in reversed(steps):
        other.restore(before)
        other.command(command)
        passed(other, 0.05)
        assert other.save().tobytes() == after.tobytes()


def test_a_block_is_lifted_by_friction_alone_and_falls_when_it_is_let_go(tower):
    domain, state = tower
    plant = MujocoPlant.of(domain, state)
    assert plant._model.neq == 1  # one coupling, of both fingers: nothing is welded
    pose = plant.poses()["block1"]
    x, y, z = pose.position
    yaw = 2.0 * math.atan2(pose.quaternion[2], pose.quaternion[3])
    start = np.array(plant.joints)
    over = inverse_kinematics(from_above((x, y, z + LIFT), yaw), start)
    around = inverse_kinematics(from_above((x, y, z), yaw), over)
    moved(plant, over, 1.0)
    moved(plant, around, 1.0)
    plant.command_fingers(0.0, FORCE)
    passed(plant, 0.5)
    assert plant.gap == pytest.approx(0.05, abs=SHIFT)
    assert pressed(plant, "block1") == pytest.approx([FORCE, FORCE], rel=0.05)
    moved(plant, over, 1.0)
    held = plant.poses()["block1"].position
    assert math.dist(held, (x, y, z + LIFT)) < 0.005
    passed(plant, 3.0)
    assert math.dist(held, plant.poses()["block1"].position) < SHIFT  # and it does not creep
    plant.command_fingers(0.04)
    passed(plant, 1.0)
    assert plant.poses()["block1"].position[2] == pytest.approx(z, abs=SHIFT)


def grasped_askew(plant, name):
    """Fingers press a toy from above, 0.2 rad askew and over its middle; the grasp and the toy."""
    x, y, z = plant.poses()[name].position
    turn = plant.poses()[name].quaternion
    yaw = 2.0 * math.atan2(turn[2], turn[3]) + 0.2
    start = np.array(plant.joints)
    over = inverse_kinematics(from_above((x, y, z + LIFT), yaw), start)
    moved(plant, over, 1.0)
    moved(plant, inverse_kinematics(from_above((x, y, z + 0.008), yaw), over), 1.0)
    plant.command_fingers(0.0)
    passed(plant, 1.0)
    moved(plant, over, 1.0)


def test_a_toy_stays_in_the_hand_as_it_was_grasped_and_falls_straight_down():
    """Fingers of 70 N on 10 g: they slid along its sides by a centimetre, and flung it away."""
    domain = get_domain("cleanup_table")
    plant = MujocoPlant.of(domain, domain.task(1).initial_state)
    grasped_askew(plant, "duck")
    held, gap = plant.poses()["duck"], plant.gap
    passed(plant, 4.0)
    later = plant.poses()["duck"]
    assert math.dist(held.position, later.position) < 0.0005
    assert held.angle_to(later) < 0.005
    assert plant.gap == pytest.approx(gap, abs=0.0005)
    plant.command_fingers(0.04)
    fastest = 0.0
    for _ in range(500):
        plant.step()
        fastest = max(fastest, plant.gap_velocity)
    assert plant.gap == pytest.approx(0.08, abs=0.002)
    assert fastest < 0.2  # m/s, of both fingers together, which do 50 mm/s each
    assert math.dist(plant.poses()["duck"].position[:2], held.position[:2]) < 0.03


def test_an_arm_that_moves_lags_behind_what_it_is_told(tower):
    plant = MujocoPlant.of(*tower)
    target = np.add(plant.joints, np.eye(7)[0] * 0.3)
    plant.command(target)
    passed(plant, 0.02)
    assert 0.02 < target[0] - plant.joints[0] < 0.3
    passed(plant, 1.0)
    assert plant.joints == pytest.approx(target.tolist(), abs=2e-3)


@dataclass(frozen=True)
class Ball(RigidBody):
    """A body that the model has no shape for."""

    shape: float = 0.02


def test_a_body_that_cannot_be_expressed_is_named(tower):
    domain, state = tower
    scene = scene_around(domain, state)
    odd = Scene((*scene.bodies, Ball("ball", friction=0.9)))
    with pytest.raises(InvalidSceneError, match="ball: a Ball is neither a box nor"):
        scene_spec(odd, state)
    thin = {"block1": (0.0, 0.1, 0.1)}
    flat = Scene(
        tuple(replace(b, half_extents_m=thin.get(b.name, b.half_extents_m)) for b in scene.bodies)
    )
    with pytest.raises(InvalidSceneError, match="block1"):
        compiled(scene_spec(flat, state))


def test_without_the_extra_it_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)  # as Python marks what cannot be imported
    with pytest.raises(InvalidParameterError, match=r"pip install 'slap_ros\[mujoco\]'"):
        require_mujoco()


def test_a_stack_is_built_in_closed_loop_by_what_is_measured(tower):
    domain, _ = tower
    task = task_with_goal(domain, 1, 0, "(On block4 block5)")
    space = domain.atom_space(task.initial_state)
    world = ClosedLoopWorld(domain, task.initial_state)
    planner = make_planner("lazy", domain, task.initial_state)
    goal = space.mask(task.goal)
    episode = Executor(domain, planner, world, space, goal, task.step_limit).run()
    assert episode.success, episode.error
    assert not episode.replans
    on, under = (world.plant.poses()[name].position for name in ("block4", "block5"))
    assert on == pytest.approx((under[0], under[1], under[2] + 0.05), abs=0.01)
    world.close()


@pytest.mark.slow  # 24 steps with a body of many pieces
@pytest.mark.timeout(300)
def test_a_tool_is_held_by_its_handle_though_its_middle_is_beside_the_hand():
    """Fingers meet where it is narrow, far closer than the model's fingers stand around it."""
    domain = get_domain("cleanup_table")
    world = ClosedLoopWorld(domain, domain.task(1).initial_state)
    state = world.state
    objects = tuple(state.layout.object(name) for name in ("robot", "wiper", "table"))
    try:
        for skill in ("Reach", "Grasp", "Lift"):
            policy = domain.skills[skill].start(state, objects)
            while (action := policy(state)) is not None:
                state = world.step(action)
        assert state.get(objects[1], "held") == 1.0
        assert world.plant.poses()["wiper"].position[2] > 0.1
        assert 0.01 < world.plant.gap < 0.03
    finally:
        world.close()
