# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The arm and its way by compiled code: what ``arm.py`` computes, to the bit, and times faster."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, lru_cache

import numpy as np

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import IDENTITY, Pose
from slap_ros.relational.state import Array
from slap_ros.worlds.joint_space import kernels
from slap_ros.worlds.joint_space.arm import (
    HELD_DEPTH,
    Obstacle,
    Penetration,
    Surroundings,
    carrier,
)
from slap_ros.worlds.joint_space.drive import Drive
from slap_ros.worlds.joint_space.links import LINK_SHAPES
from slap_ros.worlds.joint_space.scene import Body
from slap_ros.worlds.layout_index import pose_of


class CompiledArm:
    """See :class:`slap_ros.worlds.joint_space.arm.Arm`."""

    def __init__(
        self,
        joints: Sequence[float],
        finger: float,
        held: Body | None = None,
        grasp: Pose = IDENTITY,
    ) -> None:
        """See :meth:`slap_ros.worlds.joint_space.arm.Arm.at`."""
        self.boxes = _link_boxes(held)
        grasp_row = np.array((*grasp.position, *grasp.quaternion))
        self.rows = kernels.place(np.array(joints), finger, grasp_row, self.boxes)

    @cached_property
    def links(self) -> tuple[Pose, ...]:
        """See :class:`slap_ros.worlds.joint_space.arm.Arm`."""
        return tuple(pose_of(row) for row in self.rows.tolist())

    @property
    def held_pose(self) -> Pose:
        """See :attr:`slap_ros.worlds.joint_space.arm.Arm.held_pose`."""
        return pose_of(self.rows[kernels.HELD].tolist())

    def to(self, end: CompiledArm) -> CompiledSweep:
        """See :meth:`slap_ros.worlds.joint_space.arm.Arm.to`."""
        return CompiledSweep(self, end)


class CompiledSweep:
    """See :class:`slap_ros.worlds.joint_space.arm.Sweep`."""

    def __init__(self, start: CompiledArm, end: CompiledArm) -> None:
        self.start, self.end = start, end

    def stays_clear(self, boxes: Surroundings[OrientedBox]) -> bool:
        """See :meth:`slap_ros.worlds.joint_space.arm.Sweep.stays_clear`."""
        return kernels.stays_clear(self.start.rows, self.end.rows, self.end.boxes, _rows(boxes))

    def hits(self, obstacles: Surroundings[Obstacle]) -> bool:
        """See :meth:`slap_ros.worlds.joint_space.arm.Sweep.hits`."""
        rows = _obstacle_rows(obstacles)
        return kernels.hits(self.start.rows, self.end.rows, self.end.boxes, rows)

    def deepest_penetration(
        self, obstacles: Surroundings[Obstacle], held_depth: float = HELD_DEPTH
    ) -> Penetration | None:
        """See :meth:`slap_ros.worlds.joint_space.arm.Sweep.deepest_penetration`."""
        link, point, depth = kernels.deepest(
            self.start.rows, self.end.rows, self.end.boxes, _obstacle_rows(obstacles), held_depth
        )
        return None if link < 0 else Penetration(carrier(link), point, depth)

    def drives(self) -> list[Drive]:
        """See :meth:`slap_ros.worlds.joint_space.arm.Sweep.drives`."""
        velocities = kernels.velocities(self.start.rows, self.end.rows).tolist()
        return [
            Drive(start, (vx, vy, vz), (wx, wy, wz))
            for start, (vx, vy, vz, wx, wy, wz) in zip(self.start.links, velocities, strict=True)
        ]


@lru_cache(maxsize=256)
def _link_boxes(held: Body | None) -> kernels.LinkBoxes:
    boxes = [shape.at(IDENTITY) for shape in LINK_SHAPES]
    if held is not None:
        boxes.append(held.at(IDENTITY))
    return kernels.LinkBoxes(*_columns(boxes))


def _columns(boxes: Sequence[OrientedBox]) -> tuple[Array, Array, Array]:
    poses = [(*box.pose.position, *box.pose.quaternion) for box in boxes]
    halves = [box.half for box in boxes]
    return (
        np.array(poses).reshape(-1, 7),
        np.array(halves).reshape(-1, 3),
        np.array([box.radius for box in boxes]),
    )


@lru_cache(maxsize=16)
def _rows(boxes: Surroundings[OrientedBox]) -> kernels.BoxRows:
    return kernels.BoxRows(*_columns(boxes), np.zeros(len(boxes)))


@lru_cache(maxsize=16)
def _obstacle_rows(obstacles: Surroundings[Obstacle]) -> kernels.BoxRows:
    columns = _columns([obstacle.box for obstacle in obstacles])
    return kernels.BoxRows(*columns, np.array([obstacle.top for obstacle in obstacles]))
