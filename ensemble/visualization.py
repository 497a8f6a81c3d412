# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What RViz and Foxglove show: bodies as markers and frames, the arm as joint states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import Point, Pose, Quaternion, Transform, TransformStamped, Vector3
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import ColorRGBA
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from ensemble import encode
from ensemble.interfaces import JOINT_STATES, MARKERS, TF
from slap_ros.core import Domain, VisibleBody
from slap_ros.geometry import pose as geometry
from slap_ros.messages.interfaces import BODIES
from slap_ros.relational import State

UNSCALED = (1.0, 1.0, 1.0)
ROBOT = "robot"  # the namespace of markers that show the arm
JOINT_PREFIX = "panda_"  # of joint names in the robot description


class Visualizer:
    """Publishes each state for people to look at."""

    def __init__(self, node: Node, domain: Domain) -> None:
        """Publish as ``node``."""
        self._domain = domain
        self._markers = node.create_publisher(MARKERS.type, MARKERS.name, MARKERS.qos)
        self._frames = node.create_publisher(TF.type, TF.name, TF.qos)
        self._joints = node.create_publisher(JOINT_STATES.type, JOINT_STATES.name, JOINT_STATES.qos)

    def show(self, state: State, stamp: Time) -> None:
        """Publish a state."""
        display = self._domain.display
        bodies = display.bodies(state)
        shown = markers(bodies, stamp)
        shown.markers.extend(markers(display.arm(state), stamp, ROBOT).markers)
        self._markers.publish(shown)
        poses = body_poses(bodies) if display.frames is None else display.frames(state)
        self._frames.publish(frames(poses, stamp))
        joints = joint_state(state, stamp)
        if joints.name:
            self._joints.publish(joints)


def markers(bodies: Sequence[VisibleBody], stamp: Time, namespace: str = BODIES) -> MarkerArray:
    """Bodies as markers: boxes, or triangles where a body has a mesh.

    Args:
        bodies: What is shown, in the world frame.
        stamp: When they are there.
        namespace: Of the markers.

    Returns:
        A marker per body, numbered from 0 on.
    """
    return MarkerArray(
        markers=[
            Marker(
                header=encode.header(stamp),
                ns=namespace,
                id=number,
                type=Marker.TRIANGLE_LIST if body.triangles else Marker.CUBE,
                action=Marker.ADD,
                pose=Pose(
                    position=Point(**_xyz(body.position)), orientation=_turn(body.quaternion)
                ),
                scale=Vector3(**_xyz(UNSCALED if body.triangles else body.size)),
                points=[Point(**_xyz(corner)) for corner in body.triangles],
                color=ColorRGBA(**dict(zip("rgba", body.colour, strict=True))),
                lifetime=Duration(),
                text=body.name,
            )
            for number, body in enumerate(bodies)
        ]
    )


def body_poses(bodies: Sequence[VisibleBody]) -> Mapping[str, geometry.Pose]:
    """Where bodies are, by name, for a domain that names no frames."""
    return {body.name: geometry.Pose(body.position, body.quaternion) for body in bodies}


def frames(poses: Mapping[str, geometry.Pose], stamp: Time) -> TFMessage:
    """Poses in the world's frame as transforms to frames of these names."""
    return TFMessage(
        transforms=[
            TransformStamped(
                header=encode.header(stamp),
                child_frame_id=name,
                transform=Transform(
                    translation=Vector3(**_xyz(pose.position)), rotation=_turn(pose.quaternion)
                ),
            )
            for name, pose in poses.items()
        ]
    )


def joint_state(state: State, stamp: Time) -> JointState:
    """The angles of an arm's joints, rad; no names for a robot without joints."""
    joints = [
        (feature.name, float(state.get(obj, feature.name)))
        for obj in state.objects
        for feature in obj.type.features
        if feature.name.startswith("joint") and feature.unit == "rad"
    ]
    return JointState(
        header=encode.header(stamp),
        name=[f"{JOINT_PREFIX}{name}" for name, _ in joints],
        position=[angle for _, angle in joints],
    )


def _xyz(values: Sequence[float]) -> dict[str, float]:
    return dict(zip("xyz", map(float, values), strict=True))


def _turn(quaternion: Sequence[float]) -> Quaternion:
    return Quaternion(**dict(zip("xyzw", map(float, quaternion), strict=True)))
