# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Skills at a bench that act on what is measured on the robot in MuJoCo, while it moves."""

import math
import subprocess
import sys

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import InvalidCommandError, InvalidParameterError, InvalidStateError
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.evaluation.experiment import solve
from slap_ros.planning.planner import make_planner
from slap_ros.skills.domain_choice import DEMONSTRATOR, DomainChoice, open_domain
from slap_ros.studies.robot_trials import solve_on_robot
from slap_ros.worlds.contact.clearing import DEEPEST
from slap_ros.worlds.contact.features import ROBOT
from slap_ros.worlds.contact.hand import PALM, rotation_between
from slap_ros.worlds.contact.snapshot import ContactIndex
from slap_ros.worlds.panda import HOME, GraspKinematics, grasp_pose
from support.programs import environment
from tools.processors import PROCESSORS

pytest.importorskip("pybullet")
pytest.importorskip("mujoco")

from slap_ros.robot.mujoco.arm import (
    ARM_JOINTS,
    JOINT_POSITIONS,
    STIFFNESS,
    TORQUE,
    ArmMotors,
    arm_spec,
)
from slap_ros.robot.mujoco.contact_loop import ContactLoopWorld
from slap_ros.robot.mujoco.engine import mujoco
from slap_ros.robot.mujoco.impedance import (
    FORCE,
    POSTURE_STIFFNESS,
    TURN_STIFFNESS,
    HandImpedance,
)
from slap_ros.robot.mujoco.model import scene_around

SEED = 300
AHEAD = np.array([0.02, 0.0, 0.0, 0.0, 0.0])  # m, m, m, rad, 1
CLOSE = np.array([0.0, 0.0, 0.0, 0.0, 1.0])
DOWN = np.array([0.0, 0.0, -0.02, 0.0, 0.0])
STAY = np.zeros(5)
STAY_JOINTS = np.zeros(7)
STIFF = ArmMotors(stiffness=10.0, lag_s=0.015)  # the lag of the contact world's own hand


@pytest.fixture(scope="module")
def domain():
    """Stack at Target with the demonstrator's scripts, whose states are measured."""
    return open_domain(DomainChoice("stack_at_target", skills=DEMONSTRATOR, measured=True))


def loop_world(domain, control=JOINT_POSITIONS):
    return ContactLoopWorld(domain, domain.task(SEED).initial_state, control)


def snapshot(world, domain):
    scene = scene_around(domain, world.state)
    return ContactIndex.of(scene, world.state.layout).read(world.state)


def test_a_state_is_what_the_plant_has_and_what_the_hand_was_told(domain):
    """The arm is still on its way: what was told is ahead of what is measured."""
    world = loop_world(domain)
    begun = snapshot(world, domain).hand
    for _ in range(3):
        world.step(AHEAD + CLOSE)
    plant, now = world.plant, snapshot(world, domain)
    assert list(now.joints) == plant.joints
    assert now.hand.pose == grasp_pose(plant.joints)
    assert now.hand.fingers == pytest.approx(plant.fingers, abs=1e-9)
    assert now.hand.closing and not begun.closing
    for body, name in zip(now.bodies, plant.poses(), strict=True):
        assert body == plant.motions()[name]
    assert now.hand.target[1:] == begun.target[1:]
    assert begun.target[0] + 0.03 < now.hand.target[0] <= begun.target[0] + 0.06
    assert 0.01 < now.hand.target[0] - now.hand.pose.position[0] < 0.03  # it lags, on its leash
    before, after = now.hand, snapshot_after(world, domain, STAY)
    moved = np.subtract(after.pose.position, before.pose.position) / 0.05
    fastest, slowest = before.velocity[0], after.velocity[0]
    assert 0.0 < min(fastest, slowest) < moved[0] * 1.2 and moved[0] < max(fastest, slowest) * 1.2


def snapshot_after(world, domain, action):
    world.step(action)
    return snapshot(world, domain).hand


