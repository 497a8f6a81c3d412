# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Both papers joined: a task with acquired skills alone, and with a shortcut over them."""

from __future__ import annotations

from pathlib import Path

from slap_ros.evaluation.approaches import approaches
from slap_ros.relational import State
from slap_ros.shortcuts.sampling import DEFAULT
from slap_ros.shortcuts.shipped import chosen_library
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.worlds.contact.arm import CONTROL_PERIOD_S
from slap_ros.worlds.contact.visuals import ContactVisuals
from slap_ros.worlds.contact.world import ContactWorld
from slap_ros.worlds.viewpoint import Viewpoint
from slap_ros.worlds.visuals import Visuals
from tools.imports import ROOT
from tools.pictures.animations import Subject, compose, record, write_gif

LIBRARIES = ROOT / "models" / "join"
TITLES = ("acquired skills alone", "and with a shortcut over them")
FRAME_STEPS = 2  # environment steps from one picture to the next


def make(path: Path) -> None:
    """The cubes with acquired skills alone and, beside them, with a shortcut over these skills."""
    library = chosen_library(str(LIBRARIES / "shortcuts"), CUBES.domain_with_skills())
    alone, _, slap = approaches(library, DEFAULT)
    both = [
        record(CUBES, title, approach)
        for title, approach in zip(TITLES, (alone, slap), strict=True)
    ]
    frames = compose(CUBES, both)
    write_gif(path, frames[::FRAME_STEPS], FRAME_STEPS * CONTROL_PERIOD_S)


def _visuals(state: State) -> Visuals:
    domain = open_domain(DomainChoice(CUBES.domain, CUBES.preset))
    world = domain.make_world(state)
    assert isinstance(world, ContactWorld)
    with world:
        return ContactVisuals(world.scene)


CUBES = Subject(
    "stack_at_target",
    "fair:blocked=1",
    1,
    _visuals,
    Viewpoint(eye=(1.05, -0.55, 0.5), target=(0.52, 0.0, 0.05), field_of_view=42.0),
    skills=str(LIBRARIES / "skills"),
)
