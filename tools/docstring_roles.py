# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Docstrings' ``:class:`Name``` and their like, as links of the API reference where they lead."""

from __future__ import annotations

import re
from functools import partial
from typing import Any

import griffe

ROLE = re.compile(r":[a-z]+:`~?(?P<name>[\w.]+)`")
OURS = "slap_ros."


class Roles(griffe.Extension):
    """Rewrites the roles in the docstrings of a package that was loaded."""

    def on_package(self, *, pkg: griffe.Module, **_: Any) -> None:
        """See :class:`griffe.Extension`."""
        for obj in _documented(pkg):
            if obj.docstring is not None:
                obj.docstring.value = ROLE.sub(partial(_link, obj), obj.docstring.value)


def _documented(obj: griffe.Object) -> list[griffe.Object]:
    inner = [each for each in obj.members.values() if isinstance(each, griffe.Object)]
    return [obj, *(found for each in inner for found in _documented(each))]


def _link(obj: griffe.Object, role: re.Match[str]) -> str:
    """A link to what a name means where it is used; the name alone if it leads out of the API."""
    name = role["name"]
    shown = f"`{name.removeprefix(OURS)}`"
    try:
        path = name if name.startswith(OURS) else obj.resolve(name)
        found = obj.modules_collection[path]
        target = found.final_target if found.is_alias else found
    except (KeyError, griffe.NameResolutionError, griffe.AliasResolutionError):
        return shown
    return f"[{shown}][{target.path}]" if target.has_docstring else shown