def test_a_command_replaces_the_one_before_on_the_way(domain):
    """Nothing waits: each step takes a control period, and the arm turns round within the next."""
    world = loop_world(domain)
    began_s = world.plant.time_s
    for _ in range(4):
        world.step(AHEAD)
    assert world.plant.time_s - began_s == pytest.approx(4 * 0.05)
    assert snapshot(world, domain).hand.velocity[0] > 0.1
    for _ in range(4):
        world.step(-AHEAD)
    assert snapshot(world, domain).hand.velocity[0] < 0.0


def test_fingers_close_while_the_arm_moves(domain):
    world = loop_world(domain)
    world.step(AHEAD + CLOSE)
    hand = snapshot(world, domain).hand
    assert hand.velocity[0] > 0.05
    assert all(-0.06 < velocity < -0.04 for velocity in hand.finger_velocities)  # Franka's speed


def test_a_stiffer_arm_lags_less_and_has_a_pandas_torques(domain):
    behind = []
    for control in (JOINT_POSITIONS, STIFF):
        world = loop_world(domain, control)
        for _ in range(3):
            world.step(AHEAD)
        hand = snapshot(world, domain).hand
        behind.append(hand.target[0] - hand.pose.position[0])
    assert behind[1] < 0.5 * behind[0]
    usual, stiff = arm_spec().compile(), arm_spec(STIFF).compile()
    for i, name in enumerate(ARM_JOINTS):
        soft, hard = usual.actuator(name), stiff.actuator(name)
        assert (soft.gainprm[0], hard.gainprm[0]) == (STIFFNESS[i], 10.0 * STIFFNESS[i])
        assert -hard.biasprm[2] == pytest.approx(STIFF.lag_s * hard.gainprm[0])
        assert soft.forcerange.tolist() == hard.forcerange.tolist() == [-TORQUE[i], TORQUE[i]]


@pytest.mark.parametrize("control", [JOINT_POSITIONS, HandImpedance()])
def test_the_same_actions_give_the_same_states_to_the_bit(domain, control):
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (12, 5)) * [0.02, 0.02, 0.02, 0.15, 1.0]
    states = []
    for _ in range(2):
        world = loop_world(domain, control)
        states.append([world.step(action).data.tobytes() for action in actions])
    assert states[0] == states[1]


@pytest.mark.slow
@pytest.mark.parametrize("processor", ["nehalem", "numpy"])
def test_other_processors_have_the_same_states_to_the_bit(processor):
    """Whatever code numpy and its linear algebra choose there."""
    program = """
import numpy as np
from slap_ros.robot.mujoco.contact_loop import ContactLoopWorld
from slap_ros.robot.mujoco.impedance import HandImpedance
from slap_ros.skills.domain_choice import DEMONSTRATOR, DomainChoice, open_domain
domain = open_domain(DomainChoice("stack_at_target", skills=DEMONSTRATOR, measured=True))
for control in (HandImpedance(), None):
    given = () if control is None else (control,)
    world = ContactLoopWorld(domain, domain.task(300).initial_state, *given)
    for action in np.random.default_rng(0).uniform(-0.02, 0.02, (6, 5)):
        state = world.step(action)
    print(state.data.tobytes().hex())
"""
    here, there = (
        subprocess.run(
            [sys.executable, "-c", program],
            env=environment() | dict(PROCESSORS[name] if name else {}),
            check=True,
            stdout=subprocess.PIPE,
        ).stdout
        for name in ("", processor)
    )
    assert here == there != b""


def test_the_elbow_goes_where_that_moves_no_hand():
    """Torques are those of numpy's pseudo-inverse, and none beyond a Panda's."""
    rng, control = np.random.default_rng(0), HandImpedance()
    for _ in range(20):
        joints = np.add(HOME, rng.normal(0.0, 0.2, 7))
        matrix = GraspKinematics(joints).jacobian()
        told = joints + np.linalg.svd(matrix)[2][-1] * 0.02  # where the hand is, but for curvature
        torques = control.commands(told, joints, np.zeros(7))
        unmoved = np.eye(7) - np.linalg.pinv(matrix) @ matrix
        way = np.subtract(grasp_pose(told).position, grasp_pose(joints).position)
        turn = rotation_between(grasp_pose(joints), grasp_pose(told))
        wrench = np.concatenate([control.stiffness * way, TURN_STIFFNESS * np.array(turn)])
        posture = POSTURE_STIFFNESS * (told - joints)
        np.testing.assert_allclose(torques, matrix.T @ wrench + unmoved @ posture, atol=1e-9)
        assert np.linalg.norm(unmoved @ posture) > 0.99 * np.linalg.norm(posture)
    far = control.commands(joints + 0.5, joints, np.zeros(7))
    assert max(np.abs(far) / TORQUE) == pytest.approx(1.0)


