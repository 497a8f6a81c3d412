# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ways in which a file is damaged: a function of its bytes and of a random number generator."""


def flip(data, rng):
    """A few bits."""
    damaged = bytearray(data)
    for _ in range(rng.choice((1, 1, 3))):
        damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
    return bytes(damaged)


def cut(data, rng):
    """What follows some byte."""
    return data[: rng.randrange(len(data))]


def zero(data, rng):
    """A stretch that was never written."""
    start, end = _stretch(data, rng)
    return data[:start] + bytes(end - start) + data[end:]


def remove(data, rng):
    """A stretch that is missing."""
    start, end = _stretch(data, rng)
    return data[:start] + data[end:]


def duplicate(data, rng):
    """A stretch that was written twice."""
    start, end = _stretch(data, rng)
    return data[:end] + data[start:]


def scribble(data, rng):
    """A stretch with something else in it."""
    start, end = _stretch(data, rng)
    return data[:start] + rng.randbytes(end - start) + data[end:]


def _stretch(data, rng):
    start = rng.randrange(len(data))
    return start, min(len(data), start + rng.choice((1, 4, 30, 500)))


DAMAGES = (flip, cut, zero, remove, duplicate, scribble)
