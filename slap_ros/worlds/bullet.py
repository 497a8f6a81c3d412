# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PyBullet, imported without the line about its build time that it prints.

Everything of the project that uses PyBullet imports it from here. The extension prints with C's
``stdout`` and ``stderr``. While it is imported, these two variables point to files in memory; then
all but that line is printed. File descriptors 1 and 2 are left alone, so what Python prints in
other threads, and processes that they start meanwhile, are not affected.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from types import ModuleType

BUILD_TIME = b"pybullet build time"


def _imported() -> ModuleType:
    libc = ctypes.CDLL(None)
    # Only glibc documents that its standard streams may be assigned to.
    if "pybullet" in sys.modules or not hasattr(libc, "gnu_get_libc_version"):
        return import_module("pybullet")
    with _without_build_time(libc, "stdout"), _without_build_time(libc, "stderr"):
        return import_module("pybullet")


@contextmanager
def _without_build_time(libc: ctypes.CDLL, name: str) -> Iterator[None]:
    """Hold back what C code prints to a standard stream, then print it less that line."""
    libc.fdopen.restype = ctypes.c_void_p
    held_back = os.memfd_create(name)
    stream = ctypes.c_void_p.in_dll(libc, name)
    original, stream.value = ctypes.c_void_p(stream.value), libc.fdopen(held_back, b"w")
    substitute = ctypes.c_void_p(stream.value)
    try:
        yield
    finally:
        stream.value = original.value
        libc.fflush(substitute)  # never closed: another thread may be about to print to it
        printed = os.pread(held_back, os.fstat(held_back).st_size, 0).splitlines(keepends=True)
        libc.fputs(b"".join(x for x in printed if not x.startswith(BUILD_TIME)), original)
        libc.fflush(original)


pybullet: ModuleType = _imported()
PANDA = Path(str(files("pybullet_data"))) / "franka_panda"  # its URDF and meshes
