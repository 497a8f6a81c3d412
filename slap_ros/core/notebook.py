# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How objects of any floor show themselves in a notebook and at Python's prompt.

A plan belongs to a lower floor than the drawing of plans, so it cannot import what draws it. That
is looked up by its name when a notebook first asks, and costs nothing where none does.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

DRAWN_BY = "slap_ros.api.notebook"  # has svg_of and html_of


class ShownInNotebooks:
    """Shows an object as :mod:`slap_ros.api.notebook` draws its type; as text where it does not.

    The text is that of ``print``, at Python's prompt as well: all fields of a domain or a plan are
    many pages.
    """

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self}>"

    def _repr_mimebundle_(self, **_: Any) -> dict[str, str]:
        return {"text/plain": str(self)}  # pictures are added by the methods below

    def _repr_svg_(self) -> str | None:
        shown: str | None = import_module(DRAWN_BY).svg_of(self)
        return shown

    def _repr_html_(self) -> str | None:
        shown: str | None = import_module(DRAWN_BY).html_of(self)
        return shown
