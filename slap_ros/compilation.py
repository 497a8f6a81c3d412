# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How Python becomes machine code: the only module that imports numba.

Neither fast-math nor fused products and sums: every operation is rounded as IEEE 754 says, so that
the results are the same on every processor.

Machine code is kept in the user's cache, in a folder of its own for these sources, this numba and
this processor. numba alone looks at one file only, so that it would call what another file had
before a change, and processors that share a home would overwrite each other's code. It would also
look at where the file is and how old, and compile the same sources again in each checkout.
"""

from __future__ import annotations

import fcntl
import importlib
import logging
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from hashlib import blake2b
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from llvmlite import binding
from numba.core import caching
from numba.np import linalg

from slap_ros.files import user_cache

Function = TypeVar("Function", bound=Callable[..., object])

COMPLETE = "complete"  # a file that is written once motion planning is compiled
# The compiled functions' files, and those with constants that are compiled in.
SOURCES = (
    "compilation.py",
    "motion/**/*.py",
    "policies/kernels.py",
    "domains/classifiers.py",
    "domains/obstacle2d/kernels.py",
    "domains/obstacle_tower/kernels.py",
    "domains/obstacle_tower/support.py",
    "shortcuts/kernels.py",
    "portable_math.py",
    "geometry/box_separation.py",
    "geometry/oriented_box.py",
    "geometry/pose.py",
    "worlds/panda.py",
    "worlds/joint_space/arm.py",
    "worlds/joint_space/drive.py",
    "worlds/joint_space/kernels.py",
    "worlds/joint_space/links.py",
)
_config: Any = numba.config
logger = logging.getLogger(__name__)

if _config.DISABLE_JIT:  # these functions as plain Python are slower than numpy
    raise ImportError("numba compiles nothing: NUMBA_DISABLE_JIT is set")


def _load_without_blas() -> None:
    """Let numba load its array functions, for which it would import scipy for a third of a second.

    scipy has the matrix products that numba knows. No compiled function calls them.
    """

    def nothing() -> None:
        raise ImportError

    look_for_blas = getattr(linalg, "ensure_blas", nothing)
    linalg.ensure_blas = nothing
    try:
        importlib.import_module("numba.np.arraymath")
    finally:
        linalg.ensure_blas = look_for_blas


_load_without_blas()


def inner(function: Function) -> Function:
    """A function that other compiled ones call; it becomes a part of them."""
    return cast(Function, numba.njit(fastmath=False, error_model="numpy")(function))


def compiled(function: Function) -> Function:
    """A function that Python calls: compiled once, then loaded from the user's cache."""
    made: Any = inner(function)
    if cache_folder() is not None:
        made._cache = _KeptFunction(function)
        _spare(made._cache)
    return cast(Function, made)


@dataclass(frozen=True)
class _Place:
    """Where numba keeps the machine code of a function: the folder says what it was made from."""

    folder: Path
    module: str

    @classmethod
    def from_function(cls, function: Any, file: str) -> _Place:  # noqa: ARG003
        folder = cache_folder()
        assert folder is not None  # else nothing is kept
        return cls(folder, function.__module__)

    def ensure_cache_path(self) -> None:
        """Do nothing: the folder is there."""

    def get_cache_path(self) -> str:
        return str(self.folder)

    def get_source_stamp(self) -> str:
        return ""

    def get_disambiguator(self) -> str:
        return self.module


class _KeptCode(caching.CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (_Place,)


class _KeptFunction(caching.FunctionCache):  # type: ignore[misc]
    _impl_class = _KeptCode


def _spare(machine_code: Any) -> None:
    """Let a function run whose machine code cannot be kept: a full disk must not end a run."""
    save = machine_code.save_overload

    def save_or_say(signature: object, code: object) -> None:
        try:
            save(signature, code)
        except OSError as error:
            logger.warning("machine code is not kept, and compiled again next time: %s", error)

    machine_code.save_overload = save_or_say


def is_compiled() -> bool:
    """Whether all of motion planning is in the cache, or can never be."""
    folder = cache_folder()
    return folder is None or (folder / COMPLETE).exists()


def compile_once(calls: Iterable[Callable[[], object]]) -> None:
    """Compile everything unless it is in the cache; one process does, and others wait for it.

    Args:
        calls: A call of every compiled function.
    """
    folder = cache_folder()
    if folder is None:
        logger.warning(
            "machine code cannot be kept in %s: this process compiles motion planning for itself, "
            "for up to half a minute. Set XDG_CACHE_HOME to a folder that can be written",
            _cache(),
        )
        return
    if is_compiled():
        return
    with _lock(folder):
        if not is_compiled():
            logger.warning("compiling motion planning for this processor, once: half a minute")
            for call in calls:
                call()
            (folder / COMPLETE).touch()


@cache
def cache_folder() -> Path | None:
    """The folder of the machine code; None where none can be written."""
    folder = _cache() / _digest()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)  # it is executed
    except OSError:
        return None
    return folder if os.access(folder, os.W_OK) else None


def _cache() -> Path:
    """The folder of all machine code, of other versions and processors too."""
    return Path(_config.CACHE_DIR) if _config.CACHE_DIR else user_cache("kernels")


def _digest() -> str:
    """Of all that machine code is made from."""
    digest = blake2b(digest_size=8)
    package = Path(__file__).parent
    for source in _sources(package):
        content = source.read_bytes()
        digest.update(f"{source.relative_to(package)} {len(content)}\n".encode() + content)
    processor = binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()
    chosen = _config.CPU_NAME, _config.CPU_FEATURES
    digest.update(repr((numba.__version__, processor, chosen)).encode())
    return digest.hexdigest()


def _sources(package: Path) -> list[Path]:
    return sorted(file for pattern in SOURCES for file in package.glob(pattern))


@contextmanager
def _lock(folder: Path) -> Iterator[None]:
    """Be the only process within; it is released when this one ends, however it ends."""
    with (folder / "lock").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
