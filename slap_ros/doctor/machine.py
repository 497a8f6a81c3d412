# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Python, disk, limits, processors and memory."""

from __future__ import annotations

import os
import platform
import resource
import shutil
import sys
import tempfile
from pathlib import Path

import psutil

from slap_ros.doctor.check import Check

PYTHONS = ((3, 11), (3, 12))
MIB, GIB = 2**20, 2**30
LEAST_DISK, ENOUGH_DISK = 100 * MIB, GIB
LEAST_FILES, ENOUGH_FILES = 256, 1024  # a node of the ensemble has about 40 open
LEAST_MEMORY, ENOUGH_MEMORY = 512 * MIB, 2 * GIB  # an ensemble takes about 400 MiB
ENOUGH_PROCESSORS = 2


def python_version() -> Check:
    """The versions that ROS 2 Jazzy and our libraries have in common."""
    found = f"{platform.python_implementation()} {platform.python_version()}"
    if sys.version_info[:2] in PYTHONS:
        return Check("Python", "ok", found)
    return Check("Python", "problem", found, "Use Python 3.12, ROS 2 Jazzy's own, or 3.11.")


def disk_space(folder: Path) -> Check:
    """Room where runs are recorded."""
    name, there = "Disk space for runs", nearest_existing(folder)
    try:
        free = shutil.disk_usage(there).free
    except OSError as error:
        return Check(name, "problem", f"{there}: {error.strerror}", _ELSEWHERE)
    found = f"{_amount(free)} free in {there.resolve()}"
    if free < LEAST_DISK:
        return Check(name, "problem", found, f"Make room. {_ELSEWHERE}")
    if free < ENOUGH_DISK:
        return Check(name, "warning", found, "Make room before recording many runs.")
    return Check(name, "ok", found)


def write_permission(folder: Path) -> Check:
    """Whether runs can be recorded: found out by writing a file that vanishes at once."""
    name, there = "Write permission for runs", nearest_existing(folder)
    try:
        with tempfile.TemporaryFile(dir=there) as file:
            file.write(b"slap_ros")
    except OSError as error:
        found = f"cannot write in {there.resolve()}: {error.strerror}"
        return Check(name, "problem", found, _ELSEWHERE)
    return Check(name, "ok", f"can write in {there.resolve()}")


def open_files() -> Check:
    """How many files and sockets a process may have open."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    found, name = f"{_limit(soft)} a process", "Open-file limit"
    if soft == resource.RLIM_INFINITY or soft >= ENOUGH_FILES:
        return Check(name, "ok", found)
    may = hard == resource.RLIM_INFINITY or hard >= ENOUGH_FILES
    advice = f"ulimit -n {ENOUGH_FILES}" if may else "Ask whoever runs this machine for more."
    return Check(name, "problem" if soft < LEAST_FILES else "warning", found, advice)


def processors_and_memory() -> Check:
    """Enough of both for an ensemble."""
    name = "Processors and memory"
    processors, free = len(os.sched_getaffinity(0)), psutil.virtual_memory().available
    found = f"{processors} processors, {_amount(free)} of memory available"
    if free < LEAST_MEMORY:
        return Check(name, "problem", found, "Close other programs, or add memory.")
    if free < ENOUGH_MEMORY:
        return Check(name, "warning", found, "Close other programs before training.")
    if processors < ENOUGH_PROCESSORS:
        advice = "The ensemble will be slow: its nodes take turns on one processor."
        return Check(name, "warning", found, advice)
    return Check(name, "ok", found)


_ELSEWHERE = "Record runs in another folder."


def nearest_existing(folder: Path) -> Path:
    """The folder, or the nearest above it that exists: where it would be made."""
    for candidate in (folder.absolute(), *folder.absolute().parents):
        if os.path.lexists(candidate):
            return candidate
    return Path("/")


def _amount(size: int) -> str:
    return f"{size / GIB:.1f} GiB" if size >= GIB else f"{size / MIB:.0f} MiB"


def _limit(value: int) -> str:
    return "any number" if value == resource.RLIM_INFINITY else str(value)
