# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One control period of a hand among bodies in PyBullet, as a pure function.

What comes out depends on what goes in, to the bit: not on earlier calls, not on the process.
That takes the simple broadphase, substeps that are a power of two, and a *prime* before every
period: everything is parked apart for a moment, then set (``docs/contact.md``).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from slap_ros.geometry.pose import NO_ROTATION, ORIGIN, Pose, Vector
from slap_ros.worlds.bullet import pybullet
from slap_ros.worlds.contact.arm import CONTROL_PERIOD_S
from slap_ros.worlds.contact.contacts import ContactPoint, Side, Surface
from slap_ros.worlds.contact.hand import FINGER_SHARE, MASS, SUBSTEPS, HandState
from slap_ros.worlds.contact.involved import Involved
from slap_ros.worlds.contact.scene import (
    BoxPart,
    Compound,
    ContactScene,
    CylinderPart,
    JointedBody,
    Part,
)
from slap_ros.worlds.contact.snapshot import (
    ContactSnapshot,
    Opening,
    Placement,
    stopped_at_ends,
)
from slap_ros.worlds.contact.urdf import LEFT, MOVING, RIGHT, hand_urdf, jointed_urdf
from slap_ros.worlds.layout_index import BodyState
from slap_ros.worlds.panda import FINGER_CLOSED, FINGER_OPEN
from slap_ros.worlds.shared_simulations import BulletClient, SharedSimulations

GRAVITY = 9.81  # m/s², downwards
LIFT = (0.0, 0.0, GRAVITY * MASS)  # N, cancels the hand's weight
PALM_FRICTION = 0.9  # 1
FINGER_SPINNING = 0.005  # m, of pads that give way: a rod touches them in more than one point
ROLLING = 5e-4  # m, of what things lie on; without it, PyBullet's cylinders roll ever faster
COUPLING_N = 50.0  # with which the fingers are kept at the same distance from the middle
COUPLING_SHARE = 0.1  # of their difference, made up for in a substep
ITERATIONS = 50  # of the contact solver
FASTEST = 2.0  # m/s, of any point of a jointed body, about: jammed, it would be flung
# In each substep, a motor may give the impulse of a whole period; its force is made up for that.
MOTOR_SUBSTEPS = SUBSTEPS
FINGERS = (LEFT, RIGHT)
BASE = -1  # PyBullet's number of a body's first link
AWAKE = pybullet.ACTIVATION_STATE_DISABLE_SLEEPING | pybullet.ACTIVATION_STATE_WAKE_UP
ASLEEP = pybullet.ACTIVATION_STATE_ENABLE_SLEEPING | pybullet.ACTIVATION_STATE_SLEEP


@dataclass(frozen=True)
class Outcome:
    """How what was computed is after a control period."""

    hand: HandState
    bodies: Mapping[int, BodyState]  # by index among the free bodies
    openings: Mapping[int, Opening]  # by index among the jointed bodies
    contacts: tuple[ContactPoint, ...]


def _parking(index: int) -> Vector:
    """A place of its own for each body, far away from everything, in m."""
    return (100.0 + 5.0 * index, 100.0, 1.0)


