# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The contact step against an articulated arm: ``python -m benchmarks.contact_step [--json]``.

Both in one process, in turns, in CPU time, at the same fidelity: the same bodies, substeps and
solver iterations, and everything set from the state in every control period. The articulated arm
is ``pybullet_data``'s Panda, driven to joint positions; nothing is left out for it, and only its
physics is timed, without inverse kinematics and without reading and writing states.

The scene has two drawers, a lid and two free bodies. Each situation is a script that a hand carried
out; the arm is given the same poses of the hand.
"""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

from benchmarks.contact_pieces import without
from benchmarks.printing import show
from benchmarks.workbench import (
    BENCH,
    HANDLE_AT,
    Move,
    Setting,
    action_towards,
    lying_above,
    perform,
    start,
)
from slap_ros.geometry.pose import NO_ROTATION, Pose
from slap_ros.relational import State
from slap_ros.worlds.bullet import PANDA, pybullet
from slap_ros.worlds.contact.arm import CONTROL_PERIOD_S, arm_joints
from slap_ros.worlds.contact.contacts import Side, Surface
from slap_ros.worlds.contact.hand import SUBSTEPS, HandState, hand_at
from slap_ros.worlds.contact.hand_model import QUICK
from slap_ros.worlds.contact.involved import Involved
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.contact.simulation import ContactSimulation
from slap_ros.worlds.contact.snapshot import ContactIndex, ContactSnapshot
from slap_ros.worlds.contact.world import ContactWorld
from slap_ros.worlds.panda import FINGER_CLOSED, FINGER_OPEN, HOME, JOINTS

ROUNDS = 5  # the best counts: others share the machine
ARM_TORQUES = (87.0, 87.0, 87.0, 87.0, 30.0, 30.0, 30.0)  # N m
FINGER_LINKS = (9, 10)
QUARTER = 0.5 * math.pi  # rad


class ArticulatedArm(ContactSimulation):
    """A world of the bodies around a whole Panda, whose joints are driven to their targets."""

    def __init__(self, scene: ContactScene) -> None:
        self._q, self._speeds = list(HOME), [0.0] * JOINTS
        super().__init__(scene)

    def _add_hand(self) -> int:
        base = PANDA.resolve()
        text = (base / "panda.urdf").read_text(encoding="utf-8")
        text = re.sub("<contact>.*?</contact>", "", text, flags=re.S)  # soft fingers
        with TemporaryDirectory() as folder:
            file = Path(folder) / "panda.urdf"
            file.write_text(text.replace("package://", f"{base}/"), encoding="utf-8")
            arm: int = pybullet.loadURDF(str(file), useFixedBase=True, physicsClientId=self.client)
        self._places[arm] = self._next_parking()
        self._home = pybullet.getBasePositionAndOrientation(arm, self.client)
        for link in range(-1, pybullet.getNumJoints(arm, self.client)):
            friction = QUICK.friction if link in FINGER_LINKS else 0.9
            self._touchable(arm, link, Surface(Side.PALM), friction)
            pybullet.changeDynamics(arm, link, jointDamping=0.0, physicsClientId=self.client)
        left, right = FINGER_LINKS
        gear = pybullet.createConstraint(
            arm,
            left,
            arm,
            right,
            pybullet.JOINT_GEAR,
            (1.0, 0.0, 0.0),
            (0.0, 0.0, 0.0),
            (0.0, 0.0, 0.0),
            physicsClientId=self.client,
        )
        pybullet.changeConstraint(
            gear, gearRatio=-1.0, erp=0.1, maxForce=50.0, physicsClientId=self.client
        )
        return arm

    def _add_pull(self) -> int:
        return -1

    def begin(self, hand: HandState) -> None:
        """Be where the hand is, at rest."""
        self._q, self._speeds = list(_joints(hand.pose)), [0.0] * JOINTS

    def _park_hand(self, hand: HandState) -> None:
        self._park(self._hand, NO_ROTATION)
        self._set_joints(hand, still=True)

    def _set_joints(self, hand: HandState, still: bool) -> None:
        fingers = (0.0, 0.0) if still else hand.finger_velocities
        speeds = [0.0] * JOINTS if still else self._speeds
        pybullet.resetJointStatesMultiDof(
            self._hand,
            [*range(JOINTS), *FINGER_LINKS],
            [[q] for q in (*self._q, *hand.fingers)],
            [[v] for v in (*speeds, *fingers)],
            physicsClientId=self.client,
        )

    def _set_hand(self, hand: HandState, pull: Pose) -> None:
        client = self.client
        pybullet.resetBasePositionAndOrientation(self._hand, *self._home, client)
        self._set_joints(hand, still=False)
        wanted = FINGER_CLOSED if hand.closing else FINGER_OPEN
        forces = [torque / SUBSTEPS for torque in ARM_TORQUES]
        pybullet.setJointMotorControlArray(
            self._hand,
            range(JOINTS),
            pybullet.POSITION_CONTROL,
            targetPositions=_joints(pull),
            forces=forces,
            positionGains=[0.3] * JOINTS,
            velocityGains=[1.0] * JOINTS,
            physicsClientId=client,
        )
        pybullet.setJointMotorControlArray(
            self._hand,
            FINGER_LINKS,
            pybullet.POSITION_CONTROL,
            targetPositions=(wanted, wanted),
            forces=[self.scene.hand.grip_n / SUBSTEPS] * 2,
            positionGains=[0.2] * 2,
            velocityGains=[1.0] * 2,
            physicsClientId=client,
        )

    def _hand_state(self, before: HandState) -> HandState:
        links = [*range(JOINTS), *FINGER_LINKS]
        states = pybullet.getJointStates(self._hand, links, self.client)
        self._q, self._speeds = [s[0] for s in states[:JOINTS]], [s[1] for s in states[:JOINTS]]
        left, right = states[JOINTS:]
        return before._replace(fingers=(left[0], right[0]), finger_velocities=(left[1], right[1]))


def _joints(pose: Pose) -> tuple[float, ...]:
    joints = arm_joints(pose)
    if joints is None:
        raise ValueError(f"the arm cannot have its hand at {pose}")
    return joints


Script = tuple[State, list[Move]]


def situations() -> Mapping[str, Script]:
    """What is done in each: from which state, by which moves."""
    x, y, z = HANDLE_AT
    above = start(Setting(hand=hand_at((x, y, 0.14), QUARTER)))
    return {
        "away": (start(), [Move((0.55, -0.1, 0.3), 40, yaw=0.5), Move((0.45, 0.1, 0.3), 40)]),
        "near": (
            start(Setting(hand=hand_at(lying_above("cube", 0.05)))),
            [Move(lying_above("cube", 0.03), 30, yaw=0.5), Move(lying_above("cube", 0.05), 30)],
        ),
        "grasping": (
            start(Setting(hand=hand_at(lying_above("cube", 0.06)))),
            [
                Move(lying_above("cube", 0.0), 8),
                Move(lying_above("cube", 0.0), 8, close=True),
                Move(lying_above("cube", 0.2), 16, close=True),
                Move((0.55, -0.1, 0.15), 30, close=True),
            ],
        ),
        "pulling": (
            above,
            [
                Move((x, y, z), 8, yaw=QUARTER),
                Move((x, y, z), 6, close=True, yaw=QUARTER),
                Move((x - 0.12, y, z), 30, close=True, yaw=QUARTER, fastest=0.005),
            ],
        ),
    }


def hand_rate(script: Script) -> float:
    """Control steps a second of the contact world, all of a step counted."""
    begin, moves = script
    with ContactWorld(BENCH, begin) as world:
        perform(world, moves)  # what is remembered from before is remembered
        world.reset(begin)
        actions = _actions(script)
        began = process_time()
        for action in actions:
            world.step(action)
        return len(actions) / (process_time() - began)


def stepping_share(script: Script) -> float:
    """How much of a step of the contact world PyBullet's ``stepSimulation`` takes, up to 1."""
    begin, _ = script
    actions = _actions(script)
    step, spent = pybullet.stepSimulation, 0.0

    def timed(client: int) -> None:
        nonlocal spent
        began = process_time()
        step(client)
        spent += process_time() - began

    with ContactWorld(BENCH, begin) as world, without(pybullet, "stepSimulation", timed):
        began = process_time()
        for action in actions:
            world.step(action)
        return spent / (process_time() - began)


