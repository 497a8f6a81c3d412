# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated FR3 that speaks the robot's protocol: motions, faults, and nothing after a fault."""

import json
import signal
import socket
import struct
import threading
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from slap_ros.doctor.franka import examine
from slap_ros.errors import (
    AlreadyRunningError,
    ErrorCode,
    GripperFailedError,
    InvalidCommandError,
    RobotReflexError,
    RobotUnreachableError,
    RobotVersionError,
)
from slap_ros.robot.blending import blend
from slap_ros.robot.franka.arm import ArmProbe, FrankaArm, FrankaSettings
from slap_ros.robot.franka.limits import FRANKA
from slap_ros.robot.franka.simulation import SimulatedFr3
from slap_ros.worlds.panda import HOME
from support.franka_wheels import NO_WHEEL, require_simulated_fr3
from support.slap_command import slap

LIMIT = 60.0  # s, far more than anything here takes


@pytest.fixture(scope="module")
def simulation():
    require_simulated_fr3()
    with SimulatedFr3(HOME) as started:
        yield started


def settings(ip):
    return FrankaSettings(ip, FRANKA, realtime=False)


@contextmanager
def connected(ip):
    arm = FrankaArm(settings(ip))
    try:
        yield arm
    finally:
        arm.close()


@pytest.fixture(scope="module")
def shared_arm(simulation):
    with connected(simulation.ip) as arm:
        yield arm


@pytest.fixture
def arm(shared_arm):
    """An arm without a fault, which rests."""
    yield shared_arm
    if shared_arm.fault is not None:
        shared_arm.recover()


def way(arm, angle, steps=4):
    """Points of a motion of two joints by an angle, rad."""
    start = np.array(arm.reading.joints)
    moved = angle * np.array([1, 0, 0.5, 0, 0, 0, 0])
    places = [tuple((start + part * moved).tolist()) for part in np.linspace(0.0, 1.0, steps + 1)]
    return blend(places, arm.settings.motion_limits, 0.125).points


def ended(outcome):
    assert outcome.done.wait(LIMIT)
    return outcome.error


def test_a_motion_goes_through_its_waypoints_and_ends_at_the_last(arm):
    points, path = way(arm, 0.2), []
    arm.on_reading = path.append
    outcome = arm.follow(points)
    assert ended(outcome) is None
    np.testing.assert_allclose(arm.reading.joints, points[-1].positions, atol=0.01)
    read = np.array([reading.joints for reading in path])
    assert read[:, 0].max() <= points[-1].positions[0] + 0.005
    speed = np.abs([reading.velocities for reading in path]).max(axis=0)
    assert (speed <= np.array(FRANKA.velocity)).all()
    lasted = outcome.ended_s - outcome.began_s
    assert 0.7 * points[-1].time_s < lasted < points[-1].time_s + 0.1


def test_fingers_close_to_a_gap_and_open(arm):
    for gap in (0.05, 0.08):
        assert ended(arm.grip(gap, 20.0)) is None
        assert arm.reading.gap == pytest.approx(gap, abs=0.004)


def test_an_arm_that_is_told_to_hold_stops_on_the_way(arm, simulation):
    start = arm.reading.joints[0]
    outcome = arm.follow(way(arm, 0.8, steps=10))
    began = threading.Event()
    arm.on_reading = lambda reading: abs(reading.joints[0] - start) > 0.02 and began.set()
    assert began.wait(LIMIT)
    arm.hold()
    assert ended(outcome) is None
    assert 0.02 < arm.reading.joints[0] - start < 0.6
    with pytest.raises(InvalidCommandError, match="beyond"):
        arm.follow([replace(way(arm, 0.1)[-1], positions=(4.0, *HOME[1:]))])


@pytest.mark.parametrize("moving", [True, False])
def test_after_a_reflex_nothing_moves_until_somebody_recovers(arm, simulation, moving):
    outcome = arm.follow(way(arm, -0.4, steps=8)) if moving else None
    stopped = threading.Event()
    arm.on_reading = lambda _: arm.fault is not None and stopped.set()
    simulation.inject("reflex")
    if outcome is not None:
        assert isinstance(ended(outcome), RobotReflexError)
    else:
        assert stopped.wait(LIMIT)
    assert "joint_reflex" in str(arm.fault)
    there = arm.reading.joints
    with pytest.raises(RobotReflexError, match="look at the arm"):
        arm.follow(way(arm, 0.1))
    with pytest.raises(RobotReflexError):
        arm.grip(0.0, 20.0)
    arm.recover()
    np.testing.assert_allclose(arm.reading.joints, there, atol=0.02)
    assert ended(arm.follow(way(arm, 0.05))) is None


def test_states_that_come_50_ms_late_end_in_a_communication_reflex(arm, simulation):
    simulation.inject("delay 0.05")
    try:
        error = ended(arm.follow(way(arm, 0.2)))
    finally:
        simulation.inject("delay 0")
    assert error.code is ErrorCode.ROBOT_REFLEX
    assert "communication_constraints_violation" in str(arm.fault)


