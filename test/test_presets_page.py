# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page that compares our presets with the published code has the values of the presets."""

import re
from ast import literal_eval
from fractions import Fraction
from pathlib import Path

import pytest

from slap_ros.domains import get_domain

PAGE = (Path(__file__).parent.parent / "docs" / "presets.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| [^|]+ \| `(\w+)` \| [^|]+ \| ([^|]+) \| ([^|]+) \|$", re.MULTILINE)
DOMAINS = {
    "Obstacle 2D": ("obstacle2d", {"grasp_reach", "grasp_gap", "inside_tolerance"}),
    "Obstacle Tower": ("obstacle_tower", {"timing", "shortcut_speed"}),
    "Cluttered Drawer": ("cluttered_drawer", {"timing", "shortcut_speed"}),
    "Cleanup Table": ("cleanup_table", {"timing", "shortcut_speed", "toy_x", "wiper_y"}),
}


def value(text):
    """A word, a range, or a number that may be a fraction."""
    if text[0] == "(":
        return literal_eval(text)
    return text if text[0].isalpha() else float(Fraction(text))


@pytest.mark.parametrize("title", DOMAINS)
def test_values_are_those_of_the_presets(title):
    name, wanted = DOMAINS[title]
    section = PAGE.split(f"\n## {title}\n")[1].split("\n## ")[0]
    rows = ROW.findall(section)
    assert wanted <= {setting for setting, _, _ in rows}
    for setting, *cells in rows:
        for preset, cell in zip(("paper", "fair"), cells, strict=True):
            assert value(cell) == value(get_domain(name, preset).configuration[setting]), setting
