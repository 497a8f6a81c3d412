# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap study``: a command for each study of the registry, and one for the tables of pages."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from slap_ros.cli.console import console, exits
from slap_ros.cli.options import flat_options
from slap_ros.cli.study_report import make_report
from slap_ros.files import read_text, write_whole
from slap_ros.studies.options import RESULTS
from slap_ros.studies.readme import with_tables
from slap_ros.studies.registry import STUDIES
from slap_ros.studies.study import Study

TABLES_IN = (
    "README.md",
    "docs/presets.md",
    "docs/reproducing.md",
    "docs/results/README.md",
    "docs/results/growth_stack_at_target.md",
    "docs/skill-figures.md",
)
PAGES = [Path(page) for page in TABLES_IN]  # with tables made of results

app = typer.Typer(
    help="Make a figure of the papers again: data, a picture and a page. After an interruption, "
    "the same command goes on where the study stopped.",
    no_args_is_help=True,
)


def _command(study: Study[Any]) -> Callable[..., None]:
    """The command that makes a study's report."""

    def make(*, options: Any) -> None:
        make_report(study, options)

    make.__annotations__["options"] = study.options  # where the options are read from
    return exits(flat_options(make))


for _study in STUDIES.values():
    app.command(_study.name, help=_study.help, epilog=f"Example: {_study.example}")(
        _command(_study)
    )


@app.command("readme")
@exits
def readme(
    pages: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="PAGE", help="Markdown pages to update. Default: all pages with tables."
        ),
    ] = None,
    results: Annotated[Path, typer.Option(help="Folder of the studies' data.")] = RESULTS,
) -> None:
    """Update the tables of pages from the data of studies."""
    for page in pages or PAGES:
        text = read_text(page)
        written = with_tables(text, results)
        if written != text:
            write_whole(page, written)
        console.print(f"{page}: {'changed' if written != text else 'as it was'}")
