# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The same figures on other processors: ``python -m tools.processors [NAME...]``.

Libraries choose their code by what the processor can do. Environment variables make them choose as
on other processors. Under each, a plan, an evaluation and a recorded run are made, and the digests
of all must be those of the processor as it is. An emulated processor can do no more than the real
one: what newer ones choose is not tried.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track

from slap_ros.bags.digest import bag_digest

SLAP = (sys.executable, "-m", "ensemble.cli")
# Of an evaluation: what depends on the machine and not on the plans.
MACHINE = ("planning_seconds", "versions")


def _numpy_features() -> str:
    """Everything for which numpy has code of its own and that this processor can do."""
    found = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
    return ",".join(found)


# numba compiles for a processor without extensions; both variables are needed.
NUMBA_BASELINE = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
GLIBC_BASELINE = "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX"
LIBRARIES_BASELINE = {
    "OPENBLAS_CORETYPE": "Prescott",
    "NPY_DISABLE_CPU_FEATURES": _numpy_features(),
    "GLIBC_TUNABLES": GLIBC_BASELINE,
}
PROCESSORS: Mapping[str, Mapping[str, str]] = {
    "prescott": {"OPENBLAS_CORETYPE": "Prescott"},
    "nehalem": {"OPENBLAS_CORETYPE": "Nehalem"},
    "haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "numpy": {"NPY_DISABLE_CPU_FEATURES": _numpy_features()},
    "glibc": {"GLIBC_TUNABLES": GLIBC_BASELINE},
    "numba": NUMBA_BASELINE,
    "libraries": LIBRARIES_BASELINE,
    "baseline": {**LIBRARIES_BASELINE, **NUMBA_BASELINE},
}
AS_IT_IS: Mapping[str, str] = {}


@dataclass(frozen=True)
class Figure:
    """Something that must be the same on every processor.

    Args:
        name: Command, as a reader would call it.
        make: Digest of the result, given the environment variables of an emulation.
    """

    name: str
    make: Callable[[Mapping[str, str]], str]


def _slap(processor: Mapping[str, str], *words: str) -> str:
    """Standard output of a command of ``slap`` on an emulated processor.

    Raises:
        subprocess.CalledProcessError: The command failed; its error output was passed on.
    """
    environment = {**os.environ, **processor}
    done = subprocess.run(
        [*SLAP, *words], env=environment, check=True, stdout=subprocess.PIPE, text=True
    )
    return done.stdout


def _without_machine(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _without_machine(value) for key, value in data.items() if key not in MACHINE}
    return [_without_machine(one) for one in data] if isinstance(data, list) else data


def _json_figure(*words: str) -> Figure:
    def make(processor: Mapping[str, str]) -> str:
        data = _without_machine(json.loads(_slap(processor, *words, "--json")))
        return sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()

    return Figure(" ".join(["slap", *words]), make)


def _bag_figure(*words: str) -> Figure:
    def make(processor: Mapping[str, str]) -> str:
        with tempfile.TemporaryDirectory() as folder:
            bag = Path(folder) / "bag"
            _slap(processor, "run", *words, "--in-process", "--record", str(bag))
            return bag_digest(bag)

    return Figure(" ".join(["slap run", *words, "--record BAG"]), make)


PLAN = _json_figure("plan", "obstacle_tower", "--seed", "1")
RECORDED_RUN = _bag_figure("obstacle2d", "--seed", "1")
FIGURES = (
    PLAN,
    _json_figure("plan", "cluttered_drawer", "--seed", "1"),
    _json_figure("plan", "cleanup_table", "--preset", "fair:toys=6", "--seed", "502"),
    _json_figure("evaluate", "obstacle2d", "--tasks", "5", "--seeds", "2"),
    _json_figure("evaluate", "obstacle_tower", "--tasks", "3", "--seeds", "1"),
    RECORDED_RUN,
    _bag_figure("obstacle_tower", "--seed", "1"),
    _bag_figure("peg_in_hole", "--seed", "2"),
)


@dataclass(frozen=True)
class Difference:
    """A figure that is another one on an emulated processor."""

    figure: str
    processor: str

    def __str__(self) -> str:
        return f"{self.figure}: differs on {self.processor}"


def differences(processors: Sequence[str], figures: Sequence[Figure]) -> Iterator[Difference]:
    """Make figures on the processor as it is and on emulated ones.

    Args:
        processors: Names of :data:`PROCESSORS`.
        figures: Figures to make on each.

    Yields:
        Figures that differ.
    """
    for figure in figures:
        expected = figure.make(AS_IT_IS)
        for name in processors:
            if figure.make(PROCESSORS[name]) != expected:
                yield Difference(figure.name, name)


def _known(processor: str) -> str:
    """A processor by its name; argparse's own choices refuse the default of many."""
    if processor not in PROCESSORS:
        raise argparse.ArgumentTypeError(
            f"no processor {processor!r}; there are {', '.join(PROCESSORS)}"
        )
    return processor


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare, and say what differs; 1 if anything does."""
    parser = argparse.ArgumentParser(prog="python -m tools.processors", description=__doc__)
    parser.add_argument(
        "processor",
        nargs="*",
        type=_known,
        default=list(PROCESSORS),
        help=f"Processors to emulate, of {', '.join(PROCESSORS)}. Default: all.",
    )
    names = parser.parse_args(arguments).processor
    console, found = Console(stderr=True), []
    for figure in track(FIGURES, "figures", console=console):
        found += list(differences(names, [figure]))
    for difference in found:
        console.print(str(difference))
    console.print(f"{len(FIGURES)} figures on {len(names)} processors: {len(found)} differ")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
