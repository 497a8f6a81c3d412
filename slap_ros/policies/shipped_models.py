# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The folders of the libraries that ship with the package."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import slap_ros

SHARE = Path("share") / "slap_ros"  # folder of shared files under an installation's prefix


def model_roots() -> Iterator[Path]:
    """The folders ``models`` that may exist: beside the package in a checkout, else installed."""
    yield Path(slap_ros.__file__).resolve().parent.parent / "models"
    overlays = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    for prefix in [*filter(None, overlays), sys.prefix]:
        yield Path(prefix) / SHARE / "models"


def shipped_folder(*names: str) -> Path | None:
    """The first folder of this path below one of :func:`model_roots`, if there is one."""
    folders = (root.joinpath(*names) for root in model_roots())
    return next((folder for folder in folders if folder.is_dir()), None)


def shipped_with_siblings(*names: str) -> list[Path]:
    """The shipped folder of this path, and those of libraries that other seeds trained.

    They were trained alike, and show how much a training depends on its seed.
    """
    siblings = (sorted(root.joinpath("seeds", *names).glob("[0-9]*")) for root in model_roots())
    folders = [shipped_folder(*names), *next(filter(None, siblings), [])]
    return [folder for folder in folders if folder is not None]
