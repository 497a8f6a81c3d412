# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A hand that acts by forces, as a world to be stepped.

A control step moves the hand's target, and says whether the fingers close; the hand is pulled to
its target for one control period. The next state is a function of the state and the action, bit
for bit (``docs/contact.md`` says how, and what it costs).
"""

from __future__ import annotations

from slap_ros.core import Action, ActionSpace, GripperAxis
from slap_ros.geometry.pose import ORIGIN
from slap_ros.relational import Feature, State
from slap_ros.worlds.contact.arm import Joints, arm_joints, in_time
from slap_ros.worlds.contact.command import commanded
from slap_ros.worlds.contact.contacts import ContactPoint
from slap_ros.worlds.contact.dynamics import ContactDynamics
from slap_ros.worlds.contact.features import GRIPPER, ROBOT
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.contact.simulation import SIMULATIONS
from slap_ros.worlds.contact.snapshot import ContactIndex, ContactSnapshot
from slap_ros.worlds.contact.validation import require_possible
from slap_ros.worlds.simulated_world import SimulatedWorld

MAX_SHIFT = 0.02  # m along each axis in a control step: 0.4 m/s
MAX_TURN = 0.15  # rad about the vertical: 3 rad/s
ACTION_SPACE = ActionSpace(
    axes=(
        *(Feature(axis, "m") for axis in ("x", "y", "z")),
        Feature("yaw", "rad"),
        Feature("gripper", "1"),
    ),
    low=(-MAX_SHIFT, -MAX_SHIFT, -MAX_SHIFT, -MAX_TURN, -1.0),
    high=(MAX_SHIFT, MAX_SHIFT, MAX_SHIFT, MAX_TURN, 1.0),
    gripper=GripperAxis("gripper"),
)
# Where an arm is nearly stretched, its joints go further than in proportion to the hand's way.
PARTS = (1.0, 0.25, 0.06)  # of the way that seems to be possible, until it is


class ContactWorld(SimulatedWorld[ContactScene]):
    """A hand that is pulled to its target, and what it touches."""

    def __init__(self, scene: ContactScene, state: State) -> None:
        """Begin in ``state``.

        Args:
            scene: Bodies of the scene.
            state: State to begin in: one robot, and an object for each free or jointed body of the
                scene.

        Raises:
            InvalidStateError: A scene that cannot be.
        """
        super().__init__(scene, state.layout)
        self._index = ContactIndex.of(scene, state.layout)
        (robot,) = state.layout.of_type(ROBOT)
        self._gripper = state.layout.column(robot, GRIPPER.name)
        self._require_possible(state)
        self._dynamics = ContactDynamics(scene, SIMULATIONS.of(scene))
        self._adopt(state)

    @property
    def contacts(self) -> tuple[ContactPoint, ...]:
        """What touched what at the end of the latest step, of what had to be computed."""
        return self._contacts

    def reset(self, state: State) -> None:
        """Continue from ``state``.

        Raises:
            InvalidStateError: A scene that cannot be, or other objects; the world stays as it is.
        """
        self._require_own_objects(state)
        self._require_possible(state)
        self._adopt(state)

    def _require_possible(self, state: State) -> None:
        state.require_finite()
        snapshot = self._index.read(state)
        placement = self._index.placement(self._scene, state)
        require_possible(self._scene, snapshot, placement, float(state.data[self._gripper]))

    def _adopt(self, state: State) -> None:
        self._dynamics.place(self._index.placement(self._scene, state))
        self._state, self._snapshot = state, self._index.read(state)
        self._contacts: tuple[ContactPoint, ...] = ()

    def step(self, action: Action) -> State:
        """Act for one control period.

        A target that the arm cannot reach is refused: the old one stays. Where the arm could not
        be in time, the hand is pulled only part of the way in this period. Where forces would
        take the hand to where the arm cannot be in time, it is held back, and its target with it.

        Raises:
            InvalidCommandError: The action is not in the action space; nothing moved.
            ValueError: The world is closed.
        """
        self._require_open()
        ACTION_SPACE.check(action)
        now = self._snapshot
        command = commanded(now.hand, now.joints, action)
        told = command.hand
        held_back = told._replace(target=told.pose.position, target_yaw=told.yaw)
        tries = [(told, part) for part in PARTS] + [(held_back, 0.0)]
        for hand, part in tries:
            pull = command.pull(part)
            after, self._contacts = self._dynamics.after(now._replace(hand=hand), pull)
            followed = _followed(now, after)
            if followed is not None:
                self._snapshot = after._replace(joints=followed)
                break
        else:  # not even held back did the hand stay where the arm can be: it stops at once
            stopped = held_back._replace(velocity=ORIGIN, angular_velocity=ORIGIN)
            self._snapshot = after._replace(joints=now.joints, hand=stopped, held=None)
        self._state = self._index.write(self._state, self._snapshot)
        return self._state


def _followed(before: ContactSnapshot, after: ContactSnapshot) -> Joints | None:
    """The arm's joints with the hand where it is now; None if they cannot be there in time."""
    if after.hand.pose == before.hand.pose:
        return before.joints
    joints = arm_joints(after.hand.pose)
    return joints if joints is not None and in_time(before.joints, joints) else None
