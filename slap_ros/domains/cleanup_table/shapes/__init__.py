# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What lies on the table, as OBJ files of convex pieces; ``make`` made them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import files
from types import MappingProxyType

from slap_ros.meshes.obj import from_obj
from slap_ros.meshes.solid import Solid

TOYS = ("duck", "toy_robot", "dinosaur")
WIPER = "wiper"


@lru_cache(maxsize=1)
def shipped() -> Mapping[str, Solid]:
    """The toys and the wiper by name. They stand upright: x to the front, z up."""
    folder = files(__package__)
    return MappingProxyType(
        {
            name: Solid.of(from_obj((folder / f"{name}.obj").read_text(encoding="utf-8")))
            for name in (*TOYS, WIPER)
        }
    )
