# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Files that grow by a line of JSON at a time, whose last line may be one of an interrupted run."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, BinaryIO

from slap_ros.files import parse_json, read_bytes


def append_line(path: Path, entry: Any) -> None:
    """Add a line to a file, which is made where there is none.

    Args:
        path: Path of the file, in a folder that exists.
        entry: Data that JSON can hold.

    Raises:
        OSError: It cannot be written.
    """
    with path.open("a+b") as file:
        _cut_off_half_a_line(file)  # else it would be one damaged line with the new one
        file.write(json.dumps(entry).encode() + b"\n")


def whole_lines(path: Path) -> list[Any]:
    """The data of each line of a file; a last one that was not written to its end is left out.

    Raises:
        OSError: It cannot be read.
        ValueError: A line is no JSON.
    """
    return [parse_json(line) for line in read_bytes(path).split(b"\n")[:-1]]


def _cut_off_half_a_line(file: BinaryIO) -> None:
    """Remove what is behind the last line that is whole."""
    size = file.seek(0, os.SEEK_END)
    if not size:
        return
    file.seek(size - 1)
    if file.read(1) != b"\n":
        file.seek(0)
        file.truncate(file.read().rfind(b"\n") + 1)
