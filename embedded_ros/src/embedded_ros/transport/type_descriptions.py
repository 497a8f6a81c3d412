# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What CycloneDDS tells other participants of a type, kept in the user's cache.

CycloneDDS works it out in Python, from the type alone: a third of a second for the types of one
node, in every process. A file has the two parts, after their sizes and a digest of both: what was
damaged is worked out again, and so is everything where no cache can be written.
"""

from __future__ import annotations

import os
import struct
import tempfile
from contextlib import suppress
from functools import cache
from hashlib import blake2b
from importlib.metadata import version
from pathlib import Path
from typing import Any

DIGEST_SIZE = 16  # bytes
SIZES = struct.Struct("<II")
KNOWN = (object(), object())  # in place of what CycloneDDS made the bytes from; it asks for bytes


def describe(descriptor: Any, key: str) -> None:
    """Let a descriptor know its description.

    Args:
        descriptor: CycloneDDS's descriptor of a type.
        key: Another one for every other type; a name that a file can have.
    """
    idl = descriptor.__idl__
    if idl._xt_data[0] is not None:
        return
    folder = _folder()
    description = _read(folder / key) if folder is not None else None
    if description is not None:
        idl.populate()
        idl._xt_data, idl._xt_bytedata = KNOWN, description
        return
    idl.fill_type_data()
    if folder is not None:
        _write(folder / key, idl._xt_bytedata)


@cache
def _folder() -> Path | None:
    """Where descriptions are kept by this CycloneDDS; None where that cannot be."""
    try:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        folder = base / "embedded_ros" / f"cyclonedds-{version('cyclonedds')}"
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # the latter where nobody knows of a home
        return None
    return folder


def _read(file: Path) -> tuple[bytes, bytes] | None:
    try:
        digest, content = (whole := file.read_bytes())[:DIGEST_SIZE], whole[DIGEST_SIZE:]
    except OSError:
        return None
    if digest != _digest(content):
        return None
    first, second = SIZES.unpack_from(content)
    information = content[SIZES.size :][:first]
    mapping = content[SIZES.size + first :][:second]
    return information, mapping


def _write(file: Path, description: tuple[bytes, bytes]) -> None:
    information, mapping = description
    content = SIZES.pack(len(information), len(mapping)) + information + mapping
    with suppress(OSError):  # then the next process works it out as well
        number, temporary = tempfile.mkstemp(dir=file.parent)
        try:
            with os.fdopen(number, "wb") as out:
                out.write(_digest(content) + content)
            os.replace(temporary, file)
        except OSError:
            os.unlink(temporary)


def _digest(content: bytes) -> bytes:
    return blake2b(content, digest_size=DIGEST_SIZE).digest()
