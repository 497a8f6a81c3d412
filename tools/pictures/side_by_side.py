# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One task, solved twice side by side: with the given skills, and with a shortcut as well."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, repeat
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from slap_ros.domains import get_domain
from slap_ros.domains.obstacle_tower.features import SURFACE
from slap_ros.domains.obstacle_tower.scene import scene_of
from slap_ros.evaluation.approaches import Approach, approaches
from slap_ros.evaluation.experiment import solve
from slap_ros.physics.panda import CONTROL_PERIOD_S
from slap_ros.physics.rendering import Camera
from slap_ros.physics.viewpoint import Viewpoint
from slap_ros.planning.options import OptionKind
from slap_ros.relational import State
from slap_ros.shortcuts.shipped import chosen_library
from slap_ros.shortcuts.shortcut import DEFAULT

DOMAIN, SEED = "obstacle_tower", 1
TITLES = ("planning with given skills", "and with a learned shortcut")
OVERSAMPLING = 2  # pictures are drawn so many times as large, then scaled down
WIDTH_PX, HEIGHT_PX = 420, 380  # of one arm's picture
HEADER_PX, MARGIN_PX, GAP_PX = 66, 14, 4
VIEW = Viewpoint(
    eye=(1.3, -0.95, 0.8),
    target=(0.31, -0.03, 0.27),
    field_of_view=42.0,
    width=OVERSAMPLING * WIDTH_PX,
    height=OVERSAMPLING * HEIGHT_PX,
)
PAUSE_FRAMES = 20  # at the end
COLOURS = 128
PAPER, INK, MUTED = "#fbfbfa", "#1f2328", "#57606a"
SHORTCUT, DONE, PLATE = "#9a3412", "#116329", "#4caf50"
CLEARANCE_M = 0.0015  # of a plate that is flush with the table, so that one sees which is on top


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
        """How many were executed."""
        return len(self.states) - 1


def make(path: Path) -> None:
    """Solve the task in both ways and write the animation."""
    domain = get_domain(DOMAIN)
    given, _, slap = approaches(chosen_library(None, domain), DEFAULT)
    both = [record(title, approach) for title, approach in zip(TITLES, (given, slap), strict=True)]
    frames = compose(both)
    write_gif(path, frames, CONTROL_PERIOD_S)


def record(title: str, approach: Approach) -> Recording:
    """Plan and execute.

    Args:
        title: What is written above the arm.
        approach: How to plan.

    Raises:
        RuntimeError: The plan was not executed as planned, so that nobody knows which option
            each step belongs to.
    """
    domain = get_domain(DOMAIN)
    task = domain.task(SEED)
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


def compose(recordings: Sequence[Recording]) -> list[Image.Image]:
    """The frames: every arm goes on for as long as it has steps, and then waits for the others."""
    longest = max(recording.steps for recording in recordings)
    panels = [draw_panels(recording) for recording in recordings]
    width = len(panels) * WIDTH_PX + (len(panels) - 1) * GAP_PX
    frames = []
    for step in range(longest + 1):
        frame = Image.new("RGB", (width, HEADER_PX + HEIGHT_PX), PAPER)
        for column, panel in enumerate(panels):
            frame.paste(panel[min(step, len(panel) - 1)], (column * (WIDTH_PX + GAP_PX), 0))
        frames.append(frame)
    return list(chain(frames, repeat(frames[-1], PAUSE_FRAMES)))


def draw_panels(recording: Recording) -> list[Image.Image]:
    """An arm in each of its states, with a header."""
    panels = []
    with Camera(scene_of(recording.states[0]), VIEW) as camera:
        for step, (state, caption) in enumerate(
            zip(recording.states, recording.captions, strict=True)
        ):
            large = Image.fromarray(camera.picture(lifted(state)))
            seen = large.resize((WIDTH_PX, HEIGHT_PX), Image.Resampling.LANCZOS)
            done = step == recording.steps
            shown = Caption(f"goal reached in {step} steps", DONE) if done else caption
            panels.append(with_header(seen, recording.title, step, shown))
    return panels


def lifted(state: State) -> State:
    """The same state with the target plate a little above the table."""
    plates = [s for s in state.layout.of_type(SURFACE) if state.get(s, "is_target") > 0.5]
    return state.replace({(s, "z"): float(state.get(s, "z")) + CLEARANCE_M for s in plates})


def with_header(seen: Image.Image, title: str, step: int, caption: Caption) -> Image.Image:
    """A picture below its title, its caption and its step."""
    panel = Image.new("RGB", (WIDTH_PX, HEADER_PX + HEIGHT_PX), PAPER)
    panel.paste(seen, (0, HEADER_PX))
    pen = ImageDraw.Draw(panel)
    pen.text((MARGIN_PX, 10), title, INK, font(19))
    pen.text((MARGIN_PX, 38), caption.text, caption.colour, font(15))
    right = WIDTH_PX - MARGIN_PX
    colour = DONE if caption.colour == DONE else INK
    pen.text((right, 2), str(step), colour, font(40), anchor="ra")
    pen.text((right, 44), "steps", MUTED, font(13), anchor="ra")
    return panel


def font(size_px: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """The font that comes with Pillow, so that pictures are the same on every machine."""
    return ImageFont.load_default(size_px)


def write_gif(path: Path, frames: Sequence[Image.Image], period_s: float) -> None:
    """Write frames with one palette, so that only what moves takes room.

    Args:
        path: The file.
        frames: All of one size.
        period_s: How long each is shown.
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
