# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tasks solved through the bridge on a mock robot: ``python -m benchmarks.robot_bridge``.

The whole ensemble, all nodes in this process, on tasks of Obstacle Tower: with the given skills
alone and with the shipped shortcuts. ``--pace`` moves the mock robot faster than a real one could;
latency stays what it is. ``--output`` gets a page, a picture and every run (needs
``slap_ros[studies]``).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import mean
from time import process_time
from typing import TYPE_CHECKING, Any

from benchmarks.pages import PageOutput
from benchmarks.printing import show
from ensemble.nodes import RunSettings
from ensemble.run import RunRequest, run
from slap_ros.api.library_descriptions import describe_library
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode, SlapError
from slap_ros.evaluation.statistics import wilson_interval
from slap_ros.evaluation.summary import format_spread
from slap_ros.robot.worlds import MOCK
from slap_ros.shortcuts.shipped import NONE, shipped_library
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.comparison import spread_of
from slap_ros.studies.figures import APPROACH_STYLES, label
from slap_ros.studies.results import MarkdownTable, Provenance, StudyReport

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STUDY, DOMAIN = "robot_bridge", "obstacle_tower"
DETECTION_RATE = 30.0  # Hz, at the pace of a real robot
PATIENCE = 10.0  # s, for sensors and controllers: all nodes share one process, planning too
APPROACHES = {"pure_planning": NONE, "slap": ""}  # and the library that each is given
MEASURED = """\
All nodes together solve each task through the bridge to a real robot. In place of the robot there
is a mock: a simulation with latency, noise, and a controller that moves as fast as its limits
allow. The results depend on when messages arrive, so another run of the same command may have other
steps and replans. Steps are the mean over solved tasks, with the sample standard deviation. Replans
are counted over all tasks. Success has Wilson's 95 % interval."""


@dataclass(frozen=True)
class BridgeTrial:
    """How a task ended.

    Args:
        seed: Seed of the task.
        success: Whether the goal was reached.
        steps: Number of environment steps.
        replans: Number of plans that were made after the first.
        error_code: Error code of a task that was not solved.
    """

    seed: int
    success: bool
    steps: int
    replans: int
    error_code: str


@dataclass(frozen=True)
class Conditions:
    """The tasks, and the properties of the mock robot.

    Args:
        tasks: Number of tasks.
        first_seed: Seed of the first task; each task has a seed of its own.
        pace: Speed of the mock robot relative to a real one.
        latency: Latency of messages, s.
        pose_noise: Standard deviation of measured positions, m.
        dropout: Share of detections that are lost.
    """

    tasks: int
    first_seed: int
    pace: float
    latency: float
    pose_noise: float
    dropout: float

    @property
    def command(self) -> str:
        """The command that measures the same again."""
        options = " ".join(
            f"--{name.replace('_', '-')} {value:g}" for name, value in asdict(self).items()
        )
        return f"python -m benchmarks.{STUDY} {options}"

    def mock(self, seed: int) -> dict[str, Any]:
        """Parameters of the mock robot in a task."""
        return {
            "pace": self.pace,
            "rate": min(DETECTION_RATE * self.pace, 200.0),
            "latency": self.latency,
            "pose_noise": self.pose_noise,
            "dropout": self.dropout,
            "noise_seed": seed,
        }


def solve(seed: int, shortcuts: str, conditions: Conditions) -> BridgeTrial:
    """Solve one task.

    Args:
        seed: Seed of the task.
        shortcuts: Library of shortcuts.
        conditions: Properties of the mock robot.
    """
    settings = RunSettings(
        DomainChoice(DOMAIN, "fair"),
        seed,
        0,
        "lazy",
        None,
        shortcuts=shortcuts,
        world=MOCK,
        mock=conditions.mock(seed),
        bridge={
            "joint_timeout": PATIENCE,
            "detection_timeout": PATIENCE,
            "controller_timeout": PATIENCE,
        },
    )
    try:
        metrics = run(RunRequest(settings, in_process=True), lambda _type, _message: None)
    except SlapError as error:
        print(f"seed {seed}: {error}", file=sys.stderr)
        return BridgeTrial(seed, False, 0, 0, error.code.name)
    if not metrics.success:
        print(f"seed {seed}: {metrics.error_msg}", file=sys.stderr)
    code = ErrorCode(metrics.error_code).name
    steps = metrics.plan_length or 0
    return BridgeTrial(seed, bool(metrics.success), steps, metrics.replans, code)


