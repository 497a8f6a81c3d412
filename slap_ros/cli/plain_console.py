# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""rich's console, for texts that are data."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import Any, TextIO

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from slap_ros.cli.console import visible

FILE_WIDTH = 120  # columns of what is no terminal: tables must not be cut there


class PlainConsole(Console):
    """A console on which texts are data; style comes from :func:`styled` alone."""

    def __init__(self, stream: TextIO | None = None) -> None:
        """Print on a stream.

        Args:
            stream: Where to print; None for whatever stderr is at the time.
        """
        target = stream or sys.stderr
        at_a_terminal = target is not None and target.isatty()
        width = None if at_a_terminal else FILE_WIDTH
        super().__init__(
            file=stream,
            stderr=stream is None,
            soft_wrap=True,
            width=width,
            markup=False,
            highlight=False,
            emoji=False,
        )

    def render_str(self, text: str, **options: Any) -> Text:
        """A text as data; made visible here already, before its width is measured."""
        return super().render_str(visible(text), **options)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """What is printed, in segments; those of text made visible."""
        for segment in super().render(renderable, options):
            if segment.control is None and not segment.text.isprintable():
                segment = segment._replace(text=visible(segment.text))
            yield segment