def test_where_a_command_has_the_hand_is_computed_once(domain, monkeypatch):
    """A command stands for 25 periods of the controller; others between leave it the same."""
    computed = []

    def counted(joints):
        computed.append(joints)
        return grasp_pose(joints)

    monkeypatch.setattr("slap_ros.robot.mujoco.impedance.grasp_pose", counted)
    world = loop_world(domain, HandImpedance())
    for _ in range(4):
        world.step(AHEAD)
    assert len(computed) <= 5
    control, joints, told = HandImpedance(), HOME, np.add(HOME, 0.1)
    first = control.commands(told, joints, STAY_JOINTS)
    assert control.commands(HOME, joints, STAY_JOINTS) != first
    assert control.commands(told.tolist(), joints, STAY_JOINTS) == first


def pressed_n(world):
    """The force with which fingers press on the table, N."""
    plant, wrench, total = world.plant, np.zeros(6), 0.0
    table = plant._model.body("table").id
    for i in range(plant._data.ncon):
        if table in plant._model.geom_bodyid[plant._data.contact[i].geom]:
            mujoco.mj_contactForce(plant._model, plant._data, i, wrench)
            ahead, aside, other = plant._data.contact[i].frame.reshape(3, 3) * wrench[:3, None]
            total += abs(float((ahead + aside + other)[2]))
    return total


def test_an_impedance_presses_with_limited_force_and_stiff_joints_with_more(domain):
    """The hand is told to be 3 cm inside the table, as skills tell it that press on a handle."""
    forces = []
    for control in (HandImpedance(), STIFF):
        world = loop_world(domain, control)
        for _ in range(40):
            world.step(DOWN)
        hand = snapshot(world, domain).hand
        assert hand.pose.position[2] - hand.target[2] == pytest.approx(0.03, abs=1e-3)
        forces.append(pressed_n(world))
    assert 0.8 * FORCE < forces[0] < 1.1 * FORCE
    assert forces[1] > 2.0 * FORCE


def test_a_pandas_hand_in_the_contact_world_goes_as_the_impedance_pulls_it():
    """That is what ``hand=panda`` is: the planner's model of this arm."""
    panda = open_domain(DomainChoice("stack_at_target", "fair:hand=panda", DEMONSTRATOR))
    plant, model = (
        loop_world(panda, HandImpedance()),
        panda.make_world(panda.task(SEED).initial_state),
    )
    for step in range(14):
        action = AHEAD * (0.5 if step < 8 else 0.0)
        plant.step(action)
        model.step(action)
        there, here = (snapshot(world, panda).hand for world in (plant, model))
        assert there.target == pytest.approx(here.target, abs=1e-9)
        assert there.pose.position == pytest.approx(here.pose.position, abs=4e-3)
    assert there.pose.position == pytest.approx(there.target, abs=1e-3)
    model.close()


def lower_edges_outside_m():
    """How far the planner's palm reaches out of the hand that MuJoCo has, downwards, m."""
    model = arm_spec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    joints = [float(data.qpos[model.joint(name).qposadr[0]]) for name in ARM_JOINTS]
    geom = int(np.flatnonzero(model.geom_bodyid == model.body("panda_hand").id)[0])
    mesh, frame = model.geom_dataid[geom], grasp_pose(joints).inverse()
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    turn, origin = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
    corners = model.mesh_vert[first : first + count] @ turn.T + origin
    hand = np.array([frame.apply(tuple(corner)) for corner in corners])
    ways = np.random.default_rng(0).normal(size=(20_000, 3))
    ways[:, 2] = np.abs(ways[:, 2])  # z of the hand points down
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    palm = np.abs(ways) @ PALM.half_extents_m + ways @ PALM.pose.position
    return float((palm - (ways @ hand.T).max(axis=1)).max())


