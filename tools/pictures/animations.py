# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Animations of solved tasks, with the steps counted: one arm alone, or two side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import chain, repeat
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from slap_ros.core import Domain
from slap_ros.domains import cleanup_table, cluttered_drawer
from slap_ros.domains.cleanup_table.scene import scene_of as scene_of_table
from slap_ros.domains.cleanup_table.shapes import shipped
from slap_ros.domains.cluttered_drawer.scene import scene_of as scene_of_drawer
from slap_ros.domains.obstacle_tower.features import SURFACE
from slap_ros.domains.obstacle_tower.scene import scene_of as scene_of_tower
from slap_ros.evaluation.approaches import Approach, approaches
from slap_ros.evaluation.experiment import solve
from slap_ros.planning.options import OptionKind
from slap_ros.relational import State
from slap_ros.shortcuts.sampling import DEFAULT
from slap_ros.shortcuts.shipped import chosen_library
from slap_ros.skills.domain_choice import SHIPPED, DomainChoice, open_domain
from slap_ros.worlds.joint_space.visuals import SceneVisuals
from slap_ros.worlds.panda import CONTROL_PERIOD_S
from slap_ros.worlds.rendering import Camera
from slap_ros.worlds.viewpoint import Viewpoint
from slap_ros.worlds.visuals import Visuals

OVERSAMPLING = 2  # pictures are drawn so many times as large, then scaled down
SIZE_PX = (420, 380)  # of one arm's picture
HEADER_PX, MARGIN_PX, GAP_PX = 66, 14, 4
PAUSE_FRAMES = 20  # at the end
COLOURS = 128
PAPER, INK, MUTED = "#fbfbfa", "#1f2328", "#57606a"
SHORTCUT, DONE, PLATE = "#9a3412", "#116329", "#4caf50"
CLEARANCE_M = 0.0015  # of a plate that is flush with the table, so that one sees which is on top
TITLES = ("planning with given skills", "and with a learned shortcut")


@dataclass(frozen=True)
class Subject:
    """A task and how it is shown.

    Args:
        domain: Name of the domain.
        preset: Name of the domain's preset.
        seed: Seed of the task.
        visuals_of: Function from a first state to what there is to see.
        viewpoint: Viewpoint of the camera; its size does not matter.
        prepared: Function from a state to the state that is drawn.
        skills: Choice of skills; empty for those that ship.
    """

    domain: str
    preset: str
    seed: int
    visuals_of: Callable[[State], Visuals]
    viewpoint: Viewpoint
    prepared: Callable[[State], State] = lambda state: state
    skills: str = SHIPPED

    def domain_with_skills(self) -> Domain:
        """The domain, with the skills to plan with."""
        return open_domain(DomainChoice(self.domain, self.preset, self.skills))


@dataclass(frozen=True)
class Caption:
    """What the arm is doing in a step."""

    text: str
    colour: str = MUTED


@dataclass(frozen=True)
class Recording:
    """A solved task."""

    title: str
    states: Sequence[State]  # one more than steps
    captions: Sequence[Caption]  # one per state

    @property
    def steps(self) -> int:
        """How many environment steps were executed."""
        return len(self.states) - 1


def lifted(state: State) -> State:
    """The same state with the target plate a little above the table."""
    plates = [s for s in state.layout.of_type(SURFACE) if state.get(s, "is_target") > 0.5]
    return state.replace({(s, "z"): float(state.get(s, "z")) + CLEARANCE_M for s in plates})


TOWER = Subject(
    "obstacle_tower",
    "fair",
    1,
    lambda state: SceneVisuals(scene_of_tower(state)),
    Viewpoint(eye=(1.3, -0.95, 0.8), target=(0.31, -0.03, 0.27), field_of_view=42.0),
    lifted,
)
DRAWER = Subject(
    "cluttered_drawer",
    "fair",
    0,
    lambda state: SceneVisuals(scene_of_drawer(state)),
    cluttered_drawer.VIEWPOINT,
)
TABLE = Subject(
    "cleanup_table",
    "fair",
    0,
    lambda state: SceneVisuals(scene_of_table(state, shipped())),
    cleanup_table.VIEWPOINT,
)


def make_side_by_side(path: Path) -> None:
    """The tower with given skills alone and, beside it, with a shortcut."""
    given, slap = _given_and_slap(TOWER)
    both = [
        record(TOWER, title, approach)
        for title, approach in zip(TITLES, (given, slap), strict=True)
    ]
    write_gif(path, compose(TOWER, both), CONTROL_PERIOD_S)


def make_drawer(path: Path) -> None:
    """The drawer with a shortcut."""
    _make_alone(path, DRAWER, "Cluttered Drawer")


def make_table(path: Path) -> None:
    """The table with a shortcut."""
    _make_alone(path, TABLE, "Cleanup Table")


def _make_alone(path: Path, subject: Subject, title: str) -> None:
    _, slap = _given_and_slap(subject)
    recording = record(subject, title, slap)
    write_gif(path, compose(subject, [recording]), CONTROL_PERIOD_S)