def test_a_second_driver_is_refused_and_does_not_disturb_the_first(arm, simulation):
    with pytest.raises(AlreadyRunningError, match="another program drives the robot"):
        FrankaArm(settings(simulation.ip))
    assert ended(arm.follow(way(arm, 0.05))) is None


def test_a_robot_with_another_version_is_named(simulation):
    """A server that answers as a robot of an older system version does."""
    with socket.create_server(("127.78.0.1", 1337)) as server:

        def answer():
            peer, _ = server.accept()
            with peer:
                request = peer.recv(100)
                peer.sendall(request[:8] + struct.pack("<IHH4x", 20, 1, 5))
                peer.recv(100)

        threading.Thread(target=answer, daemon=True).start()
        with pytest.raises(RobotVersionError, match="version"):
            FrankaArm(settings("127.78.0.1"))


def test_a_robot_that_is_not_there_is_named(simulation):
    with pytest.raises(RobotUnreachableError, match="FCI"):
        FrankaArm(settings("127.78.0.2"))


@pytest.mark.slow  # starts a simulation of its own
def test_a_late_answer_to_a_motion_does_not_end_the_next():
    """Sent before the Move, and read together with it, as on a machine that has other work."""
    pytest.importorskip("franky_sim", reason=NO_WHEEL)
    from franky_sim.franka_robot_protocol import MoveCommand, MoveStatus, RobotCommand, UDPCommand

    with (
        SimulatedFr3(HOME) as own,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as states,
        socket.create_connection((own.ip, 1337), LIMIT) as commands,
    ):
        states.bind(("", 0))
        states.settimeout(LIMIT)
        commands.settimeout(LIMIT)
        commands.sendall(struct.pack("<IIIHH", 0, 1, 16, 10, states.getsockname()[1]))
        assert len(commands.recv(20, socket.MSG_WAITALL)) == 20
        _, control = states.recvfrom(65536)
        zeros = [0.0] * 38
        late = UDPCommand.STRUCT.pack(9, *zeros, False, True, *zeros[:7], False)  # has ended
        own._process.send_signal(signal.SIGSTOP)
        states.sendto(late, control)
        move = MoveCommand.STRUCT.pack(0, 0, *zeros[:6])
        commands.sendall(struct.pack("<III", RobotCommand.kMove, 2, 12 + len(move)) + move)
        own._process.send_signal(signal.SIGCONT)
        answer = struct.unpack("<IIIB", commands.recv(13, socket.MSG_WAITALL))
        assert answer == (RobotCommand.kMove, 2, 13, MoveStatus.kMotionStarted)
        commands.settimeout(1.0)
        with pytest.raises(TimeoutError):
            commands.recv(13)  # that it has ended


@pytest.mark.slow  # starts a simulation of its own
def test_a_gripper_that_fails_and_a_robot_that_is_gone_are_named():
    pytest.importorskip("franky_sim", reason=NO_WHEEL)
    with SimulatedFr3(HOME) as own, connected(own.ip) as arm:
        own.inject("gripper")
        assert isinstance(ended(arm.grip(0.02, 20.0)), GripperFailedError)
        with pytest.raises(GripperFailedError):
            arm.follow(way(arm, 0.1))
        arm.recover()
        outcome = arm.follow(way(arm, 0.8, steps=10))
        own.kill()
        assert isinstance(ended(outcome), RobotUnreachableError)
        with pytest.raises(RobotUnreachableError):
            arm.follow(way(arm, 0.1))


def test_the_doctor_looks_at_an_arm_and_moves_nothing(arm, simulation):
    before = arm.reading.joints
    arm_says = examine(arm.settings, arm.reading, arm.probe(5))
    assert {c.name: c.status for c in arm_says if c.name != "Network"} == {
        "Robot": "ok",
        "Protocol": "ok",
        "Gripper": "ok",
        "Joint limits": "ok",
        "Collision thresholds": "ok",
    }
    np.testing.assert_allclose(arm.reading.joints, before, atol=1e-3)
    bent = replace(arm.reading, joints=(*before[:6], 3.0))
    unhomed = ArmProbe("Reflex", (0.02, 0.03), 3, 0.0)
    found = {c.name: c.status for c in examine(arm.settings, bent, unhomed)}
    assert found["Robot"] == found["Gripper"] == found["Network"] == "problem"
    assert found["Joint limits"] == "warning"


def test_the_doctor_names_what_keeps_it_from_a_robot(simulation):
    told = slap("doctor", "--robot", "ip=127.78.0.5", "--json")
    assert told.exit_code == 1
    (robot,) = [check for check in json.loads(told.stdout) if check["name"] == "Robot"]
    assert robot["status"] == "problem"
    assert "ROBOT_UNREACHABLE" in robot["found"]
    wrong = slap("doctor", "--robot", "172.16.0.2")
    assert wrong.exit_code == ErrorCode.INVALID_PARAMETER
