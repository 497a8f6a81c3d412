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

from tools.imports import ROOT

PUBLISHED = ROOT / "docs" / "results"
OUTPUT = Path("runs") / "reproduced"
# Of one core, as measured on the machine that made the published figures; others: not measured.
MINUTES = {"table1_obstacle2d": 4}
TRAINING_MINUTES = {"obstacle2d": 6, "obstacle_tower": 104}


@dataclass(frozen=True)
class Figure:
    """A published figure or table.

    Args:
        name: Of its files.
        source: What of a paper it makes again; empty for those that are none of a paper's.
        command: That made it.
        found: Its numbers.
    """

    name: str
    source: str
    command: str
    found: Any

    @property
    def again(self) -> Path:
        """Its data once it is made again."""
        return OUTPUT / f"{self.name}.json"

    @property
    def trainings(self) -> list[tuple[str, ...]]:
        """Commands that make the work folders it reads, where they are missing."""
        words = shlex.split(self.command)
        folders = [Path(after) for word, after in pairwise(words) if word == "--work"]
        return [("slap", "train", words[3]) for folder in folders if not folder.is_dir()]

    def duration(self) -> str:
        """In words."""
        known = MINUTES.get(self.name)
        extra = sum(TRAINING_MINUTES.get(training[2], 0) for training in self.trainings)
        words = "not measured" if known is None else f"{known} min"
        return f"{words}, and {extra} min of training" if extra else words


def figures(names: Sequence[str] = ()) -> list[Figure]:
    """The published figures that have a command, or those of these names.

    Raises:
        LookupError: There is none of a name.
    """
    found = {
        path.stem: Figure(path.stem, data.get("source", ""), data["command"], data["found"])
        for path in sorted(PUBLISHED.glob("*.json"))
        if "command" in (data := json.loads(path.read_text(encoding="utf-8")))
    }
    if unknown := set(names) - set(found):
        raise LookupError(f"no figure {', '.join(unknown)}; there are {', '.join(found)}")
    return [figure for name, figure in found.items() if not names or name in names]


def make(figure: Figure) -> None:
    """Run its command, and before it the trainings that it needs.

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
            if not key.endswith("seconds"):
                yield from differences(value, again.get(key), f"{where}.{key}")
    elif isinstance(published, list) and isinstance(again, list) and len(published) == len(again):
        for i, (one, other) in enumerate(zip(published, again, strict=True)):
            yield from differences(one, other, f"{where}[{i}]")
    elif published != again:
        yield where


def compare(figure: Figure) -> str:
    """Whether it came out as it is published, in words."""
    again = json.loads(figure.again.read_text(encoding="utf-8"))
    different = list(differences(figure.found, again["found"]))
    if not different:
        return "the same"
    return f"{len(different)} numbers differ, the first at {different[0]}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Make figures again; 1 if one differs."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="default: all")
    parser.add_argument("--list", action="store_true", help="say what would be done, and end")
    options = parser.parse_args(arguments)
    chosen = figures(options.names)
    for figure in chosen:
        state = "there" if figure.again.exists() else figure.duration()
        print(f"{figure.name} ({figure.source or 'not of a paper'}): {state}")
        print(f"  {figure.command}")
    if options.list:
        return 0
    results = {}
    for figure in chosen:
        began = monotonic()
        if not figure.again.exists():
            print(f"{figure.name}:", flush=True)
            make(figure)
        results[figure.name] = compare(figure)
        print(f"{figure.name}: {results[figure.name]} ({(monotonic() - began) / 60:.1f} min)")
    return int(any(result != "the same" for result in results.values()))


if __name__ == "__main__":
    sys.exit(main())