Found = Mapping[str, list[BridgeTrial]]  # by approach


def summary(found: Found) -> dict[str, dict[str, float]]:
    """Figures of each approach."""
    figures = {}
    for approach, trials in found.items():
        steps = [trial.steps for trial in trials if trial.success]
        figures[approach] = {
            "tasks": len(trials),
            "solved": len(steps),
            "mean_steps": mean(steps) if steps else 0.0,
            "replans": sum(trial.replans for trial in trials),
        }
    return figures


def table(found: Found) -> MarkdownTable:
    """The table with one row per approach."""
    rows = []
    for approach, trials in found.items():
        steps = [float(trial.steps) for trial in trials if trial.success]
        interval = wilson_interval(len(steps), len(trials))
        rows.append(
            [
                label(approach),
                f"{len(steps)} of {len(trials)} [{interval.low:.0%}, {interval.high:.0%}]",
                format_spread(spread_of(steps), 1),
                str(sum(trial.replans for trial in trials)),
            ]
        )
    return MarkdownTable(("approach", "solved [95 %]", "steps", "replans"), rows)


def draw(figure: Figure, found: Found) -> None:
    """Draw the steps of each task."""
    axes = figure.subplots()
    for approach, trials in found.items():
        style, solved = APPROACH_STYLES[approach], [trial for trial in trials if trial.success]
        axes.scatter(
            [trial.seed for trial in solved],
            [trial.steps for trial in solved],
            color=style.colour,
            marker=style.marker,
            s=20,
            label=label(approach),
        )
    axes.set_ylim(bottom=0)
    axes.set_xlabel("seed of the task")
    axes.set_ylabel("steps")
    axes.locator_params(axis="x", integer=True)
    figure.legend(loc="outside upper center", ncols=2)


def report(found: Found) -> StudyReport:
    """The page, the picture and every run."""
    return StudyReport(
        study=STUDY,
        source="",
        title="Tasks through the bridge, on a mock robot: Obstacle Tower",
        measured=MEASURED,
        table=table(found),
        found={name: [asdict(trial) for trial in trials] for name, trials in found.items()},
        draw=lambda figure: draw(figure, found),
        size=(6.4, 3.0),
    )


def origin(conditions: Conditions) -> Provenance:
    """The inputs of the report: tasks, mock robot, and the shortcuts that ship."""
    settings = {**asdict(conditions), "library": shipped_shortcuts(DOMAIN)}
    return Provenance(DOMAIN, conditions.command, settings)


def shipped_shortcuts(domain: str) -> Any:
    """What a page says of the shortcuts that ship for a domain.

    Args:
        domain: Name of the domain.
    """
    path = shipped_library(domain)
    assert path is not None
    return describe_library(f"models/shortcuts/{domain}", load_library(path, get_domain(domain)))


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tasks", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=500, help="seed of the first task")
    parser.add_argument("--pace", type=float, default=20.0)
    parser.add_argument("--latency", type=float, default=0.02, help="latency of the robot, s")
    parser.add_argument("--pose-noise", type=float, default=0.002, help="noise of detections, m")
    parser.add_argument("--dropout", type=float, default=0.0)
    parser.add_argument("--output", type=Path, help="folder for page, picture and runs")
    parser.add_argument("--json", action="store_true")
    given = vars(parser.parse_args())
    folder, as_json = given.pop("output"), given.pop("json")
    conditions = Conditions(**given)
    output = PageOutput(folder, STUDY, origin(conditions))
    seeds = range(conditions.first_seed, conditions.first_seed + conditions.tasks)
    found = {
        approach: [solve(seed, shortcuts, conditions) for seed in seeds]
        for approach, shortcuts in APPROACHES.items()
    }
    output.write(report(found), process_time())
    show(summary(found), as_json)


if __name__ == "__main__":
    main()
