# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Colours and pens. Text has a contrast of at least 4.5:1 with what it is written on."""

from slap_ros.drawing.svg import Pen

BACKGROUND, CARD = "#fbfbfa", "#ffffff"
INK, MUTED = "#1f2328", "#57606a"  # text
BORDER = "#8c959f"  # of cards
PLAN, PLAN_TINT = "#0b4fb3", "#eef4ff"  # the plan's edges; its nodes
SHORTCUT = "#9a3412"  # learned edges
START, GOAL = "#3d444d", "#116329"
GAINED, LOST = "#116329", "#a40e26"  # atoms, against the start

PLAN_PEN = Pen(PLAN, 3.0, 11.0)
SHORTCUT_PEN = Pen(SHORTCUT, 3.0, 11.0, "9 4")  # on the plan
OTHER_SHORTCUT_PEN = Pen(SHORTCUT, 1.2, 7.0, "6 3")
OPTION_PEN = Pen("#6e7781", 1.2, 7.0)
BACK_PEN = Pen("#7d8590", 0.8, 5.0, "3 3")
PENS = {  # by the mark of an edge
    "plan": PLAN_PEN,
    "shortcut": SHORTCUT_PEN,
    "option": OPTION_PEN,
    "other shortcut": OTHER_SHORTCUT_PEN,
    "back": BACK_PEN,
}
