# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Animations of runs, for ``slap run --render`` and ``slap bag render``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from slap_ros.cli.console import console, progress
from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError, StorageFullError
from slap_ros.files import require_writable
from slap_ros.physics.animation import WRITERS
from slap_ros.relational import State


def check_renderable(domain: Domain, path: Path) -> None:
    """Refuse what could not be rendered before anything is run.

    Raises:
        InvalidParameterError: The domain has no pictures, or the file another ending than those
            of animations.
        OSError: It cannot be written.
    """
    if domain.display.animate is None:
        raise InvalidParameterError(f"{domain.name} has no pictures; leave out rendering")
    if path.suffix not in WRITERS:
        raise InvalidParameterError(
            f"an animation is a file that ends in {' or '.join(WRITERS)}, not {path.name!r}"
        )
    require_writable(path)


def render(domain: Domain, states: Sequence[State], path: Path) -> None:
    """Write an animation.

    Args:
        domain: Of the states.
        states: One per frame.
        path: The file; its ending gives the format.

    Raises:
        InvalidParameterError: The domain has no pictures.
        StorageFullError: It cannot be written.
    """
    if domain.display.animate is None:
        raise InvalidParameterError(f"{domain.name} has no pictures")
    with progress() as bar:
        task = bar.add_task("rendering", total=len(states))
        try:
            domain.display.animate(path, states, lambda done: bar.update(task, completed=done))
        except OSError as error:
            raise StorageFullError(f"cannot write {path}: {error.strerror or error}") from error
    console.print(f"animation: {path}")
