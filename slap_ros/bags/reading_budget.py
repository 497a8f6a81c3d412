# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The budget of one reading of a bag: how much its files may grow where they are unpacked.

Memory and time grow with the bytes that are deserialised. A plain bag has no more of them than its
files; what is compressed may have any number, so that it is counted over all files, chunks and
messages of a bag.
"""

from __future__ import annotations

from pathlib import Path

from slap_ros.errors import DamagedBagError

MAX_RECORD_BYTES = 256 * 2**20  # of a record or message, and of a chunk uncompressed
# Recordings of the shipped domains shrink to a tenth to a thirteenth of their size by zstd.
MAX_GROWTH = 50  # bytes unpacked per byte on the disk,
FREE_BYTES = 64 * 2**20  # beside so many, in which small bags may be as regular as they like


class ReadingBudget:
    """Counts what one reading of a bag unpacks."""

    def __init__(self, path: Path, size_bytes: int) -> None:
        """Begin a reading.

        Args:
            path: Folder or file of the bag, for the complaint.
            size_bytes: Size of its files, bytes.
        """
        self._path = path
        self.limit = FREE_BYTES + MAX_GROWTH * size_bytes
        self._spent = 0

    @property
    def left(self) -> int:
        """Bytes that may still be unpacked."""
        return self.limit - self._spent

    def spend(self, count: int) -> None:
        """Count bytes that are unpacked, before or right after they are.

        Raises:
            DamagedBagError: The bag unpacks to more than it may.
        """
        self._spent += count
        if self._spent > self.limit:
            raise DamagedBagError(
                f"{self._path} unpacks to more than {self.limit // 2**20} MiB, "
                f"{MAX_GROWTH} times its size and {FREE_BYTES // 2**20} MiB; "
                "if you trust it, unpack it with `unzstd` or `ros2 bag convert` and read that"
            )