def test_a_hand_is_cleared_as_far_as_the_planners_palm_is_wider_than_a_pandas():
    assert 0.017 < lower_edges_outside_m() < DEEPEST


def solved(domain, control, seed=SEED):
    return solve_on_robot(
        domain,
        domain.task(seed),
        lambda domain, state: make_planner("lazy", domain, state),
        lambda domain, state: ContactLoopWorld(domain, state, control),
    )


def test_scripts_stack_with_a_stiff_arm_as_they_do_in_the_contact_world(domain):
    """With the lag of the contact world's own hand; fingers alone are slower."""
    trial = solved(domain, STIFF)
    assert trial.success
    assert not trial.replans
    own = solve(domain, domain.task(SEED), PURE_PLANNING)
    assert [edge.option for edge in trial.edges] == [edge.option for edge in own.edges]
    assert own.plan_length < trial.plan_length < 1.5 * own.plan_length


@pytest.fixture(scope="module")
def shipped():
    """Stack at Target with the skills that ship."""
    return open_domain(DomainChoice("stack_at_target", measured=True))


def test_skills_that_ship_stack_by_what_is_measured(shipped):
    first, again = (solved(shipped, ArmMotors(stiffness=4.0), SEED + 4) for _ in range(2))
    assert first.success
    assert first.plan_length == again.plan_length
    assert first.edges == again.edges


def test_a_cube_that_is_moved_meanwhile_is_grasped_where_it_is(shipped):
    """A recording would close the hand around nothing: a skill in closed loop looks."""
    world = ContactLoopWorld(shipped, shipped.task(SEED).initial_state, ArmMotors(4.0))
    cube, plant = world.state.layout.object("cube0"), world.plant
    policy = shipped.skills["Pick"].start(world.state, (cube,))
    for step in range(80):
        if step == 10:
            plant._data.qpos[plant._model.joint("cube0").qposadr[0] + 1] += 0.03  # m
        action = policy(world.state)
        if action is None or world.state.get(cube, "z") > 0.06:
            break
        world.step(action)
    assert world.state.get(cube, "held") == 1.0
    assert plant.grasped() == "cube0"


def test_what_is_no_action_moves_nothing(domain):
    world = loop_world(domain)
    before = world.plant.save()
    with pytest.raises(InvalidCommandError):
        world.step(np.array([0.5, 0.0, 0.0, 0.0, 0.0]))
    assert np.array_equal(world.plant.save(), before)
    assert not snapshot(world, domain).hand.closing
    with pytest.raises(InvalidStateError, match="cannot be put"):
        world.reset(world.state)


def test_a_hand_at_the_end_of_its_reach_stands(domain):
    """A target out of reach is refused by the servo as by the contact world."""
    world = loop_world(domain)
    for _ in range(120):
        world.step(AHEAD)
    hand = snapshot(world, domain).hand
    assert math.hypot(*hand.velocity) < 0.01
    assert math.dist(hand.target, hand.pose.position) < 0.005
    world.state.require_finite()
    domain.make_world(world.state).close()  # the planner's world takes it


def test_what_the_loop_is_not_for_is_named():
    tower = get_domain("obstacle_tower")
    with pytest.raises(InvalidParameterError, match="ClosedLoopWorld"):
        ContactLoopWorld(tower, tower.task(1).initial_state)
    with pytest.raises(InvalidParameterError, match="stiffness"):
        ArmMotors(stiffness=0.0)
    with pytest.raises(InvalidParameterError, match="lag_s"):
        ArmMotors(lag_s=math.nan)
    with pytest.raises(InvalidParameterError, match="impedance is -1"):
        HandImpedance(-1.0)
    assert ROBOT not in tower.types
