# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A flipped bit is found wherever it is; two are never taken for one."""

from __future__ import annotations

import random
import zlib

import pytest

from slap_ros.bags.bit_correction import CORRECTABLE_BYTES, flipped_bit, with_flipped_bit


def block(size: int) -> memoryview:
    return memoryview(random.Random(size).randbytes(size))


@pytest.mark.parametrize("size", [1, 2, 7, 100])
def test_every_flipped_bit_is_found(size: int) -> None:
    data = block(size)
    for place in range(8 * size):
        damaged = with_flipped_bit(data, place)
        assert damaged != data
        assert flipped_bit(damaged, zlib.crc32(data)) == place
        assert with_flipped_bit(damaged, place) == data


@pytest.mark.parametrize("place", [0, 1, 4000, 8 * CORRECTABLE_BYTES - 1])
def test_a_flipped_bit_is_found_in_the_longest_block(place: int) -> None:
    data = block(CORRECTABLE_BYTES)
    assert flipped_bit(with_flipped_bit(data, place), zlib.crc32(data)) == place


def test_a_flipped_bit_of_the_checksum_leaves_the_block_as_it_is() -> None:
    data = block(50)
    for bit in range(32):
        place = flipped_bit(data, zlib.crc32(data) ^ 1 << bit)
        assert place == 8 * len(data) + bit
        assert with_flipped_bit(data, place) == data


def test_two_flipped_bits_are_not_taken_for_one() -> None:
    data, rng = block(CORRECTABLE_BYTES), random.Random(1)
    for _ in range(40):
        damaged = data
        for place in rng.sample(range(8 * len(data)), 2):
            damaged = with_flipped_bit(damaged, place)
        assert flipped_bit(damaged, zlib.crc32(data)) is None


def test_nothing_is_found_in_sound_blocks_nor_in_longer_ones() -> None:
    assert flipped_bit(block(100), zlib.crc32(block(100))) is None
    assert flipped_bit(block(0), 0) is None
    data = block(CORRECTABLE_BYTES + 1)
    assert flipped_bit(with_flipped_bit(data, 0), zlib.crc32(data)) is None
