# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Draws ``images/seeing.png`` from a bag: what viewers are sent, drawn without one.

slap run obstacle_tower --seed 1 --pace 1 --record BAG
python -m tools.pictures.viewers BAG
"""

from __future__ import annotations

import sys
from itertools import product
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from slap_ros.bags import read_bag
from slap_ros.geometry.rotations import Array, rotate_each
from slap_ros.messages.decode import stamp_ns
from tools.imports import ROOT

OUTPUT = ROOT / "docs" / "images" / "seeing.png"
MOMENTS = (0.0, 0.55, 1.0)  # of the run
CORNERS = np.array(list(product((-0.5, 0.5), repeat=3)))
AROUND = (0, 1, 3, 2)  # order of a face's corners
FACES = [
    np.flatnonzero(CORNERS[:, axis] == side)[list(AROUND)]
    for axis in range(3)
    for side in (-0.5, 0.5)
]
LARGE = 0.4  # m


def box(marker: Any) -> Array:
    """A marker's corners, m, shape (8, 3)."""
    size = np.array([marker.scale.x, marker.scale.y, marker.scale.z])
    at = np.array([marker.pose.position.x, marker.pose.position.y, marker.pose.position.z])
    turn = marker.pose.orientation
    quaternion = np.array([turn.x, turn.y, turn.z, turn.w])
    corners: Array = rotate_each(quaternion, CORNERS * size) + at
    return corners


def draw_scene(axes: Axes3D, markers: list[Any]) -> None:
    """Boxes as they are in a MarkerArray."""
    tables = [marker for marker in markers if marker.scale.x > LARGE]
    # What is large goes first: painters sort faces by their middles.
    for group in (tables, [marker for marker in markers if marker not in tables]):
        faces = [corners[face] for marker in group for corners in [box(marker)] for face in FACES]
        colours = [
            (marker.color.r, marker.color.g, marker.color.b) for marker in group for _ in FACES
        ]
        axes.add_collection3d(
            Poly3DCollection(faces, facecolors=colours, edgecolors="#00000030", shade=True)
        )
    axes.set(xlim=(0.0, 0.7), ylim=(-0.35, 0.35), zlim=(0.0, 0.7))
    axes.set_axis_off()
    axes.view_init(24, 40)


def main(bag: str) -> None:
    """Draw a bag."""
    by_topic: dict[str, list[tuple[float, Any]]] = {}  # messages have no types
    for topic, _, stamp, message in read_bag(bag):
        by_topic.setdefault(topic, []).append((stamp * 1e-9, message))
    scenes, joints = by_topic["/slap/markers"], by_topic["/joint_states"]
    started = stamp_ns(joints[0][1].header) * 1e-9
    figure = Figure(figsize=(10, 6.4), layout="constrained")
    grid = figure.add_gridspec(2, len(MOMENTS), height_ratios=(1.5, 1))
    for column, moment in enumerate(MOMENTS):
        number = round(moment * (len(scenes) - 1))
        axes = figure.add_subplot(grid[0, column], projection="3d", computed_zorder=False)
        draw_scene(axes, scenes[number][1].markers)
        axes.set_title(f"/slap/markers, step {number}", fontsize=9)
    traces = figure.add_subplot(grid[1, :])
    times = [stamp_ns(message.header) * 1e-9 - started for _, message in joints]
    for i, name in enumerate(joints[0][1].name):
        traces.plot(times, [message.position[i] for _, message in joints], label=name)
    for _, event in by_topic["/slap/skill_events"]:
        if event.kind == 0:
            begins = stamp_ns(event.header) * 1e-9 - started
            traces.axvline(begins, color="#adb5bd", linewidth=0.8)
            traces.annotate(
                event.skill.partition("-")[0],
                (begins, 1.02),
                fontsize=7,
                xycoords=("data", "axes fraction"),
                rotation=20,
            )
    traces.set(xlabel="time [s]", ylabel="/joint_states.position [rad]")
    traces.legend(fontsize=7, ncols=1, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.savefig(OUTPUT, dpi=110)


if __name__ == "__main__":
    main(*sys.argv[1:])
