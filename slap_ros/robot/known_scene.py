# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The objects around a robot that are known, and the domain's own model of them."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError
from slap_ros.relational import AtomSpace, Object, State
from slap_ros.robot.state_assembly import StateAssembler
from slap_ros.worlds.joint_space.features import ROBOT
from slap_ros.worlds.joint_space.world import PandaWorld


@dataclass(frozen=True)
class KnownScene:
    """A scene, or what is known of it.

    Args:
        model: Where commands are tried, and states checked.
        robot: The arm.
        bodies: What can move, in the order of the model's free bodies.
        assembler: Makes states of measurements.
        space: Ground atoms of the known objects.
    """

    model: PandaWorld
    robot: Object
    bodies: tuple[Object, ...]
    assembler: StateAssembler
    space: AtomSpace

    @classmethod
    def of(cls, domain: Domain, template: State) -> KnownScene:
        """The scene of a state's objects.

        Args:
            domain: Domain with a Panda.
            template: State of the objects; poses of those that are detected have no meaning.

        Raises:
            InvalidParameterError: The domain has another robot.
        """
        (robot,) = template.layout.of_type(ROBOT)
        model = domain.make_world(template)
        if not isinstance(model, PandaWorld):
            raise InvalidParameterError(f"the world of {domain.name} has no Panda")
        bodies = tuple(template.layout.object(body.name) for body in model.scene.free)
        assembler = StateAssembler(template, model.scene)
        return cls(model, robot, bodies, assembler, domain.atom_space(template))
