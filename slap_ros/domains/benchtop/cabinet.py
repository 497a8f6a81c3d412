# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The body of a cabinet with a drawer that has a bar for a handle. Lengths in m.

Its frame lies on the table under the middle of its front. x runs along the front, and the drawer
opens towards y. What is put into the drawer stands in the part that the roof leaves free, which is
at least as long as the drawer is open.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from slap_ros.domains.benchtop.features import DRAWER, jointed_features
from slap_ros.geometry.pose import Pose, Vector
from slap_ros.relational import Type
from slap_ros.worlds.bodies import Colour
from slap_ros.worlds.contact.scene import BoxPart, Joint, JointedBody, JointKind

CABINET = Type("cabinet", DRAWER.features, DRAWER)

TRAVEL = 0.16
FLOOR = 0.04  # height of the drawer's floor over the table
RIM = 0.018  # height of the drawer's walls over its floor
DEPTH = 0.19  # from the front to the back
ROOF_FROM = 0.03  # behind the front
BOARD = 0.004  # half the thickness of a board
GAP = 0.002  # between the drawer and what it slides in
BAR_OUT, BAR_HALF = 0.085, 0.04  # from the front to the bar; half the bar's length
BAR_THICK, POST_THICK = 0.007, 0.005  # halves
HANDLE_HEIGHT = FLOOR + 0.5 * RIM - BOARD
# What lies in a drawer must go with it. With 0.6 kg and friction 1, a hammer slid by 22 mm while
# its drawer was pushed shut.
DRAWER_MASS = 1.5  # kg
STAYS = 10.0  # N, of dry friction: a drawer that is just open stays so when it is brushed against
FRICTION = 2.0  # 1

# In the cabinet's frame, while the drawer is closed.
HANDLE: Vector = (0.0, BAR_OUT, HANDLE_HEIGHT)  # the middle of the bar
MIDDLE: Vector = (0.0, -0.061, FLOOR)  # where things go, on the drawer's floor


@dataclass(frozen=True)
class CabinetShape:
    """How large a cabinet is.

    Args:
        half_width: Half the width of the drawer inside, m.
        headroom: Height from the drawer's floor to the roof, m.
        compartment: Length of the part of the drawer that things stand in, from the front, m.
    """

    half_width: float
    headroom: float
    compartment: float = DEPTH

    def body(self, name: str, colour: Colour) -> JointedBody:
        """A cabinet of that shape.

        Args:
            name: Name of the cabinet's object.
            colour: Colour of the drawer.
        """
        joint = Joint(JointKind.SLIDE, (0.0, 1.0, 0.0), TRAVEL, damping=5.0, dry_friction=STAYS)
        return JointedBody(
            name,
            self._frame(),
            self._drawer(),
            joint,
            DRAWER_MASS,
            friction=FRICTION,
            moving_colour=colour,
        )

    def _frame(self) -> tuple[BoxPart, ...]:
        """Plinth, walls, back and roof."""
        half, side = 0.5 * DEPTH, self.half_width + 3.0 * BOARD + GAP
        wide, top = side + BOARD, FLOOR + self.headroom + 2.0 * BOARD
        plinth, high = 0.5 * (FLOOR - 2.0 * BOARD - GAP), 0.5 * top
        roof = 0.5 * (DEPTH - ROOF_FROM)
        return (
            BoxPart((wide, half, plinth), Pose((0.0, -half, plinth))),
            BoxPart((BOARD, half, high), Pose((side, -half, high))),
            BoxPart((BOARD, half, high), Pose((-side, -half, high))),
            BoxPart((wide, BOARD, high), Pose((0.0, -DEPTH - GAP - BOARD, high))),
            BoxPart((wide, roof, BOARD), Pose((0.0, roof - DEPTH, top - BOARD))),
        )

    def _drawer(self) -> tuple[BoxPart, ...]:
        """Floor, walls, and a bar on two posts before the front."""
        half, wide, wall = 0.5 * DEPTH, self.half_width + 2.0 * BOARD, self.half_width + BOARD
        high = 0.5 * RIM + BOARD  # half, from under the floor to the rim
        middle = FLOOR + RIM - high
        post, beside = 0.5 * (BAR_OUT - BAR_THICK), BAR_HALF - POST_THICK
        return (
            BoxPart((wide, half, BOARD), Pose((0.0, -half, FLOOR - BOARD))),
            BoxPart((BOARD, half, high), Pose((wall, -half, middle))),
            BoxPart((BOARD, half, high), Pose((-wall, -half, middle))),
            BoxPart((wide, BOARD, high), Pose((0.0, BOARD - self.compartment, middle))),
            BoxPart((wide, BOARD, high), Pose((0.0, -BOARD, middle))),
            BoxPart((BAR_HALF, BAR_THICK, BAR_THICK), Pose((0.0, BAR_OUT, HANDLE_HEIGHT))),
            BoxPart((POST_THICK, post, POST_THICK), Pose((beside, post, HANDLE_HEIGHT))),
            BoxPart((POST_THICK, post, POST_THICK), Pose((-beside, post, HANDLE_HEIGHT))),
        )


def cabinet_features(pose: Pose) -> Mapping[str, float]:
    """The features of a cabinet that is closed, for ``State.build``, by its frame's pose."""
    return jointed_features(pose, 0.0, FLOOR)
