# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Animations of runs, for ``slap run --render`` and ``slap bag render``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from slap_ros.cli.bars import counting_bars
from slap_ros.cli.console import console
from slap_ros.core import Animate, Domain, PictureSize
from slap_ros.drawing.body_pictures import SIZE, visible, write_body_animation
from slap_ros.errors import InvalidParameterError, StorageFullError
from slap_ros.files import require_writable
from slap_ros.physics.animation import WRITERS
from slap_ros.relational import State

LARGEST = PictureSize(3840, 2160)
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
    if found is not None:
        size = PictureSize(int(found[1]), int(found[2]))
        within = all(2 <= n <= most for n, most in zip(size, LARGEST, strict=True))
        if within and not any(n % 2 for n in size):
            return size
    raise InvalidParameterError(
        f"--size is two even numbers of pixels up to {LARGEST.width}x{LARGEST.height}, such as "
        f"960x720, not {text!r}"
    )


def check_renderable(domain: Domain, state: State, path: Path) -> None:
    """Refuse what could not be rendered before anything is run.

    Args:
        domain: Whose states are to be rendered.
        state: One of them.
        path: The file to write.

    Raises:
        InvalidParameterError: The domain displays no bodies, or the file has another ending than
            those of animations.
        OSError: It cannot be written.
    """
    if domain.display.animate is None and not visible(domain.display, state):
        raise InvalidParameterError(
            f"{domain.name} displays no bodies (Display.bodies), so there is nothing to render"
        )
    if path.suffix not in WRITERS:
        raise InvalidParameterError(
            f"an animation is a file that ends in {' or '.join(WRITERS)}, not {path.name!r}"
        )
    require_writable(path)


def render(
    domain: Domain, states: Sequence[State], path: Path, size: PictureSize | None = None
) -> None:
    """Write an animation.

    Args:
        domain: Of the states.
        states: One per frame.
        path: The file; its ending gives the format.
        size: Of the frames; None: as the domain has it.

    Raises:
        StorageFullError: It cannot be written.
    """
    with counting_bars() as bar:
        task = bar.add_task("rendering", total=len(states))
        try:
            _animation(domain)(path, states, size, lambda done: bar.update(task, completed=done))
        except OSError as error:
            raise StorageFullError(f"cannot write {path}: {error.strerror or error}") from error
    console.print(f"animation: {path}")


def _animation(domain: Domain) -> Animate:
    """What writes an animation: the domain's own, or a plain drawing of its bodies."""
    if domain.display.animate is not None:
        return domain.display.animate
    period_s = domain.execution.control_period_s
    return lambda path, states, size, progress: write_body_animation(
        path, domain.display, states, period_s, size or SIZE, progress
    )
