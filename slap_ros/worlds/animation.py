# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures one after the other, as a GIF or an MP4. What encodes them is imported on use."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]  # (height, width, 3), red green blue

COLOURS = 128  # of a picture in a GIF


def write_pictures(path: Path, pictures: Iterable[Picture], period_s: float) -> None:
    """Write an animation; the file appears when it is complete, and not at all otherwise.

    Args:
        path: Path of the file, with an ending of :data:`WRITERS`.
        pictures: Pictures of one size, which is even for an MP4; at least one.
        period_s: Duration of each picture, s.

    Raises:
        OSError: It cannot be written.
    """
    with _aside(path) as part:
        WRITERS[path.suffix](part, pictures, period_s)


@contextmanager
def _aside(path: Path) -> Iterator[Path]:
    """A file beside ``path`` that takes its name in the end, if all went well."""
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        yield part
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _write_gif(path: Path, pictures: Iterable[Picture], period_s: float) -> None:
    from PIL import Image

    first, *others = (Image.fromarray(picture).quantize(COLOURS) for picture in pictures)
    duration = round(1000 * period_s)  # ms
    first.save(path, save_all=True, append_images=others, duration=duration, loop=0)


def _write_mp4(path: Path, pictures: Iterable[Picture], period_s: float) -> None:
    """MPEG-4 Part 2, the one codec of MP4 that OpenCV's own build encodes everywhere."""
    import cv2

    pictures = iter(pictures)
    first = next(pictures)
    height, width, _ = first.shape
    codec = cv2.VideoWriter.fourcc(*"mp4v")
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, codec, 1.0 / period_s, (width, height))
    count = 0
    try:
        for count, picture in enumerate(chain([first], pictures), start=1):  # noqa: B007
            writer.write(cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
    finally:
        writer.release()
    # The writer says nothing of a folder that is not there or a disk that is full.
    written = cv2.VideoCapture(str(path))
    complete = int(written.get(cv2.CAP_PROP_FRAME_COUNT)) == count
    written.release()
    if not complete:
        raise OSError("the video could not be written in full: is there room, and the folder?")


# By the ending of the file.
WRITERS: Mapping[str, Callable[[Path, Iterable[Picture], float], None]] = {
    ".gif": _write_gif,
    ".mp4": _write_mp4,
}
