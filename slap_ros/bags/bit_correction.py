# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One flipped bit, found by the CRC-32 that should notice it.

A CRC is linear: what a flipped bit changes in it depends on the bit's place alone, and is another
value for every place. Up to :data:`CORRECTABLE_BYTES`, any two valid blocks differ in four bits or
more (P. Koopman, "32-bit cyclic redundancy codes for internet applications", 2002). So no two
flipped bits look like one. Larger damage does by chance, in at most one of 46,000 cases.
"""

from __future__ import annotations

import zlib

POLYNOMIAL = 0xEDB88320  # of CRC-32, its least significant bit first
CORRECTABLE_BYTES = 91_607 // 8


def flipped_bit(data: memoryview, crc: int) -> int | None:
    """Find the one bit that makes a checksum wrong.

    Args:
        data: Block of bytes.
        crc: CRC-32 that it should have, itself perhaps damaged.

    Returns:
        Place of the bit, from 0, the least significant one of the first byte. From
        ``8 * len(data)`` on it is one of the checksum. None where there is no such bit, where
        none is wrong, or where the block is too long to tell.
    """
    syndrome = zlib.crc32(data) ^ crc
    if not syndrome or len(data) > CORRECTABLE_BYTES:
        return None
    last = 8 * len(data) + 31
    changed = 1 << 31  # in the CRC, by the last bit of it
    for place in range(last, -1, -1):
        if changed == syndrome:
            return place
        changed = changed >> 1 ^ (POLYNOMIAL if changed & 1 else 0)
    return None


def with_flipped_bit(data: memoryview, place: int) -> memoryview:
    """A copy of a block with one bit flipped; as it is where the bit is not one of the block."""
    if place >= 8 * len(data):
        return data
    copy = bytearray(data)
    copy[place // 8] ^= 1 << place % 8
    return memoryview(copy)
