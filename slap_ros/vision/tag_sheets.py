# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tags to print, on pages of A4 at their true size."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from slap_ros.errors import InvalidSceneError
from slap_ros.vision.installed import camera_library
from slap_ros.vision.tags import CELLS, MARGIN, tag_frame, tag_image

RESOLUTION = 600  # dots per inch
INCH = 0.0254  # m
PAGE = (0.210, 0.297)  # m, A4
EDGE = 0.012  # m, of the page that printers leave white
LABEL = 0.006  # m, below each tag
GAP = 0.003  # m, between tags
TEXT = 0.0026  # m, height of letters
RULER = 0.1  # m, of the line at the bottom that tells whether the printer scaled the page


@dataclass(frozen=True)
class PrintedTag:
    """A tag to print.

    Args:
        tag: Number of the tag.
        size: Edge of its black square, m.
        label: What is written below it.
    """

    tag: int
    size: float
    label: str

    @property
    def edge(self) -> float:
        """The edge of what is to be cut out: the tag with its white margin, m."""
        return self.size * (CELLS + 2 * MARGIN) / CELLS


def tag_sheets(tags: Sequence[PrintedTag]) -> bytes:
    """A PDF of tags, each at its size, with a line around it to cut along.

    Args:
        tags: Tags, in the order of the pages.

    Raises:
        InvalidSceneError: A tag does not fit on a page, or there is none.
    """
    if not tags:
        raise InvalidSceneError("there is no tag to print")
    image = camera_library("PIL.Image")
    pages = []
    for page in _pages(tags):
        sheet = image.new("1", (_dots(PAGE[0]), _dots(PAGE[1])), 1)
        for tag, x, y in page:
            _draw(sheet, tag, x, y)
        _draw_ruler(sheet)
        pages.append(sheet)
    content = io.BytesIO()
    fixed = {"title": "AprilTags 36h11", "creationDate": None, "modDate": None}
    pages[0].save(
        content,
        "PDF",
        resolution=RESOLUTION,
        save_all=True,
        append_images=pages[1:],
        **fixed,
    )
    return content.getvalue()


def _pages(tags: Sequence[PrintedTag]) -> list[list[tuple[PrintedTag, float, float]]]:
    """Where on which page each tag has its upper left corner, m: rows from the left."""
    pages: list[list[tuple[PrintedTag, float, float]]] = [[]]
    x, y, row = EDGE, EDGE, 0.0
    bottom = PAGE[1] - 2.0 * EDGE
    for tag in tags:
        if EDGE + tag.edge > min(PAGE[0] - EDGE, bottom - LABEL):
            raise InvalidSceneError(f"tag {tag.tag} of {tag.size:g} m does not fit on a page of A4")
        if x + tag.edge > PAGE[0] - EDGE:
            x, y, row = EDGE, y + row + LABEL + GAP, 0.0
        if y + tag.edge + LABEL > bottom:
            pages.append([])
            x, y, row = EDGE, EDGE, 0.0
        pages[-1].append((tag, x, y))
        x, row = x + tag.edge + GAP, max(row, tag.edge)
    return pages


def _draw(sheet: Any, tag: PrintedTag, x: float, y: float) -> None:
    image, draw = camera_library("PIL.Image"), camera_library("PIL.ImageDraw").Draw(sheet)
    edge = _dots(tag.edge)
    picture = image.fromarray(tag_image(tag.tag, edge // (CELLS + 2 * MARGIN)))
    left, top = _dots(x), _dots(y)
    sheet.paste(picture.resize((edge, edge), image.Resampling.NEAREST), (left, top))
    draw.rectangle((left, top, left + edge, top + edge), outline=0, width=2)
    text = f"{tag.label} {tag_frame(tag.tag)}, {1000.0 * tag.size:g} mm"
    draw.text((left, top + edge + _dots(0.001)), text, fill=0, font=_font())


def _draw_ruler(sheet: Any) -> None:
    draw = camera_library("PIL.ImageDraw").Draw(sheet)
    left, y = _dots(EDGE), _dots(PAGE[1] - EDGE)
    right = left + _dots(RULER)
    draw.line((left, y, right, y), fill=0, width=4)
    for x in (left, right):
        draw.line((x, y - _dots(0.002), x, y + _dots(0.002)), fill=0, width=4)
    text = "100 mm: if this line is not, print again at 100 %. Cut along the thin lines."
    draw.text((left, y - _dots(0.006)), text, fill=0, font=_font())


def _font() -> Any:
    return camera_library("PIL.ImageFont").load_default(_dots(TEXT))


def _dots(length: float) -> int:
    return round(length / INCH * RESOLUTION)
