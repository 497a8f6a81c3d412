# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where a camera is, and how it looks."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.geometry.pose import Vector


@dataclass(frozen=True)
class Viewpoint:
    """Where a camera is, and how it looks; by default from the front right, above the arm."""

    eye: Vector = (1.45, -1.1, 0.85)  # m
    target: Vector = (0.3, 0.0, 0.22)  # m
    field_of_view: float = 42.0  # degrees, upright
    width: int = 480  # pixels
    height: int = 360
