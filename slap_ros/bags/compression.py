# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What rosbag2 compresses: whole files (``--compression-mode file``) or single messages.

Both are zstd frames (RFC 8878). A message needs no metadata to be told: CDR begins with a zero
byte, a frame with another.
"""

from __future__ import annotations

import errno
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, BinaryIO, cast

from backports import zstd

from slap_ros.bags.raw import RawMessage, one_line
from slap_ros.bags.reading_budget import MAX_RECORD_BYTES, ReadingBudget
from slap_ros.errors import DamagedBagError, StorageFullError
from slap_ros.files import open_regular

SUFFIX = ".zstd"
MAGIC = b"\x28\xb5\x2f\xfd"
BLOCK_BYTES = 2**20  # that are unpacked at once
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
UNREADABLE = (zstd.ZstdError, EOFError, MemoryError)


def plain_name(name: str) -> str:
    """The name of a data file before it was compressed."""
    return name.removesuffix(SUFFIX)


@dataclass
class UnpackedFile:
    """A data file as it was before it was compressed.

    Args:
        path: Where it can be read for now.
        damage: Why the rest of it is missing; None if all of it is there.
    """

    path: Path
    damage: str | None = None


@contextmanager
def unpacked_file(path: Path, budget: ReadingBudget) -> Iterator[UnpackedFile]:
    """Unpack a data file for as long as it is read; one that is not compressed is left as it is.

    Args:
        path: Data file of a bag.
        budget: What may be unpacked.

    Raises:
        DamagedBagError: It cannot be opened, or unpacks to more than the budget allows.
        StorageFullError: The folder for temporary files has no room for it.
    """
    if path.suffix != SUFFIX:
        yield UnpackedFile(path)
        return
    with tempfile.NamedTemporaryFile(prefix="slap-bag-") as copy:
        damage = _unpack(path, copy, budget)
        yield UnpackedFile(Path(copy.name), damage)


def _unpack(path: Path, copy: IO[bytes], budget: ReadingBudget) -> str | None:
    """Unpack as much as there is; why it is not all."""
    try:
        damage = _copy_blocks(path, copy, budget)
        copy.flush()
    except OSError as error:
        if error.errno in NO_ROOM:
            raise StorageFullError(
                f"no room to unpack {path} in {tempfile.gettempdir()}: free some space, or set "
                "TMPDIR to another folder"
            ) from error
        raise DamagedBagError(f"{path} cannot be read: {error.strerror}") from error
    return damage


def _copy_blocks(path: Path, copy: IO[bytes], budget: ReadingBudget) -> str | None:
    try:
        with open_regular(path) as file, zstd.ZstdFile(file) as stream:
            # ``read`` would collect a block, and lose what precedes damage in it.
            while block := stream.read1(BLOCK_BYTES):
                budget.spend(len(block))
                copy.write(block)
    except UNREADABLE as error:
        return f"{path} cannot be unpacked to its end: {one_line(error)}"
    return None


@contextmanager
def open_data(path: Path) -> Iterator[BinaryIO]:
    """Open a data file for reading from its beginning, compressed or not.

    Raises:
        OSError: It cannot be opened, or is no regular file.
    """
    with open_regular(path) as file:
        if path.suffix != SUFFIX:
            yield file
            return
        with zstd.ZstdFile(file) as stream:
            yield cast(BinaryIO, stream)


def is_compressed(message: RawMessage) -> bool:
    """Whether a message was compressed by itself."""
    return message.data[: len(MAGIC)] == MAGIC


def unpacked_message(message: RawMessage, budget: ReadingBudget) -> RawMessage:
    """A message as it was before it was compressed; one that is not is left as it is.

    Args:
        message: Message of a bag.
        budget: What may be unpacked.

    Raises:
        DamagedBagError: It cannot be unpacked, or to more than is allowed.
    """
    if not is_compressed(message):
        return message
    most = min(MAX_RECORD_BYTES, budget.left) + 1  # one more than is allowed
    frame = zstd.ZstdDecompressor()
    try:
        data = frame.decompress(message.data, max_length=most)
    except UNREADABLE as error:
        raise _broken(message, one_line(error)) from error
    budget.spend(len(data))
    if len(data) > MAX_RECORD_BYTES:
        raise _broken(message, f"at most {MAX_RECORD_BYTES // 2**20} MiB are read at once")
    if not frame.eof:
        raise _broken(message, "it ends early")
    return message._replace(data=data)


def _broken(message: RawMessage, why: str) -> DamagedBagError:
    return DamagedBagError(f"a message on {message.channel.topic} cannot be unpacked: {why}")
