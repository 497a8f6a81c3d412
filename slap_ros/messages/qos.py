# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The quality of service that the ensemble's publishers offer, and that bags say they offered.

One table for both: what ``ros2 bag play`` publishes reaches whoever listens to the nodes.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class OfferedQos:
    """Reliable and keep-last, as every publisher of the ensemble is."""

    depth: int  # messages
    transient_local: bool  # kept for those who come late; otherwise volatile


# The newest one only, also for those who come late.
LATCHED = OfferedQos(1, transient_local=True)
# An episode's worth, also for those who come late: a recorder or planner that starts after the
# simulator, or starts again, misses nothing.
EPISODE = OfferedQos(1000, transient_local=True)
# From now on: for whoever must not act on the past.
VOLATILE = OfferedQos(1000, transient_local=False)
FRAMES = OfferedQos(100, transient_local=False)
STATIC_FRAMES = OfferedQos(100, transient_local=True)
PICTURES = OfferedQos(1, transient_local=False)  # large: none waits for who is slow
ROS_DEFAULT = OfferedQos(10, transient_local=False)

# By name, without a namespace.
OFFERED = {
    "slap/domain": LATCHED,
    "slap/task": LATCHED,
    "slap/state": EPISODE,
    "slap/atoms": EPISODE,
    "slap/command": EPISODE,
    "slap/fault": LATCHED,
    "slap/plan": LATCHED,
    "slap/plan_events": EPISODE,
    "slap/skill_events": EPISODE,
    "slap/acquisition_events": EPISODE,
    "slap/skills": LATCHED,
    "slap/markers": EPISODE,
    "joint_states": EPISODE,
    "diagnostics": VOLATILE,
    "tf": FRAMES,
    "tf_static": STATIC_FRAMES,
}


def offered_qos(topic: str) -> OfferedQos:
    """What publishers of a topic offer.

    Args:
        topic: Full name of the topic: ``/slap/state``, or ``/robot1/slap/state`` in a namespace.

    Returns:
        ROS 2's default for topics that are not the ensemble's.
    """
    for name, qos in OFFERED.items():
        if topic.endswith(f"/{name}"):
            return qos
    return ROS_DEFAULT
