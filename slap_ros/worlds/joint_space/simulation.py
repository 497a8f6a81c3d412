# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One control period of rigid-body dynamics in PyBullet, as a pure function.

What comes out depends on what goes in, to the bit: not on earlier calls, not on the process.
That takes bodies in maximal coordinates, the simple broadphase, and a *prime* before every period
(``docs/physics.md``). Substeps are a power of two, so that the clock that PyBullet keeps, and does
not tell, has no remainder to carry over.

The arm is made of *driven* links: bodies too heavy to be stopped, that move with the velocity
that carries them from where they are to where they shall be, and push as a real arm does. Moved
without velocity, an arm only penetrates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from slap_ros.geometry.pose import NO_ROTATION, ORIGIN, Pose, Vector
from slap_ros.meshes.obj import to_obj
from slap_ros.meshes.solid import Solid, cuboid
from slap_ros.worlds.bodies import Material
from slap_ros.worlds.bullet import PANDA, pybullet
from slap_ros.worlds.joint_space.drive import Drive
from slap_ros.worlds.joint_space.links import LINK_SHAPES
from slap_ros.worlds.joint_space.scene import REFERENCE_FRICTION, Body, Scene, Shape
from slap_ros.worlds.layout_index import BodyState
from slap_ros.worlds.panda import CONTROL_PERIOD_S
from slap_ros.worlds.shared_simulations import BulletClient, SharedSimulations

GRAVITY = 9.81  # m/s², downwards
DRIVEN_MASS = 1e4  # kg, against which nothing else weighs
DRIVEN_INERTIA = (1e4, 1e4, 1e4)  # kg m², alike about all axes: it does not precess
LIFT = (0.0, 0.0, GRAVITY * DRIVEN_MASS)  # N, cancels a driven body's weight
ARM_FRICTION = 0.9  # 1
FINGER_FRICTION = 1.0  # 1
FREE, FIXED, ARM = 1, 2, 4  # collision groups: the arm meets free bodies only
DISTANCE = 8  # index of the distance in a contact that PyBullet reports, m
MESHES = PANDA / "meshes" / "collision"


@dataclass(frozen=True)
class Stepping:
    """How finely a control period is computed."""

    substeps: int = 32  # a power of two: 1/256 s each, and exact
    iterations: int = 20  # of the contact solver


def _parking(index: int) -> Vector:
    """A place of its own for each body, far away from everything, in m."""
    return (20.0 + 3.0 * index, 20.0, 1.0)


def _solid(shape: Shape) -> Solid:
    return shape if isinstance(shape, Solid) else Solid.of([cuboid(shape)])


