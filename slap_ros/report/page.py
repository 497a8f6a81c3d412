# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reports as one HTML file that needs nothing else: no network, no server, no script to be read.

Whatever comes out of a bag is text to the page, never markup: the template escapes everything,
and a content security policy lets no script run but the page's own.
"""

from __future__ import annotations

import re
from base64 import b64encode
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

import slap_ros
from slap_ros.drawing.svg import clean_value
from slap_ros.errors import InvalidParameterError, StorageFullError
from slap_ros.evaluation.metrics import known
from slap_ros.files import require_writable, write_whole
from slap_ros.relational.articles import counted
from slap_ros.report.animation import Drawing, draw
from slap_ros.report.content import PURE_PLANNING, BagReport, RunReport

HERE = Path(__file__).parent  # of the template, style and script
ENDING = ".html"
MOST_TICKS = 7  # on an axis
# Characters that turn text around: what follows them would read otherwise than it is.
TURNING = re.compile("[\u200e\u200f\u202a-\u202e\u2066-\u2069]")


@dataclass(frozen=True)
class PageRun:
    """A run on the page."""

    number: int  # from 1
    label: str
    run: RunReport
    drawings: tuple[Drawing, ...]
    relative_length: float | None  # against pure planning of the same task


def check_output(path: Path) -> None:
    """Refuse a place for a page before anything is run or read.

    Raises:
        InvalidParameterError: It is a folder, or has another ending than that of pages.
        OSError: It cannot be written.
    """
    if path.suffix != ENDING:
        raise InvalidParameterError(f"a report is a file that ends in {ENDING}, not {path.name!r}")
    if path.is_dir():
        raise InvalidParameterError(f"{path} is a folder; name a file for the report")
    require_writable(path)


def write_page(path: Path, text: str) -> None:
    """Write a page, or nothing at all.

    Raises:
        StorageFullError: It cannot be written; what was there before is left alone.
    """
    try:
        write_whole(path, text)
    except OSError as error:
        raise StorageFullError(f"cannot write {path}: {error.strerror}") from error


def render(bags: Sequence[BagReport]) -> str:
    """The page for the runs of some bags."""
    runs = [run for bag in bags for run in bag.runs]
    shown = _shown(runs)
    script = _read("page.js")
    environment = Environment(
        loader=FileSystemLoader(HERE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_readable,
    )
    environment.filters["counted"] = counted
    environment.filters["known"] = known
    last = max((run.length for run in runs), default=0)
    return environment.get_template("page.html.j2").render(
        bags=bags,
        shown=shown,
        last=last,
        ticks=_ticks(last),
        same_task=len(runs) > 1 and all(run.task == runs[0].task for run in runs),
        summary=_summary(shown),
        differing=_differing(runs),
        metrics=[run.metrics.as_json() for run in runs],
        player=_player(shown, last),
        style=_read("page.css"),
        script=script,
        script_digest=b64encode(sha256(script.encode()).digest()).decode(),
        version=slap_ros.__version__,
    )


def _read(name: str) -> str:
    return (HERE / name).read_text(encoding="utf-8")


def _readable(value: object) -> object:
    """Text as it can be shown, with what would mislead a reader replaced."""
    if type(value) is str:  # not Markup, which is ours
        return TURNING.sub("\ufffd", clean_value(value))
    return value


def _shown(runs: Sequence[RunReport]) -> list[PageRun]:
    scenes = [run.scene for run in runs if run.scene is not None]
    drawings = iter(draw(scenes) if scenes else [])
    return [
        PageRun(
            number=number,
            label=label,
            run=run,
            drawings=next(drawings) if run.scene is not None else (),
            relative_length=_relative_length(run, runs),
        )
        for number, (label, run) in enumerate(zip(_labels(runs), runs, strict=True), start=1)
    ]


def _labels(runs: Sequence[RunReport]) -> list[str]:
    """The shortest names that differ from run to run; those of several ensembles have theirs."""
    approaches = Counter((run.approach, run.namespace) for run in runs)
    bags = Counter((run.approach, run.namespace, run.bag) for run in runs)
    labels = []
    for number, run in enumerate(runs, start=1):
        label = f"{run.approach}, {run.namespace}" if run.namespace else run.approach
        if approaches[run.approach, run.namespace] > 1:
            label += f", {run.bag}"
        if bags[run.approach, run.namespace, run.bag] > 1:
            label += f", run {number}"
        labels.append(label)
    return labels


def _relative_length(run: RunReport, runs: Sequence[RunReport]) -> float | None:
    """Plan length against that of pure planning, of the first such run of the same task."""
    length = run.metrics.plan_length
    for other in runs if len(runs) > 1 else ():
        if other.task == run.task and other.approach == PURE_PLANNING and other.metrics.success:
            if not run.metrics.success or length is None or not other.metrics.plan_length:
                return None
            return length / other.metrics.plan_length
    return None


def _summary(shown: Sequence[PageRun]) -> list[str]:
    """A sentence per run: how it ended, and in how many steps."""
    sentences = []
    for one in shown:
        metrics = one.run.metrics
        if not metrics.success or metrics.plan_length is None:
            verdict = "not known whether solved" if metrics.success is None else "not solved"
            sentences.append(f"{one.label}: {verdict}. {metrics.error_msg}")
            continue
        sentence = f"{one.label}: solved in {counted(metrics.plan_length, 'step')}"
        if metrics.shortcut_steps:
            sentence += f", {metrics.shortcut_steps} of them in shortcuts"
        if one.relative_length is not None and one.run.approach != PURE_PLANNING:
            sentence += f"; {one.relative_length:.2f} of the length by pure planning"
        sentences.append(f"{sentence}.")
    return sentences


def _differing(runs: Sequence[RunReport]) -> set[str]:
    """Names of settings and versions that are not the same in all runs."""
    settings = [run.configuration | run.versions for run in runs]
    names = {name for setting in settings for name in setting}
    return {name for name in names if len({setting.get(name) for setting in settings}) > 1}


def _ticks(last: int) -> list[int]:
    """Round numbers for an axis from 0."""
    spacing = next(s for n in range(10) for m in (1, 2, 5) if last / (s := m * 10**n) < MOST_TICKS)
    return list(range(0, last + 1, spacing))


def _player(shown: Sequence[PageRun], last: int) -> dict[str, Any]:
    """What the page's script plays."""
    periods = [one.run.control_period_s for one in shown]
    return {
        "last": last,
        "period": max(periods, default=1.0),
        "runs": [
            {
                "last": one.run.length,
                "frames": [frame.step for frame in one.run.scene.frames]
                if one.run.scene is not None
                else [],
                "spans": [
                    [span.start, span.end, _readable(f"{span.number} {span.text}")]
                    for span in one.run.spans
                ],
                "views": [drawing.as_json() for drawing in one.drawings],
            }
            for one in shown
        ],
    }