def arm_rate(arm: ArticulatedArm, script: Script) -> float:
    """Control steps a second of the articulated arm's physics."""
    begin, _ = script
    index = ContactIndex.of(BENCH, begin.layout)
    now = index.read(begin)
    arm.place(index.placement(BENCH, begin))
    arm.begin(now.hand)
    told = _pulls(script)
    everything = Involved(tuple(range(len(BENCH.free) + len(BENCH.jointed))))
    seconds = 0.0
    for hand in told:
        fingers = now.hand._replace(pose=hand.pose, closing=hand.closing)
        now = ContactSnapshot(now.joints, fingers, now.bodies, now.openings)
        began = process_time()
        outcome = arm.run(now, hand.target_pose, everything)
        seconds += process_time() - began
        count = len(now.bodies)
        now = ContactSnapshot(
            now.joints,
            outcome.hand,
            tuple(outcome.bodies[i] for i in range(count)),
            tuple(outcome.openings[i] for i in range(len(now.openings))),
        )
    return len(told) / seconds


def _actions(script: Script) -> list[Any]:
    begin, moves = script
    actions = []
    with ContactWorld(BENCH, begin) as world:
        for move in moves:
            for _ in range(move.steps):
                actions.append(action_towards(world.state, move))
                world.step(actions[-1])
    return actions


def _pulls(script: Script) -> list[HandState]:
    """The hand at the beginning of each step, with what it was told."""
    begin, moves = script
    index = ContactIndex.of(BENCH, begin.layout)
    hands: list[HandState] = []
    watch: Callable[[State], None] = lambda state: hands.append(index.read(state).hand)  # noqa: E731
    with ContactWorld(BENCH, begin) as world:
        perform(world, moves, watch)
    return hands


def figures() -> dict[str, dict[str, float]]:
    """Steps a second of arm and hand in each situation, and their ratio."""
    arm = ArticulatedArm(BENCH)
    rows = {}
    for name, script in situations().items():
        rates = [(arm_rate(arm, script), hand_rate(script)) for _ in range(ROUNDS)]
        arms, hands = max(rate for rate, _ in rates), max(rate for _, rate in rates)
        rows[name] = {
            "arm_per_s": arms,
            "hand_per_s": hands,
            "ratio": hands / arms,
            "stepping_percent": 100.0 * median(stepping_share(script) for _ in range(ROUNDS)),
        }
    arm.close()
    return rows


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    show(figures(), arguments.json)
    if not arguments.json:
        print(f"a control step is {CONTROL_PERIOD_S} s of {SUBSTEPS} substeps")


if __name__ == "__main__":
    main()
