# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A box among few, in plain floats: numpy costs more for each call than all of this together."""

from __future__ import annotations

Vector2 = tuple[float, float]


class ScalarBox:
    """A box, its heights, and what it covers; each number is computed when it is asked for."""

    __slots__ = ("_frame", "_half", "_q", "_up", "bottom", "top", "x", "y")

    def __init__(
        self,
        x: float,
        y: float,
        z: float,
        qw: float,
        qz: float,
        qx: float,
        qy: float,
        a: float,
        b: float,
        c: float,
    ) -> None:
        """Take a pose in the base's frame, and compute the heights.

        Args:
            x: X of the box's middle, m.
            y: Y of the box's middle, m.
            z: Z of the box's middle, m.
            qw: Part w of the box's quaternion.
            qz: Part z of the box's quaternion.
            qx: Part x of the box's quaternion.
            qy: Part y of the box's quaternion.
            a: Half the box's edge along its own x, m.
            b: Half the box's edge along its own y, m.
            c: Half the box's edge along its own z, m.
        """
        self.x, self.y = x, y
        self._q, self._half = (qw, qz, qx, qy), (a, b, c)
        self._up = qw * qw + qz * qz - qx * qx - qy * qy  # how high its z axis points, -1 to 1
        height = abs(2.0 * (qx * qz - qw * qy) * a) + abs(2.0 * (qy * qz + qw * qx) * b)
        height += abs(self._up * c)
        self.bottom, self.top = z - height, z + height
        self._frame: tuple[Vector2, Vector2] | None = None

    def covers(self, other: ScalarBox) -> bool:
        """Whether this box is over the other, both seen from above along the other's axes."""
        x, y = self.x - other.x, self.y - other.y
        # However they are turned, a box reaches as far as its shortest half edge, and never as far
        # as all three together.
        distance2, least = x * x + y * y, min(other._half)
        if distance2 <= least * least:
            return True
        most = sum(self._half)
        reach = most + sum(other._half)
        if distance2 > reach * reach:
            return False
        (cos, sin), (ahead, aside) = other._frame or other._find_frame()
        ahead -= abs(cos * x + sin * y)
        aside -= abs(cos * y - sin * x)
        if ahead >= 0.0 and aside >= 0.0:
            return True  # its middle is
        if ahead + most < 0.0 or aside + most < 0.0:
            return False
        more_ahead, more_aside = self._reach(cos, sin)
        return ahead + more_ahead >= 0.0 and aside + more_aside >= 0.0

    def _find_frame(self) -> tuple[Vector2, Vector2]:
        """Cosine and sine of the box's yaw (see ``footprints.inverse_yaws``), and its reach."""
        w, z, x, y = self._q
        a, b = (w, z) if self._up > 0.0 else (x, y)
        scale = 1.0 / (a * a + b * b)
        cos, sin = (a * a - b * b) * scale, 2.0 * a * b * scale
        self._frame = (cos, sin), self._reach(cos, sin)
        return self._frame

    def _reach(self, cos: float, sin: float) -> Vector2:
        """How far the box reaches from its middle, ahead and aside."""
        w, z, x, y = self._q
        a, b, c = self._half
        ax, ay = (w * w + x * x - y * y - z * z) * a, 2.0 * (x * y + w * z) * a
        bx, by = 2.0 * (x * y - w * z) * b, (w * w + y * y - x * x - z * z) * b
        cx, cy = 2.0 * (x * z + w * y) * c, 2.0 * (y * z - w * x) * c
        return (
            abs(cos * ax + sin * ay) + abs(cos * bx + sin * by) + abs(cos * cx + sin * cy),
            abs(cos * ay - sin * ax) + abs(cos * by - sin * bx) + abs(cos * cy - sin * cx),
        )
