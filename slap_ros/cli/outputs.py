# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Files that a command writes into a folder that the user names."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from slap_ros.errors import StorageFullError
from slap_ros.files import write_whole


def write_files(folder: Path, texts: Mapping[str, str]) -> list[Path]:
    """Write texts, in place of earlier files of the same names.

    Args:
        folder: Folder of the files, which is made where there is none.
        texts: Text of each file, by name.

    Returns:
        Paths of the files.

    Raises:
        StorageFullError: One cannot be written.
    """
    try:
        for name, text in texts.items():
            write_whole(folder / name, text)
    except OSError as error:
        raise StorageFullError(f"cannot write to {folder}: {error.strerror}") from error
    return [folder / name for name in texts]
