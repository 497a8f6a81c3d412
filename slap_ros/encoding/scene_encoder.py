# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What RViz and Foxglove show, as messages: bodies as markers and frames, the arm as joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from slap_ros.core import Display, VisibleBody
from slap_ros.encoding.message_encoder import MessageEncoder
from slap_ros.geometry import pose as geometry
from slap_ros.messages.interfaces import BODIES, CUBE, MARKERS, ROBOT, TRIANGLE_LIST
from slap_ros.relational import State

UNSCALED = (1.0, 1.0, 1.0)
JOINT_PREFIX = "panda_"  # of joint names in the robot description


class ShownState(NamedTuple):
    """A state as it is shown, in messages."""

    markers: Any
    frames: Any  # transforms
    joints: Any  # without names for a robot that has none


@dataclass(frozen=True)
class SceneEncoder:
    """Makes messages of what is visible.

    Args:
        encoder: Encoder that makes the messages' headers, and all of their parts.
    """

    encoder: MessageEncoder

    def shown(self, display: Display, state: State, stamp: Any) -> ShownState:
        """All that is shown of a state.

        Args:
            display: Display of the domain.
            state: State that is shown.
            stamp: Time of the state.
        """
        bodies = display.bodies(state)
        markers = self.markers(bodies, stamp)
        markers.markers.extend(self.markers(display.arm(state), stamp, ROBOT).markers)
        poses = body_poses(bodies) if display.frames is None else display.frames(state)
        return ShownState(markers, self.frames(poses, stamp), self.joint_state(state, stamp))

    def markers(self, bodies: Sequence[VisibleBody], stamp: Any, namespace: str = BODIES) -> Any:
        """Bodies as markers: boxes, or triangles where a body has a mesh.

        Args:
            bodies: Bodies that are shown, in the world frame.
            stamp: Time at which the bodies are there.
            namespace: Namespace of the markers.

        Returns:
            A marker per body, numbered from 0 on.
        """
        markers = [self._marker(n, body, stamp, namespace) for n, body in enumerate(bodies)]
        return self._make(MARKERS, markers=markers)

    def _marker(self, number: int, body: VisibleBody, stamp: Any, namespace: str) -> Any:
        colour = dict(zip("rgba", map(float, body.colour), strict=True))
        return self._make(
            "visualization_msgs/msg/Marker",
            header=self.encoder.header(stamp),
            ns=namespace,
            id=number,
            type=TRIANGLE_LIST if body.triangles else CUBE,
            pose=self._make(
                "geometry_msgs/msg/Pose",
                position=self._xyz("Point", body.position),
                orientation=self._turn(body.quaternion),
            ),
            scale=self._xyz("Vector3", UNSCALED if body.triangles else body.size),
            points=[self._xyz("Point", corner) for corner in body.triangles],
            color=self._make("std_msgs/msg/ColorRGBA", **colour),
            text=body.name,
        )

    def frames(self, poses: Mapping[str, geometry.Pose], stamp: Any) -> Any:
        """Poses in the world's frame as transforms to frames of these names."""
        transforms = [
            self._make(
                "geometry_msgs/msg/TransformStamped",
                header=self.encoder.header(stamp),
                child_frame_id=name,
                transform=self._make(
                    "geometry_msgs/msg/Transform",
                    translation=self._xyz("Vector3", pose.position),
                    rotation=self._turn(pose.quaternion),
                ),
            )
            for name, pose in poses.items()
        ]
        return self._make("tf2_msgs/msg/TFMessage", transforms=transforms)

    def joint_state(self, state: State, stamp: Any) -> Any:
        """The angles of an arm's joints, rad; no names for a robot without joints."""
        joints = [
            (feature.name, float(state.get(obj, feature.name)))
            for obj in state.objects
            for feature in obj.type.features
            if feature.name.startswith("joint") and feature.unit == "rad"
        ]
        return self._make(
            "sensor_msgs/msg/JointState",
            header=self.encoder.header(stamp),
            name=[f"{JOINT_PREFIX}{name}" for name, _ in joints],
            position=[angle for _, angle in joints],
        )

    def _make(self, type_name: str, **fields: Any) -> Any:
        return self.encoder.make(type_name, **fields)

    def _xyz(self, kind: str, values: Sequence[float]) -> Any:
        named = dict(zip("xyz", map(float, values), strict=True))
        return self._make(f"geometry_msgs/msg/{kind}", **named)

    def _turn(self, quaternion: Sequence[float]) -> Any:
        named = dict(zip("xyzw", map(float, quaternion), strict=True))
        return self._make("geometry_msgs/msg/Quaternion", **named)


def body_poses(bodies: Sequence[VisibleBody]) -> Mapping[str, geometry.Pose]:
    """Where bodies are, by name, for a domain that names no frames."""
    return {body.name: geometry.Pose(body.position, body.quaternion) for body in bodies}
