# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Animations of states, as GIF or MP4."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import index
from pathlib import Path

from slap_ros.core import Animate, Domain, PictureSize
from slap_ros.drawing.body_pictures import SIZE, visible, write_body_animation
from slap_ros.errors import InvalidParameterError, StorageFullError
from slap_ros.files import require_writable
from slap_ros.relational import State
from slap_ros.worlds.animation import WRITERS

LARGEST = PictureSize(3840, 2160)


def frame_size(given: object) -> PictureSize:
    """A size of frames that was given by width and height.

    Args:
        given: Width and height, pixels.

    Raises:
        InvalidParameterError: It is not two even numbers, or larger than ``LARGEST``.
    """
    try:
        size = PictureSize(*map(index, given))  # type: ignore[call-overload]
    except TypeError:
        size = PictureSize(0, 0)
    within = all(2 <= n <= most for n, most in zip(size, LARGEST, strict=True))
    if not within or any(n % 2 for n in size):
        raise InvalidParameterError(
            f"size must be two even numbers of pixels up to {LARGEST.width} and {LARGEST.height}, "
            f"such as (960, 720), not {given!r}"
        )
    return size


def require_renderable(domain: Domain, state: State, path: Path) -> None:
    """Refuse what could not be rendered before anything is run.

    Args:
        domain: Domain whose states are to be rendered.
        state: A state of the domain.
        path: File to write.

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


def write_video(
    domain: Domain,
    states: Sequence[State],
    path: Path,
    size: PictureSize | None = None,
    on_frame: Callable[[int], None] = lambda _: None,
) -> None:
    """Write an animation, a frame per state.

    Args:
        domain: Domain of the states.
        states: States, in order.
        path: File to write; its ending gives the format. Missing folders are made.
        size: Size of the frames; None for the domain's own.
        on_frame: Function that receives the number of frames that are done.

    Raises:
        InvalidParameterError: See :func:`require_renderable`.
        StorageFullError: It cannot be written.
    """
    require_renderable(domain, states[0], path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _animation(domain)(path, states, size, on_frame)
    except OSError as error:
        raise StorageFullError(f"cannot write {path}: {error.strerror or error}") from error


def _animation(domain: Domain) -> Animate:
    """What writes an animation: the domain's own, or a plain drawing of its bodies."""
    if domain.display.animate is not None:
        return domain.display.animate
    period_s = domain.execution.control_period_s
    return lambda path, states, size, progress: write_body_animation(
        path, domain.display, states, period_s, size or SIZE, progress
    )
