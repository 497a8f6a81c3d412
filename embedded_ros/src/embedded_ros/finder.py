# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Makes ``rclpy`` and the interface packages importable where there is no ROS 2.

The finder is *appended* to ``sys.meta_path``: whatever any other finder knows wins. And where a
real rclpy is importable it provides nothing at all, because half of one ROS 2 and half of
another would not work together.

This module is imported at every interpreter start by ``embedded_ros.pth``: standard library
only, and as little of it as possible.
"""

from __future__ import annotations

import sys
from _thread import get_ident
from importlib.machinery import ModuleSpec

TYPE_CHECKING = False  # typing.TYPE_CHECKING without the cost of importing typing
if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import ModuleType

_KINDS = ("msg", "srv", "action")
# Asked for by Python's own start-up, every time.
_NEVER_OURS = frozenset({"sitecustomize", "usercustomize"})


class EmbeddedRosFinder:
    """A meta path finder for rclpy, rclpy's submodules and interface packages."""

    def __init__(self) -> None:
        self._searching: set[int] = set()  # threads

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find a module's spec, or None where it is not ours.

        Raises:
            ModuleNotFoundError: The name is ROS 2's but cannot be had here; says why.
        """
        top, _, rest = name.partition(".")
        if get_ident() in self._searching or not _could_be_ros(top):
            return None
        # What is imported while searching must not be searched for here.
        self._searching.add(get_ident())
        try:
            return self._find(name, top, rest)
        finally:
            self._searching.discard(get_ident())

    def _find(self, name: str, top: str, rest: str) -> ModuleSpec | None:
        if top in ("rclpy", "rosidl_runtime_py"):
            return self._library(top, rest)
        from . import sources

        if not sources.is_interface_package(top):
            return None
        if _real_rclpy_is_importable():
            raise ModuleNotFoundError(
                f"No module named {name!r}: ROS 2's own rclpy is in use here; "
                f"build {top} with colcon, or install its package",
                name=name,
            )
        return self._interfaces(top, rest)

    def _library(self, top: str, rest: str) -> ModuleSpec | None:
        if rest:
            module = sys.modules.get(top)
            if module is None or not _is_ours(module):
                return None
            raise ModuleNotFoundError(
                f"No module named '{top}.{rest}': it is not part of embedded_ros; "
                "source a ROS 2 to use it",
                name=f"{top}.{rest}",
            )
        if _real_rclpy_is_importable():
            return None
        import os
        from importlib.util import spec_from_file_location

        folder = os.path.join(os.path.dirname(__file__), top)
        return spec_from_file_location(
            top, os.path.join(folder, "__init__.py"), submodule_search_locations=[folder]
        )

    def _interfaces(self, package: str, rest: str) -> ModuleSpec | None:
        if rest and rest not in _KINDS:
            return None
        from .types.modules import InterfaceLoader

        name = f"{package}.{rest}" if rest else package
        return ModuleSpec(name, InterfaceLoader(), origin="embedded_ros", is_package=not rest)


def install() -> None:
    """Append the finder to ``sys.meta_path``, once."""
    if not any(isinstance(finder, EmbeddedRosFinder) for finder in sys.meta_path):
        sys.meta_path.append(EmbeddedRosFinder())


def _could_be_ros(top: str) -> bool:
    # ROS 2 package names are lower case and begin with a letter. The standard library tries to
    # import modules of other platforms ("msvcrt"), always in vain.
    return (
        top[:1].isalpha()
        and top.islower()
        and top not in _NEVER_OURS
        and top not in sys.stdlib_module_names
    )


def _is_ours(module: ModuleType) -> bool:
    import os

    file = getattr(module, "__file__", None) or ""
    return file.startswith(os.path.dirname(__file__) + os.sep)


def _real_rclpy_is_importable() -> bool:
    loaded = sys.modules.get("rclpy")
    if loaded is not None:
        return not _is_ours(loaded)
    for finder in sys.meta_path:
        if isinstance(finder, EmbeddedRosFinder):
            continue
        find_spec = getattr(finder, "find_spec", None)
        spec = find_spec("rclpy", None) if find_spec else None
        # A namespace package (some folder named "rclpy" on the path) is no rclpy.
        if spec is not None and spec.loader is not None and spec.origin is not None:
            return True
    return False
