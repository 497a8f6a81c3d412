# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The transitions of a replay buffer as arrays, for checkpoints. Needs torch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from numpy.typing import NDArray
from stable_baselines3.common.buffers import DictReplayBuffer

PARTS = ("actions", "rewards", "dones", "timeouts")


def transitions_of(
    buffer: DictReplayBuffer, parts: Sequence[str] = PARTS
) -> dict[str, NDArray[Any]]:
    """All transitions of a buffer, by name.

    Args:
        buffer: Buffer of observations that have parts.
        parts: Names of the arrays that it has beside observations.
    """
    used = buffer.buffer_size if buffer.full else buffer.pos
    found = {name: getattr(buffer, name)[:used] for name in parts}
    for name in buffer.observations:
        found[f"observations.{name}"] = buffer.observations[name][:used]
        found[f"next.{name}"] = buffer.next_observations[name][:used]
    return found


def restore_transitions(
    buffer: DictReplayBuffer,
    arrays: Mapping[str, NDArray[Any]],
    parts: Sequence[str] = PARTS,
) -> None:
    """Put transitions back into a buffer that is empty.

    Args:
        buffer: Buffer of the same observations and the same size.
        arrays: Arrays of :func:`transitions_of`.
        parts: Names of the arrays that it has beside observations.

    Raises:
        KeyError, ValueError: The arrays are of another buffer.
    """
    used = len(arrays["rewards"])
    for name in parts:
        getattr(buffer, name)[:used] = arrays[name]
    for name in buffer.observations:
        buffer.observations[name][:used] = arrays[f"observations.{name}"]
        buffer.next_observations[name][:used] = arrays[f"next.{name}"]
    buffer.full, buffer.pos = used == buffer.buffer_size, used % buffer.buffer_size
