# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Files that grow by a line of JSON at a time, whose last line may be one of an interrupted run."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

from slap_ros.files import parse_json, read_bytes
from slap_ros.learning.work_folder import DECODING_ERRORS, damaged

Line = TypeVar("Line")


def append_line(path: Path, entry: Any) -> None:
    """Add a line to a file, which is made where there is none.

    Args:
        path: Path of the file, in a folder that exists.
        entry: Data that JSON can hold.

    Raises:
        OSError: It cannot be written.
    """
    with path.open("a+b") as file:
        cut_off_half_a_line(file)  # else it would be one damaged line with the new one
        file.write(json.dumps(entry).encode() + b"\n")


def whole_lines(path: Path) -> list[Any]:
    """The data of each line of a file; a last one that was not written to its end is left out.

    Raises:
        OSError: It cannot be read.
        ValueError: A line is no JSON.
    """
    return [parse_json(line) for line in _whole(path)]


def decoded_lines(path: Path, decode: Callable[[Any], Line], advice: str) -> list[Line]:
    """What each line of a file says; a last one that was not written to its end is left out.

    Args:
        path: Path of the file.
        decode: Function that gives what the data of a line says.
        advice: Advice for whoever reads that the file is damaged, in words.

    Raises:
        InvalidParameterError: The file cannot be read, or a line is damaged; names the line.
    """
    found: list[Line] = []
    where = f"{path}"
    try:
        for number, line in enumerate(_whole(path), start=1):
            where = f"{path}, line {number}"
            found.append(decode(parse_json(line)))
    except DECODING_ERRORS as error:
        raise damaged(where, error, advice) from error
    return found


def cut_off_half_a_line(file: BinaryIO) -> None:
    """Remove what is behind the last line that is whole.

    Args:
        file: File, open for reading and writing.
    """
    size = file.seek(0, os.SEEK_END)
    if not size:
        return
    file.seek(size - 1)
    if file.read(1) != b"\n":
        file.seek(0)
        file.truncate(file.read().rfind(b"\n") + 1)


def _whole(path: Path) -> list[bytes]:
    return read_bytes(path).split(b"\n")[:-1]
