# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Animations of runs, for ``slap run --render`` and ``slap bag render``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from slap_ros.api.video import LARGEST, frame_size, write_video
from slap_ros.cli.bars import counting_bars
from slap_ros.cli.console import console
from slap_ros.core import Domain, PictureSize
from slap_ros.errors import InvalidParameterError
from slap_ros.relational import State

Size = Annotated[
    str | None,
    typer.Option(
        help="Size of the animation in pixels, such as 960x720. Default: the domain's own."
    ),
]


def picture_size(text: str | None) -> PictureSize | None:
    """The size that an option states.

    Raises:
        InvalidParameterError: It is none, or larger than ``LARGEST``, or not even.
    """
    if text is None:
        return None
    found = re.fullmatch(r"([0-9]{1,5})x([0-9]{1,5})", text, re.ASCII)
    try:
        return frame_size(found and map(int, found.groups()))
    except InvalidParameterError as error:
        raise InvalidParameterError(
            f"--size is two even numbers of pixels up to {LARGEST.width}x{LARGEST.height}, such as "
            f"960x720, not {text!r}"
        ) from error


def render(
    domain: Domain, states: Sequence[State], path: Path, size: PictureSize | None = None
) -> None:
    """Write an animation.

    Args:
        domain: Domain of the states.
        states: One per frame.
        path: The file; its ending gives the format.
        size: Width and height of the frames, pixels; None for the domain's own size.

    Raises:
        StorageFullError: It cannot be written.
    """
    with counting_bars() as bar:
        task = bar.add_task("rendering", total=len(states))
        write_video(domain, states, path, size, lambda done: bar.update(task, completed=done))
    console.print(f"animation: {path}")
