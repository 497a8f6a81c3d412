# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m tools.pictures [NAME...]``: make pictures of the documentation again."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from tools.imports import ROOT
from tools.pictures import (
    abstract_graph,
    animations,
    architecture,
    contact,
    growth,
    join,
    proposal,
    two_levels,
)

IMAGES = ROOT / "docs" / "images"
# Those that need nothing but this checkout. ``tools.pictures.report`` needs a browser, and
# ``tools.pictures.viewers`` a bag.
PICTURES: Mapping[str, Callable[[Path], None]] = {
    "abstract_graph.svg": abstract_graph.make,
    "architecture.svg": architecture.make,
    "cleanup_table.gif": animations.make_table,
    "cluttered_drawer.gif": animations.make_drawer,
    "contact_drawer.gif": contact.make_drawer,
    "contact_lid.gif": contact.make_lid,
    "contact_peg.gif": contact.make_peg,
    "growth.svg": growth.make,
    "join.gif": join.make,
    "proposal.svg": proposal.make,
    "side_by_side.gif": animations.make_side_by_side,
    "two_levels.svg": two_levels.make,
}


def main(names: Sequence[str]) -> int:
    """Make the pictures of these names, or all of them.

    Returns:
        The exit code: 2 if there is no picture of some name.
    """
    wanted = [name for name in PICTURES if not names or Path(name).stem in names]
    if len(wanted) < len(names):
        known = ", ".join(Path(name).stem for name in PICTURES)
        sys.stderr.write(f"there is no such picture; there are {known}\n")
        return 2
    for name in wanted:
        PICTURES[name](IMAGES / name)
        sys.stdout.write(f"{IMAGES / name}: {(IMAGES / name).stat().st_size} bytes\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