def _given_and_slap(subject: Subject) -> tuple[Approach, Approach]:
    library = chosen_library(None, subject.domain_with_skills())
    given, _, slap = approaches(library, DEFAULT)
    return given, slap


def record(subject: Subject, title: str, approach: Approach) -> Recording:
    """Plan and execute.

    Args:
        subject: Subject that has the task.
        title: Title above the arm.
        approach: Way to plan.

    Raises:
        RuntimeError: The plan was not executed as planned, so that nobody knows which option
            each step belongs to.
    """
    domain = subject.domain_with_skills()
    task = domain.task(subject.seed)
    goal = domain.atom_space(task.initial_state).mask(task.goal)
    planner = approach.planner("lazy", domain, task.initial_state)
    plan = planner.plan(task.initial_state, goal).plan
    episode = solve(domain, task, approach)
    if not episode.success or episode.plan_length != plan.predicted_steps:
        raise RuntimeError(f"{title}: {episode.plan_length} steps, not {plan.predicted_steps}")
    captions = [
        Caption("learned shortcut", SHORTCUT)
        if edge.option.kind is OptionKind.SHORTCUT
        else Caption(str(edge))
        for edge in plan.edges
        for _ in range(edge.predicted_steps)
    ]
    return Recording(title, episode.states, [captions[0], *captions])


def compose(subject: Subject, recordings: Sequence[Recording]) -> list[Image.Image]:
    """The frames: every arm goes on for as long as it has steps, and then waits for the others."""
    longest = max(recording.steps for recording in recordings)
    panels = [draw_panels(subject, recording) for recording in recordings]
    across, height = SIZE_PX
    width = len(panels) * across + (len(panels) - 1) * GAP_PX
    frames = []
    for step in range(longest + 1):
        frame = Image.new("RGB", (width, HEADER_PX + height), PAPER)
        for column, panel in enumerate(panels):
            frame.paste(panel[min(step, len(panel) - 1)], (column * (across + GAP_PX), 0))
        frames.append(frame)
    return list(chain(frames, repeat(frames[-1], PAUSE_FRAMES)))


def draw_panels(subject: Subject, recording: Recording) -> list[Image.Image]:
    """An arm in each of its states, with a header."""
    width, height = (OVERSAMPLING * size for size in SIZE_PX)
    viewpoint = replace(subject.viewpoint, width=width, height=height)
    panels = []
    with Camera(subject.visuals_of(recording.states[0]), viewpoint) as camera:
        for step, (state, caption) in enumerate(
            zip(recording.states, recording.captions, strict=True)
        ):
            large = Image.fromarray(camera.picture(subject.prepared(state)))
            seen = large.resize(SIZE_PX, Image.Resampling.LANCZOS)
            done = step == recording.steps
            shown = Caption(f"goal reached in {step} steps", DONE) if done else caption
            panels.append(with_header(seen, recording.title, step, shown))
    return panels


def with_header(seen: Image.Image, title: str, step: int, caption: Caption) -> Image.Image:
    """A picture below its title, its caption and its step."""
    panel = Image.new("RGB", (seen.width, HEADER_PX + seen.height), PAPER)
    panel.paste(seen, (0, HEADER_PX))
    pen = ImageDraw.Draw(panel)
    pen.text((MARGIN_PX, 10), title, INK, font(19))
    pen.text((MARGIN_PX, 38), _fitting(caption.text), caption.colour, font(15))
    right = seen.width - MARGIN_PX
    colour = DONE if caption.colour == DONE else INK
    pen.text((right, 2), str(step), colour, font(40), anchor="ra")
    pen.text((right, 44), "steps", MUTED, font(13), anchor="ra")
    return panel


def _fitting(text: str) -> str:
    """A caption that leaves room for the counter; long ones lose their arguments."""
    return text if len(text) <= 38 else text.partition("(")[0]


def font(size_px: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """The font that comes with Pillow, so that pictures are the same on every machine."""
    return ImageFont.load_default(size_px)


def write_gif(path: Path, frames: Sequence[Image.Image], period_s: float) -> None:
    """Write frames with one palette, so that only what moves takes room.

    Args:
        path: The file.
        frames: Frames, all of one size.
        period_s: Duration of each frame, s.
    """
    palette = common_palette(frames)
    first, *others = (frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    duration = round(1000 * period_s)  # ms
    first.save(path, save_all=True, append_images=others, duration=duration, loop=0, optimize=True)


def common_palette(frames: Sequence[Image.Image]) -> Image.Image:
    """Colours for all frames, those of the captions among them although they cover little."""
    sample = [np.asarray(frame) for frame in frames[:: max(1, len(frames) // 12)]]
    size = frames[0].width, frames[0].height // 4
    swatches = [np.asarray(Image.new("RGB", size, c)) for c in (INK, MUTED, SHORTCUT, DONE, PLATE)]
    return Image.fromarray(np.vstack(sample + swatches)).quantize(COLOURS)