class ContactSimulation(BulletClient):
    """A PyBullet client with the hand and the bodies of a scene.

    It remembers nothing that matters between calls but where the fixed bodies stand, and which
    of the others sleep.
    """

    def __init__(self, scene: ContactScene) -> None:
        super().__init__()
        self.scene = scene
        pybullet.resetSimulation(pybullet.RESET_USE_SIMPLE_BROADPHASE, self.client)
        pybullet.setGravity(0.0, 0.0, -GRAVITY, self.client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=CONTROL_PERIOD_S,
            numSubSteps=SUBSTEPS,  # before any force: PyBullet makes impulses of them at once
            numSolverIterations=ITERATIONS,
            deterministicOverlappingPairs=1,
            useSplitImpulse=0,  # with it, a joint far beyond its end is not brought back
            physicsClientId=self.client,
        )
        self._parked = 0
        self._places: dict[int, Vector] = {}
        self._sides: dict[tuple[int, int], Surface] = {}
        self._placement = Placement((), ())
        self._hand = self._add_hand()
        self._pull = self._add_pull()
        self._fixed = [self._add_fixed(i, body) for i, body in enumerate(scene.fixed)]
        self._free = [self._add_free(i, body) for i, body in enumerate(scene.free)]
        self._jointed = [self._add_jointed(i, body) for i, body in enumerate(scene.jointed)]
        self._awake = set(range(len(self._free) + len(self._jointed)))  # by number, as involved

    def place(self, placement: Placement) -> None:
        """Let the bodies that do not move stand there."""
        if placement == self._placement:
            return
        self._placement = placement
        for body, pose in zip(self._fixed, placement.fixed, strict=True):
            if body is not None:
                pybullet.resetBasePositionAndOrientation(body, *pose, self.client)

    def run(self, now: ContactSnapshot, pull: Pose, involved: Involved) -> Outcome:
        """The outcome of one control period.

        Args:
            now: Present snapshot.
            pull: Pose that the hand is pulled to.
            involved: Bodies that are simulated; all others are left out.
        """
        self._prime_and_wake(now, set(involved.bodies))
        free = [i for i in involved.bodies if i < len(self._free)]
        jointed = [i - len(self._free) for i in involved.bodies[len(free) :]]
        if involved.hand:
            self._set_hand(now.hand, pull)
        for i in free:
            body, motion = self._free[i], now.bodies[i]
            pybullet.resetBasePositionAndOrientation(body, *motion.pose, self.client)
            pybullet.resetBaseVelocity(body, motion.velocity, motion.angular_velocity, self.client)
        for i in jointed:
            body, pose, opening = self._jointed[i], self._placement.jointed[i], now.openings[i]
            pybullet.resetBasePositionAndOrientation(body, *pose, self.client)
            pybullet.resetJointState(body, MOVING, *opening, self.client)
        pybullet.stepSimulation(self.client)
        return Outcome(
            self._hand_state(now.hand) if involved.hand else now.hand,
            {i: self._motion(self._free[i]) for i in free},
            {i: self._opening(i) for i in jointed},
            tuple(self._contact_points()),
        )

    def _prime_and_wake(self, now: ContactSnapshot, bodies: set[int]) -> None:
        """Prime, and have only these awake then: what is left out costs less while it sleeps.

        All that was awake or will be goes through the prime awake, since the bounds of a sleeping
        body stay where they were, and others would still meet them there.
        """
        self._set_activation(bodies - self._awake, AWAKE)
        self._prime(now)
        self._set_activation(self._awake - bodies, ASLEEP)
        self._awake = bodies

    def _set_activation(self, bodies: set[int], state: int) -> None:
        moving = (*self._free, *self._jointed)
        for i in bodies:
            pybullet.changeDynamics(
                moving[i], BASE, activationState=state, physicsClientId=self.client
            )

    def _prime(self, now: ContactSnapshot) -> None:
        """Forget: park everything apart for a moment, oriented as it will be.

        Contacts and their impulses go with the pairs, and what setting a pose leaves as it was
        (the inertia in world axes) becomes a function of the orientation.
        """
        client = self.client
        self._park_hand(now.hand)
        for body, opening in zip(self._jointed, now.openings, strict=True):
            self._park(body, NO_ROTATION)
            pybullet.resetJointState(body, MOVING, opening.position, 0.0, client)
        for body, motion in zip(self._free, now.bodies, strict=True):
            self._park(body, motion.pose.quaternion)
            pybullet.resetBaseVelocity(body, ORIGIN, ORIGIN, client)
        # All at once; forces that are set while there are no substeps would be many times as large.
        pybullet.setPhysicsEngineParameter(numSubSteps=0, physicsClientId=client)
        pybullet.stepSimulation(client)
        pybullet.setPhysicsEngineParameter(numSubSteps=SUBSTEPS, physicsClientId=client)

    def _park(self, body: int, quaternion: tuple[float, float, float, float]) -> None:
        pybullet.resetBasePositionAndOrientation(body, self._places[body], quaternion, self.client)

    # -- the hand -------------------------------------------------------------------------------

    def _park_hand(self, hand: HandState) -> None:
        client = self.client
        self._park(self._hand, hand.pose.quaternion)
        pybullet.resetBaseVelocity(self._hand, ORIGIN, ORIGIN, client)
        pybullet.changeConstraint(
            self._pull,
            self._places[self._hand],
            hand.pose.quaternion,
            maxForce=0.0,
            physicsClientId=client,
        )
        for finger, position in zip(FINGERS, hand.fingers, strict=True):
            pybullet.resetJointState(self._hand, finger, position, 0.0, client)

    def _set_hand(self, hand: HandState, pull: Pose) -> None:
        client, model = self.client, self.scene.hand
        pybullet.resetBasePositionAndOrientation(self._hand, *hand.pose, client)
        pybullet.resetBaseVelocity(self._hand, hand.velocity, hand.angular_velocity, client)
        pybullet.changeConstraint(self._pull, *pull, maxForce=model.pull_n, physicsClientId=client)
        # It lasts through all substeps.
        pybullet.applyExternalForce(
            self._hand, BASE, LIFT, hand.pose.position, pybullet.WORLD_FRAME, client
        )
        wanted = FINGER_CLOSED if hand.closing else FINGER_OPEN
        for finger, position, velocity in zip(
            FINGERS, hand.fingers, hand.finger_velocities, strict=True
        ):
            pybullet.resetJointState(self._hand, finger, position, velocity, client)
            pybullet.setJointMotorControl2(
                self._hand,
                finger,
                pybullet.POSITION_CONTROL,
                targetPosition=wanted,
                force=model.grip_n / MOTOR_SUBSTEPS,
                positionGain=FINGER_SHARE,
                velocityGain=1.0,
                maxVelocity=model.finger_speed,
                physicsClientId=client,
            )

    def _hand_state(self, before: HandState) -> HandState:
        pose, velocity, angular_velocity = self._motion(self._hand)
        left, right = pybullet.getJointStates(self._hand, FINGERS, self.client)
        left_at, left_velocity = stopped_at_ends(left[0], left[1], FINGER_OPEN)
        right_at, right_velocity = stopped_at_ends(right[0], right[1], FINGER_OPEN)
        return HandState(
            pose,
            velocity,
            angular_velocity,
            before.target,
            before.target_yaw,
            (left_at, right_at),
            (left_velocity, right_velocity),
            before.closing,
        )

    def _add_hand(self) -> int:
        hand = self._load(hand_urdf(), fixed=False)
        self._places[hand] = self._next_parking()
        for link, side in ((BASE, Side.PALM), (LEFT, Side.LEFT_FINGER), (RIGHT, Side.RIGHT_FINGER)):
            friction = PALM_FRICTION if side is Side.PALM else self.scene.hand.friction
            self._touchable(hand, link, Surface(side), friction)
            pybullet.changeDynamics(hand, link, jointDamping=0.0, physicsClientId=self.client)
        coupling = pybullet.createConstraint(
            hand,
            LEFT,
            hand,
            RIGHT,
            pybullet.JOINT_GEAR,
            (0.0, 1.0, 0.0),
            ORIGIN,
            ORIGIN,
            physicsClientId=self.client,
        )
        pybullet.changeConstraint(
            coupling,
            gearRatio=-1.0,
            erp=COUPLING_SHARE,
            maxForce=COUPLING_N,
            physicsClientId=self.client,
        )
        return hand

    def _add_pull(self) -> int:
        """What pulls the hand: a constraint to a pose in the world, of limited force."""
        pull: int = pybullet.createConstraint(
            self._hand,
            BASE,
            -1,
            -1,
            pybullet.JOINT_FIXED,
            ORIGIN,
            ORIGIN,
            self._places[self._hand],
            physicsClientId=self.client,
        )
        pybullet.changeConstraint(pull, erp=self.scene.hand.share, physicsClientId=self.client)
        return pull

    # -- bodies ---------------------------------------------------------------------------------

    def _motion(self, body: int) -> BodyState:
        pose = pybullet.getBasePositionAndOrientation(body, self.client)
        velocity, angular_velocity = pybullet.getBaseVelocity(body, self.client)
        return BodyState(Pose(*pose), velocity, angular_velocity)

    def _opening(self, index: int) -> Opening:
        position, velocity, *_ = pybullet.getJointState(self._jointed[index], MOVING, self.client)
        return Opening(*stopped_at_ends(position, velocity, self.scene.jointed[index].joint.high))

    def _contact_points(self) -> Iterable[ContactPoint]:
        for point in pybullet.getContactPoints(physicsClientId=self.client):
            _, first, second, link, other, _, position, normal, distance, force, *_ = point
            yield ContactPoint(
                self._sides[first, link],
                self._sides[second, other],
                position,
                normal,
                distance,
                force * SUBSTEPS,  # PyBullet spreads an impulse over the period
            )

    def _add_fixed(self, index: int, body: Compound) -> int | None:
        if not body.solid:
            return None
        return self._add_rigid(body, Surface(Side.FIXED, index))

    def _add_free(self, index: int, body: Compound) -> int:
        added = self._add_rigid(body, Surface(Side.FREE, index))
        # Inertia and mass in one call: alone, the inertia makes the body massless.
        pybullet.changeDynamics(
            added,
            BASE,
            mass=body.mass_kg,
            localInertiaDiagonal=body.inertia,
            physicsClientId=self.client,
        )
        if all(isinstance(part, CylinderPart) for part in body.parts):
            pybullet.changeDynamics(
                added, BASE, rollingFriction=ROLLING, physicsClientId=self.client
            )
        return added

    def _add_rigid(self, body: Compound, surface: Surface) -> int:
        place = self._next_parking()
        added: int = pybullet.createMultiBody(
            body.mass_kg,
            self._shape(body.parts),
            -1,
            place,
            useMaximalCoordinates=True,
            physicsClientId=self.client,
        )
        self._places[added] = place
        self._touchable(added, BASE, surface, body.friction)
        return added

    def _add_jointed(self, index: int, body: JointedBody) -> int:
        added = self._load(jointed_urdf(body), fixed=True)
        self._places[added] = self._next_parking()
        self._touchable(added, BASE, Surface(Side.FRAME, index), body.friction)
        self._touchable(added, MOVING, Surface(Side.MOVING, index), body.friction)
        pybullet.changeDynamics(
            added,
            BASE,
            maxJointVelocity=FASTEST / body.lever_m,
            physicsClientId=self.client,
        )
        pybullet.setJointMotorControl2(
            added,
            MOVING,
            pybullet.VELOCITY_CONTROL,
            targetVelocity=0.0,
            force=body.joint.dry_friction / MOTOR_SUBSTEPS,
            physicsClientId=self.client,
        )
        return added

    def _touchable(self, body: int, link: int, surface: Surface, friction: float) -> None:
        self._sides[body, link] = surface
        # One call each: of a call with several properties, a link takes the friction as its base's.
        change = partial(pybullet.changeDynamics, body, link, physicsClientId=self.client)
        change(activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING)
        if surface.side is not Side.FREE:
            change(linearDamping=0.0, angularDamping=0.0)
        change(lateralFriction=friction)
        if surface.side in (Side.LEFT_FINGER, Side.RIGHT_FINGER):
            change(spinningFriction=FINGER_SPINNING)

    def _load(self, text: str, fixed: bool) -> int:
        """A body from URDF, which PyBullet reads from files only."""
        with TemporaryDirectory() as folder:
            file = Path(folder) / "body.urdf"
            file.write_text(text, encoding="utf-8")
            body: int = pybullet.loadURDF(
                str(file),
                useFixedBase=fixed,
                flags=pybullet.URDF_USE_IMPLICIT_CYLINDER | pybullet.URDF_USE_INERTIA_FROM_FILE,
                physicsClientId=self.client,
            )
        return body

    def _shape(self, parts: Sequence[Part]) -> int:
        if len(parts) == 1 and parts[0].pose == Pose():
            shape: int = pybullet.createCollisionShape(
                physicsClientId=self.client, **_geometry(parts[0])
            )
            return shape
        sizes = [_geometry(part) for part in parts]
        compound: int = pybullet.createCollisionShapeArray(
            shapeTypes=[size["shapeType"] for size in sizes],
            halfExtents=[size.get("halfExtents", ORIGIN) for size in sizes],
            radii=[size.get("radius", 0.0) for size in sizes],
            lengths=[size.get("height", 0.0) for size in sizes],
            collisionFramePositions=[part.pose.position for part in parts],
            collisionFrameOrientations=[part.pose.quaternion for part in parts],
            physicsClientId=self.client,
        )
        return compound

    def _next_parking(self) -> Vector:
        self._parked += 1
        return _parking(self._parked)


SIMULATIONS: SharedSimulations[ContactScene, ContactSimulation] = SharedSimulations(
    ContactSimulation
)


def _geometry(part: Part) -> dict[str, Any]:
    if isinstance(part, CylinderPart):
        return {
            "shapeType": pybullet.GEOM_CYLINDER,
            "radius": part.radius_m,
            "height": part.length_m,
        }
    assert isinstance(part, BoxPart)
    return {"shapeType": pybullet.GEOM_BOX, "halfExtents": part.half_extents_m}
