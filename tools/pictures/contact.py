# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Animations of the contact world: one operator of a task, done by the demonstrator's script."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import repeat
from pathlib import Path

from PIL import Image

from slap_ros.core import Domain
from slap_ros.geometry.pose import Vector
from slap_ros.planning.execution import EpisodeResult, ExecutedEdge
from slap_ros.relational import State
from slap_ros.skills.demonstrator import demonstrate
from slap_ros.skills.domain_choice import DEMONSTRATOR, DomainChoice, open_domain
from slap_ros.worlds.contact.arm import CONTROL_PERIOD_S
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.contact.visuals import ContactVisuals
from slap_ros.worlds.contact.world import ContactWorld
from slap_ros.worlds.rendering import Camera
from slap_ros.worlds.viewpoint import Viewpoint
from tools.pictures.animations import (
    DONE,
    OVERSAMPLING,
    PAUSE_FRAMES,
    SIZE_PX,
    Caption,
    with_header,
    write_gif,
)


@dataclass(frozen=True)
class Subject:
    """A use of an operator and how it is shown.

    Args:
        title: Title above the picture.
        domain: Name of the domain.
        operator: Name of an operator of the domain; its first use in the task is shown.
        eye: Position of the camera, m, from the last of the operator's objects.
        target: Position in the middle of the picture, m, from the same object.
        seed: Seed of the task.
    """

    title: str
    domain: str
    operator: str
    eye: Vector
    target: Vector
    seed: int = 0


DRAWER = Subject("Stow Hammer", "stow_hammer", "Open", (-0.25, 0.62, 0.42), (-0.14, 0.0, 0.06))
PEG = Subject("Peg in Hole", "peg_in_hole", "Insert", (-0.4, -0.5, 0.25), (-0.12, 0.0, -0.02))
LID = Subject("Make Coffee", "make_coffee", "CloseLid", (-0.5, -0.45, 0.35), (0.0, 0.0, 0.06), 1)


def make_drawer(path: Path) -> None:
    """A drawer is pulled open by its handle."""
    _make(path, DRAWER)


def make_peg(path: Path) -> None:
    """A peg goes into a hole."""
    _make(path, PEG)


def make_lid(path: Path) -> None:
    """A lid is turned down."""
    _make(path, LID)


def _make(path: Path, subject: Subject) -> None:
    domain = open_domain(DomainChoice(subject.domain, skills=DEMONSTRATOR))
    episode = demonstrate(domain, domain.task(subject.seed)).episode
    edge, states = _part(episode, subject.operator)
    assert domain.display.frames is not None
    seen_from = domain.display.frames(states[0])[edge.objects[-1]].position
    name = f"{edge.option}({', '.join(edge.objects)})"
    frames = _drawn(_viewpoint(subject, seen_from), _scene(domain, states[0]), states)
    panels = _captioned(frames, subject.title, name)
    write_gif(path, [*panels, *repeat(panels[-1], PAUSE_FRAMES)], CONTROL_PERIOD_S)


def _part(episode: EpisodeResult, operator: str) -> tuple[ExecutedEdge, list[State]]:
    """The first use of an operator, and its states.

    Raises:
        RuntimeError: The task was solved without it.
    """
    begin = 0
    for edge in episode.edges:
        end = begin + edge.steps
        if edge.option == operator and edge.reached:
            return edge, episode.states[begin : end + 1]
        begin = end
    raise RuntimeError(f"{operator} was not carried out")


def _viewpoint(subject: Subject, origin: Vector) -> Viewpoint:
    width, height = (OVERSAMPLING * size for size in SIZE_PX)
    (ex, ey, ez), (tx, ty, tz), (x, y, z) = subject.eye, subject.target, origin
    return Viewpoint((x + ex, y + ey, z + ez), (x + tx, y + ty, z + tz), 42.0, width, height)


def _scene(domain: Domain, state: State) -> ContactScene:
    world = domain.make_world(state)
    assert isinstance(world, ContactWorld)
    with world:
        return world.scene


def _drawn(view: Viewpoint, scene: ContactScene, states: list[State]) -> Iterator[Image.Image]:
    with Camera(ContactVisuals(scene), view) as camera:
        for state in states:
            large = Image.fromarray(camera.picture(state))
            yield large.resize(SIZE_PX, Image.Resampling.LANCZOS)


def _captioned(frames: Iterable[Image.Image], title: str, name: str) -> list[Image.Image]:
    pictures = list(frames)
    last = len(pictures) - 1
    captions = [Caption(name)] * last + [Caption(f"done in {last} steps", DONE)]
    return [
        with_header(picture, title, step, caption)
        for step, (picture, caption) in enumerate(zip(pictures, captions, strict=True))
    ]
