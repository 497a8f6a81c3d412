# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every published figure again: ``make reproduce``, or ``python -m tools.reproduce [NAME...]``.

Each file of ``docs/results`` has the command that made it. The commands are run again, their
results go to ``runs/reproduced``, and both are compared but for times. What is there already is not
made again, so whoever stops it goes on with the same command. ``--list`` says what would be done.
"""

from __future__ import annotations

import argparse
import json
import shlex
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from time import monotonic
from typing import Any

from slap_ros.domains import get_domain
from slap_ros.shortcuts.shipped import shipped_library
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.studies.reproducing import NOT_MEASURED, TRAINING_MINUTES, published
from slap_ros.studies.trained_baselines import BASELINES
from tools.imports import ROOT

PUBLISHED = ROOT / "docs" / "results"
OUTPUT = Path("runs") / "reproduced"


@dataclass(frozen=True)
class Figure:
    """A published figure or table.

    Args:
        name: Name of the figure's files.
        source: Figure of a paper that it reproduces; empty for those of no paper.
        command: Command that made the figure.
        found: Numbers of the figure, as JSON data.
        measured: Seconds of one core that the command took, or None, and what of it they are.
        training: Command that made the work folder that the figure reads, if it reads one.
    """

    name: str
    source: str
    command: str
    found: Any
    measured: tuple[float | None, str]
    training: tuple[str, ...] = ()

    @property
    def again(self) -> Path:
        """Path of the data that are made again."""
        return OUTPUT / f"{self.name}.json"

    @property
    def made(self) -> bool:
        """Whether the data are made already; the study does not replace those of other commands."""
        if not self.again.exists():
            return False
        command = json.loads(self.again.read_text(encoding="utf-8")).get("command")
        return bool(command == self.command)

    @property
    def trainings(self) -> list[tuple[str, ...]]:
        """Commands that make the folders that the figure reads, where they are missing."""
        words = shlex.split(self.command)
        folders = [Path(after) for word, after in pairwise(words) if word == "--work"]
        own = [self.training for folder in folders if not folder.is_dir()]
        return own + [
            (*shlex.split(one["command"]), "--output", str(Path(BASELINES) / one["name"]))
            for one in self.baselines
        ]

    @property
    def baselines(self) -> list[dict[str, Any]]:
        """What the figure says of the baselines that it compares with, where they are missing.

        A command that names none compares with those that ship.
        """
        if "--against" not in shlex.split(self.command):
            return []
        rows = self.found.get("rows", ()) if isinstance(self.found, dict) else ()
        trained = [one for row in rows for one in row.get("trained", ())]
        return [one for one in trained if not (Path(BASELINES) / one["name"]).is_dir()]

    @property
    def training_minutes(self) -> int:
        """Minutes of one core that the missing trainings take."""
        seconds = sum(float(one["cpu_s"]) for one in self.baselines)
        known = sum(TRAINING_MINUTES.get(training[2], 0) for training in self.trainings)
        return known + round(seconds / 60)

    @property
    def minutes(self) -> float | None:
        """Minutes of one core, trainings included; None where nothing of it was measured."""
        known = [self.measured[0] / 60.0] if self.measured[0] is not None else []
        known += [self.training_minutes] if self.trainings else []
        return sum(known) if known else None

    def duration(self) -> str:
        """The minutes in words."""
        seconds, what = self.measured
        words = NOT_MEASURED if seconds is None else f"{seconds / 60:.0f} min{what}"
        extra = self.training_minutes
        return f"{words}, and {extra} min of training" if extra else words


def figures(names: Sequence[str] = ()) -> list[Figure]:
    """The published figures that have a command, or those of these names.

    Raises:
        LookupError: There is none of a name.
    """
    found = {
        name: Figure(
            name,
            one.data["source"],
            one.data["command"],
            one.data["found"],
            one.core_seconds,
            _training(one.data["domain"]),
        )
        for name, one in published(PUBLISHED).items()
    }
    if unknown := set(names) - set(found):
        raise LookupError(f"no figure {', '.join(unknown)}; there are {', '.join(found)}")
    return [figure for name, figure in found.items() if not names or name in names]


def _training(domain: str) -> tuple[str, ...]:
    """The command that trained the library that ships for a domain, if one ships."""
    folder = shipped_library(domain)
    if folder is None:
        return ()
    return tuple(shlex.split(load_library(folder, get_domain(domain)).record["command"]))


def make(figure: Figure) -> None:
    """Run a figure's command, and before it the trainings that it needs.

    Raises:
        CalledProcessError: It failed.
    """
    commands = [*figure.trainings, (*shlex.split(figure.command), "--output", str(OUTPUT))]
    for command in commands:
        print(f"  {shlex.join(command)}", flush=True)
        subprocess.run((sys.executable, "-m", "ensemble.cli", *command[1:]), check=True)


def differences(published: Any, again: Any, where: str = "found") -> Iterator[str]:
    """Where results differ, times apart, and what newer versions add."""
    if isinstance(published, dict) and isinstance(again, dict):
        for key, value in published.items():
            if not key.endswith(("seconds", "cpu_s")):
                yield from differences(value, again.get(key), f"{where}.{key}")
    elif isinstance(published, list) and isinstance(again, list) and len(published) == len(again):
        for i, (one, other) in enumerate(zip(published, again, strict=True)):
            yield from differences(one, other, f"{where}[{i}]")
    elif published != again:
        yield where


def compare(figure: Figure) -> str:
    """Whether a figure came out as it is published, in words."""
    again = json.loads(figure.again.read_text(encoding="utf-8"))
    different = list(differences(figure.found, again["found"]))
    if not different:
        return "the same"
    return f"{len(different)} numbers differ, the first at {different[0]}"


def _total(figures: Sequence[Figure]) -> str:
    """How much there is to do, in words."""
    known = [figure.minutes for figure in figures if figure.minutes is not None]
    unknown = len(figures) - len(known)
    return (
        f"{len(figures)} figures to make: {sum(known):.0f} min of one core at least for "
        f"{len(known)} of them; {unknown} are {NOT_MEASURED}"
    )


def _made_again(figure: Figure) -> str:
    """Make a figure if it is not there yet, and say how it came out."""
    if not figure.made:
        print(f"{figure.name}:", flush=True)
        try:
            make(figure)
        except subprocess.CalledProcessError as error:  # as where no model can be asked
            return f"not made, a command ended with {error.returncode}"
    return compare(figure)


def main(arguments: Sequence[str] | None = None) -> int:
    """Make figures again; 1 if one differs."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help="figure to make again; default: all"
    )
    parser.add_argument("--list", action="store_true", help="only list what would be done")
    options = parser.parse_args(arguments)
    chosen = figures(options.names)
    for figure in chosen:
        state = "there" if figure.made else figure.duration()
        print(f"{figure.name} ({figure.source or 'not of a paper'}): {state}")
        print(f"  {figure.command}")
    print(_total([figure for figure in chosen if not figure.made]), flush=True)
    if options.list:
        return 0
    results = {}
    for figure in chosen:
        began = monotonic()
        results[figure.name] = _made_again(figure)
        print(f"{figure.name}: {results[figure.name]} ({(monotonic() - began) / 60:.1f} min)")
    return int(any(result != "the same" for result in results.values()))


if __name__ == "__main__":
    sys.exit(main())
