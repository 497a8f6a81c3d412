# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Checkpoints of learners: whole or not there, of a limited size, and never code. Needs torch."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any, TypeVar

import torch

from slap_ros.files import read_bytes, write_whole
from slap_ros.learning.work_folder import damaged

MAX_CHECKPOINT_BYTES = 2**30

Saved = TypeVar("Saved")


def save_checkpoint(path: Path, state: Mapping[str, Any]) -> None:
    """Write a checkpoint. One that is there stays whole until the new one is.

    Args:
        path: Path of the file to write.
        state: State of the learner: tensors and plain data, by name.

    Raises:
        OSError: It cannot be written; a full disk leaves the checkpoint before it.
    """
    whole = BytesIO()  # torch reports a full disk as a fault of its own
    torch.save(dict(state), whole)
    write_whole(path, whole.getvalue())


def load_checkpoint(
    path: Path, restore: Callable[[Mapping[str, Any]], Saved], advice: str
) -> Saved:
    """What :func:`save_checkpoint` wrote. Only tensors and plain data are read, never code.

    Args:
        path: Path of the file to read.
        restore: Function that converts the state into what is returned; it may raise any error.
        advice: Advice for a damaged file, in words.

    Raises:
        InvalidParameterError: It is damaged.
    """
    try:
        content = BytesIO(read_bytes(path, MAX_CHECKPOINT_BYTES))
        return restore(torch.load(content, weights_only=True))
    except Exception as error:  # torch says in a dozen ways that a file is damaged
        raise damaged(path, type(error).__name__, advice) from error
