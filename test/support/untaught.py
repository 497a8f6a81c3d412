# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""obstacle2d as it would be before anybody has given or learned its skills."""

from dataclasses import replace

from slap_ros.core import Acquisition, presets
from slap_ros.domains import get_domain


def holding(block):
    """A goal about one block."""

    def goal(state):
        layout = state.layout
        held = next(p for p in get_domain("obstacle2d").predicates if p.name == "Holding")
        return frozenset({held(layout.object("robot"), layout.object(block))})

    return goal


@presets("fair")
def make(preset, changes):
    """Its skills are the scripts of the demonstrator, and its operators are written by hand."""
    settings = ",".join(f"{name}={value}" for name, value in changes.items())
    taught = get_domain("obstacle2d", f"{preset}:{settings}" if settings else preset)
    by_hand = Acquisition(
        approach=lambda state, objects: lambda _: None,
        operators=taught.operators,
        scripts={name: skill.start for name, skill in taught.skills.items()},
    )
    return replace(
        taught,
        name="untaught",
        operators=(),
        skills={},
        static=taught.static_predicates,
        goals={"training": taught.default_goal, "other": holding("block2")},
        acquisition=by_hand,
    )