class Simulation(BulletClient):
    """A PyBullet client with the bodies of a scene.

    It keeps nothing that matters between calls but where the fixed bodies are and what the
    free ones are made of.
    """

    def __init__(self, scene: Scene, stepping: Stepping) -> None:
        super().__init__()
        self.scene = scene
        self.stepping = stepping
        self._fixed_poses: tuple[Pose, ...] = ()
        # Pieces rest on their faces only where both know them; else one point at a time is found
        # in which they touch, and they rock on it. Boxes among themselves need no help.
        self._faceted = any(isinstance(body.shape, Solid) for body in scene.bodies)
        pybullet.resetSimulation(pybullet.RESET_USE_SIMPLE_BROADPHASE, self.client)
        pybullet.setGravity(0.0, 0.0, -GRAVITY, self.client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=CONTROL_PERIOD_S,
            numSolverIterations=stepping.iterations,
            deterministicOverlappingPairs=1,
            collisionFilterMode=0,  # both bodies must want a contact, not either
            enableSAT=int(self._faceted),
            physicsClientId=self.client,
        )
        self._parked = 0
        self._fixed = [self._add_fixed(body) for body in scene.fixed]
        self._free = [self._add_free(body) for body in scene.free]
        self._materials: tuple[Material | None, ...] = (None,) * len(self._free)
        self.set_materials(tuple(body.material for body in scene.free))
        self._links = [self._add_link(i) for i in range(len(LINK_SHAPES))]
        # A held body is one more link. Bodies of one shape share it, as one is held at a time.
        shapes = dict.fromkeys(body.shape for body in scene.free)
        self._held_proxies = {
            shape: self._add_driven(self._shape(shape), REFERENCE_FRICTION) for shape in shapes
        }
        self._held_proxy_frictions = dict.fromkeys(shapes, REFERENCE_FRICTION)
        self._driven = [*self._links, *self._held_proxies.values()]
        parking = [_parking(i) for i in range(len(self._free) + len(self._driven))]
        self._free_parking = list(zip(self._free, parking, strict=False))
        self._driven_parking = list(zip(self._driven, parking[len(self._free) :], strict=True))

    def place_fixed(self, poses: tuple[Pose, ...]) -> None:
        """Put the scene's fixed bodies there."""
        if poses == self._fixed_poses:
            return
        self._fixed_poses = poses
        for body, pose in zip(self._fixed, poses, strict=True):
            if body is not None:
                pybullet.resetBasePositionAndOrientation(body, *pose, self.client)

    def set_materials(self, materials: tuple[Material, ...]) -> None:
        """Give the scene's free bodies these masses and frictions.

        It has to be told even what a body was created with: PyBullet derives a body's weight in
        other ways at its creation and later, which differ in the last bit.
        """
        if materials == self._materials:
            return
        for i, (body, material) in enumerate(zip(self._free, materials, strict=True)):
            if material != self._materials[i]:
                pybullet.changeDynamics(
                    body,
                    -1,
                    mass=material.mass_kg,
                    lateralFriction=material.friction,
                    physicsClientId=self.client,
                    **self._inertia(self.scene.free[i].shape, material.mass_kg),
                )
        self._materials = materials

    def run(
        self,
        bodies: Sequence[BodyState],
        held: int | None = None,
        drives: Sequence[Drive] = (),
    ) -> list[BodyState]:
        """Simulate one control period.

        Args:
            bodies: Poses and velocities of the scene's free bodies.
            held: Index of the free body that moves with the hand, if any; its motion is not
                computed.
            drives: Motion of each of ``LINK_SHAPES``, then of the held body; none without an arm.

        Returns:
            The free bodies afterwards; the held one as it was.
        """
        self._prime(bodies)
        client = self.client
        for i, (body, motion) in enumerate(zip(self._free, bodies, strict=True)):
            if i != held:
                pybullet.resetBasePositionAndOrientation(body, *motion.pose, client)
                pybullet.resetBaseVelocity(body, motion.velocity, motion.angular_velocity, client)
        driven = self._links if held is None else [*self._links, self._held_proxy(held)]
        for body, drive in zip(driven, drives, strict=False):
            self._drive(body, drive)
        self._advance(self.stepping.substeps)
        return [
            motion if i == held else self._motion(body)
            for i, (body, motion) in enumerate(zip(self._free, bodies, strict=True))
        ]

    def deepest(self) -> float:
        """How far bodies overlap at most at the end of the latest period, m; 0: not at all."""
        contacts = pybullet.getContactPoints(physicsClientId=self.client)
        return max((-contact[DISTANCE] for contact in contacts), default=0.0)

    def _prime(self, bodies: Sequence[BodyState]) -> None:
        """Forget: park everything apart for a moment, free bodies oriented as they will be.

        Contacts and their impulses go with the pairs, and the inertia in world axes, which
        setting a pose leaves as it was, becomes a function of the orientation.
        """
        client = self.client
        place, move = pybullet.resetBasePositionAndOrientation, pybullet.resetBaseVelocity
        for (body, parking), motion in zip(self._free_parking, bodies, strict=True):
            place(body, parking, motion.pose.quaternion, client)
            move(body, ORIGIN, ORIGIN, client)
        for body, parking in self._driven_parking:
            place(body, parking, NO_ROTATION, client)
            move(body, ORIGIN, ORIGIN, client)
        self._advance(0)

    def _advance(self, substeps: int) -> None:
        """Pass a control period in so many substeps; 0: in one step."""
        pybullet.setPhysicsEngineParameter(numSubSteps=substeps, physicsClientId=self.client)
        pybullet.stepSimulation(self.client)

    def _drive(self, body: int, drive: Drive) -> None:
        client = self.client
        pybullet.resetBasePositionAndOrientation(body, *drive.start, client)
        pybullet.resetBaseVelocity(body, drive.velocity, drive.angular_velocity, client)
        # At the centre of mass; it lasts through all substeps.
        pybullet.applyExternalForce(
            body, -1, LIFT, drive.start.position, pybullet.WORLD_FRAME, client
        )

    def _motion(self, body: int) -> BodyState:
        pose = pybullet.getBasePositionAndOrientation(body, self.client)
        velocity, angular_velocity = pybullet.getBaseVelocity(body, self.client)
        return BodyState(Pose(*pose), velocity, angular_velocity)

    def _held_proxy(self, held: int) -> int:
        """The driven body that stands for a held one, as rough as that is."""
        shape, material = self.scene.free[held].shape, self._materials[held]
        assert material is not None
        if material.friction != self._held_proxy_frictions[shape]:
            pybullet.changeDynamics(
                self._held_proxies[shape],
                -1,
                lateralFriction=material.friction,
                physicsClientId=self.client,
            )
            self._held_proxy_frictions[shape] = material.friction
        return self._held_proxies[shape]

    # -- building -------------------------------------------------------------------------------

    def _shape(self, shape: Shape) -> int:
        if self._faceted:
            return self._pieces(_solid(shape))
        box: int = pybullet.createCollisionShape(
            pybullet.GEOM_BOX, halfExtents=shape, physicsClientId=self.client
        )
        return box

    def _pieces(self, shape: Solid) -> int:
        """A compound of hulls, which PyBullet makes of a file only. It keeps what it has read."""
        with TemporaryDirectory() as folder:
            file = Path(folder) / f"{shape.digest.hex()}.obj"
            file.write_text(to_obj(shape.pieces), encoding="utf-8")
            compound: int = pybullet.createCollisionShape(
                pybullet.GEOM_MESH,
                fileName=str(file),
                flags=pybullet.URDF_INITIALIZE_SAT_FEATURES,
                physicsClientId=self.client,
            )
        return compound

    def _inertia(self, shape: Shape, mass_kg: float) -> dict[str, Vector]:
        """What PyBullet, which takes pieces for the box around them, must be told; in kg m²."""
        if not self._faceted:
            return {}
        x, y, z = _solid(shape).inertia
        return {"localInertiaDiagonal": (mass_kg * x, mass_kg * y, mass_kg * z)}

    def _add(self, shape: int, mass: float, friction: float, group: int, meets: int) -> int:
        body: int = pybullet.createMultiBody(
            mass,
            shape,
            -1,
            _parking(self._parked),
            useMaximalCoordinates=True,
            physicsClientId=self.client,
        )
        self._parked += 1
        pybullet.changeDynamics(
            body,
            -1,
            lateralFriction=friction,
            activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING,
            physicsClientId=self.client,
        )
        pybullet.setCollisionFilterGroupMask(body, -1, group, meets, self.client)
        return body

    def _add_fixed(self, body: Body) -> int | None:
        if not body.solid:
            return None
        return self._add(self._shape(body.shape), 0.0, body.friction, FIXED, FREE)

    def _add_free(self, body: Body) -> int:
        shape = self._shape(body.shape)
        return self._add(shape, body.mass_kg, body.friction, FREE, FREE | FIXED | ARM)

    def _add_link(self, index: int) -> int:
        link = LINK_SHAPES[index]
        shape: int = pybullet.createCollisionShape(
            pybullet.GEOM_MESH, fileName=str(MESHES / link.mesh), physicsClientId=self.client
        )
        friction = FINGER_FRICTION if link.mesh == "finger.obj" else ARM_FRICTION
        return self._add_driven(shape, friction)

    def _add_driven(self, shape: int, friction: float) -> int:
        body = self._add(shape, DRIVEN_MASS, friction, ARM, FREE)
        # Inertia and mass in one call: alone, the inertia makes the body massless.
        pybullet.changeDynamics(
            body,
            -1,
            mass=DRIVEN_MASS,
            localInertiaDiagonal=DRIVEN_INERTIA,
            linearDamping=0.0,
            angularDamping=0.0,
            physicsClientId=self.client,
        )
        return body


SIMULATIONS: SharedSimulations[tuple[Scene, Stepping], Simulation] = SharedSimulations(
    lambda key: Simulation(*key)
)
