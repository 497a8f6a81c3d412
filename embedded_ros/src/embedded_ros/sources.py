# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which interface packages exist, found without parsing or importing any of them.

Kept light: :mod:`embedded_ros.finder` imports it when an import falls through to it.
"""

from __future__ import annotations

import functools
import os
import sys

ENTRY_POINT_GROUP = "embedded_ros.interfaces"
ENVIRONMENT_VARIABLE = "EMBEDDED_ROS_INTERFACES"


def from_environment() -> list[tuple[str, str]]:
    """The ``(package, directory)`` pairs of ``EMBEDDED_ROS_INTERFACES``.

    Raises:
        ValueError: An entry is not of the form ``name=directory``.
    """
    entries = [e for e in os.environ.get(ENVIRONMENT_VARIABLE, "").split(os.pathsep) if e]
    pairs = []
    for entry in entries:
        name, separator, directory = entry.partition("=")
        if not (name and separator and directory):
            raise ValueError(f"{ENVIRONMENT_VARIABLE}: {entry!r} is not of the form name=directory")
        pairs.append((name, directory))
    return pairs


def from_entry_points() -> dict[str, str]:
    """Module paths by interface package name, from installed distributions."""
    return _scan_entry_points(tuple(sys.path))


@functools.cache
def shipped() -> frozenset[str]:
    """The packages with text in ``embedded_ros/interfaces``."""
    folder = os.path.join(os.path.dirname(__file__), "interfaces")
    return frozenset(entry.name for entry in os.scandir(folder) if entry.is_dir())


def is_interface_package(name: str) -> bool:
    """Whether some source has an interface package of this name; cheap answers first."""
    return (
        name in shipped()
        or any(name == package for package, _ in from_environment())
        or name in from_entry_points()
    )


@functools.cache
def _scan_entry_points(path: tuple[str, ...]) -> dict[str, str]:
    """What importlib.metadata would find, in 2 ms instead of 30: any failing import pays it."""
    found: dict[str, str] = {}
    for folder in path:
        try:
            names = sorted(os.listdir(folder or "."))
        except OSError:
            continue  # a zip file, or not there
        for name in names:
            if name.endswith((".dist-info", ".egg-info")):
                for package, module in _read_entry_points(os.path.join(folder, name)):
                    found.setdefault(package, module)
    return found


def _read_entry_points(metadata_folder: str) -> list[tuple[str, str]]:
    try:
        with open(os.path.join(metadata_folder, "entry_points.txt"), encoding="utf-8") as file:
            text = file.read()
    except OSError:
        return []  # the file is optional
    _, header, rest = text.partition(f"[{ENTRY_POINT_GROUP}]")
    section = rest.partition("\n[")[0] if header else ""
    pairs = (line.partition("=") for line in section.splitlines() if not line.startswith("#"))
    return [(name.strip(), module.strip()) for name, equals, module in pairs if equals]
