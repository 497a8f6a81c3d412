# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap report``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from slap_ros.cli.console import console, styled
from slap_ros.errors import ErrorCode
from slap_ros.report import check_output, read_report, render, write_page


def report(
    bags: Annotated[
        list[Path],
        typer.Argument(metavar="BAG", help="Folders of bags, or single .mcap or .db3 files."),
    ],
    output: Annotated[Path, typer.Option(help=".html file to write.")],
    namespace: Annotated[
        str | None,
        typer.Option(
            help="Namespace of one ensemble, such as /robot1, where a bag has several. "
            "Default: all of them."
        ),
    ] = None,
) -> int:
    """Report a run, or compare several, on one page that opens in any browser."""
    check_output(output)
    return write_report(bags, output, namespace)


def write_report(bags: Sequence[Path], output: Path, namespace: str | None = None) -> int:
    """Write a page about the runs in bags.

    Args:
        bags: Folders of the bags, or single files.
        output: Page to write.
        namespace: Namespace of an ensemble; None for all ensembles.

    Returns:
        The exit code, as ``slap bag evaluate`` has it for the same bags.

    Raises:
        SlapError: A bag cannot be read, or the page not be written; there is no page then.
    """
    with console.status("writing the report"):
        found = [read_report(bag, namespace) for bag in bags]
        write_page(output, render(found))
    console.print(f"report: {output}")
    for bag in found:
        if bag.evaluation.damage is not None:
            console.print(styled("damaged", "yellow", f": {bag.evaluation.damage}"))
    if any(bag.evaluation.mismatches for bag in found):
        return int(ErrorCode.REPLAY_MISMATCH)
    return int(ErrorCode.DAMAGED_BAG) if any(bag.evaluation.damage for bag in found) else 0
