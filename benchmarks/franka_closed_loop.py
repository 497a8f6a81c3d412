# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tasks solved on a simulated FR3 in closed loop: ``python -m benchmarks.franka_closed_loop``.

The whole ensemble, all nodes in this process, solves tasks of Obstacle Tower through robot_bridge
and the driver of a Franka arm. The simulated FR3 has a process of its own. Objects are those of the
planner's model. It goes on from its log after an interruption. ``--output`` gets a page, a picture
and every run (needs ``slap_ros[studies]`` and ``slap_ros[franka-sim]``).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from time import monotonic, process_time
from typing import TYPE_CHECKING, Any

from benchmarks.pages import PageOutput
from benchmarks.printing import show
from benchmarks.robot_bridge import APPROACHES, shipped_shortcuts
from ensemble.client import RunClient
from ensemble.interfaces import DIAGNOSTICS, STATE
from ensemble.launcher import InProcessLauncher
from ensemble.nodes import RunSettings, node_parameters
from ensemble.spinner import temporary_node
from slap_ros.errors import ErrorCode, NotReadyError, RunTimeoutError, SlapError
from slap_ros.evaluation.metrics import RunMetrics
from slap_ros.evaluation.statistics import wilson_interval
from slap_ros.evaluation.summary import format_spread
from slap_ros.robot.worlds import FRANKA_SIM
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.comparison import spread_of
from slap_ros.studies.figures import APPROACH_STYLES, label
from slap_ros.studies.results import MarkdownTable, Provenance, StudyReport
from slap_ros.studies.study_log import StudyLog

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STUDY, DOMAIN = "franka_closed_loop", "obstacle_tower"
PATIENCE = 5.0  # factor of all deadlines: all nodes share one process, planning too
TIMEOUT_S = 1800.0  # of this machine, for a task
LAST_S = 30.0  # of this machine, for the last diagnostics
REPLANS = 5
PURE, SLAP = APPROACHES
SPEED = 0.5  # fraction of the arm's limits: the bridge's default
JOINT_RATE = 40.0  # Hz, of joint positions: all nodes share one process
MEASURED = """\
All nodes together solve each task through the bridge and the driver of a Franka arm, on a simulated
FR3 that speaks the robot's protocol (franky-sim, in MuJoCo), at half speed. No real arm was moved.
Objects are those of the planner's model: they follow the measured hand, and are detected without
noise. The horizon is the largest number of commands that the arm executes in one motion. Motion is
the time in which the arm moves, on the robot's clock. That clock waits for its driver, so this time
does not depend on the machine. Seconds a step are of two cores with some other work. Steps and
times are means over solved tasks, with the sample standard deviation. Replans are counted over all
tasks. Success has Wilson's 95 % interval."""


@dataclass(frozen=True)
class ClosedLoopTrial:
    """How a task ended.

    Args:
        seed: Seed of the task.
        approach: Name of the approach.
        horizon: Largest number of commands in one motion of the arm.
        success: Whether the goal was reached.
        steps: Number of environment steps.
        replans: Number of plans that were made after the first.
        motions: Number of the arm's motions, each from rest to rest.
        motion_s: Duration of the motions on the robot's clock, s.
        seconds: Duration of the execution on this machine, s.
        error_code: Error code of a task that was not solved.
    """

    seed: int
    approach: str
    horizon: int
    success: bool
    steps: int
    replans: int
    motions: int
    motion_s: float
    seconds: float
    error_code: str


@dataclass
class Observer:
    """What messages of a run tell besides its metrics.

    Args:
        arm: Newest diagnostics of the arm's driver.
        heard: How often these were heard.
        states_s: Times at which states came, s.
    """

    arm: dict[str, str] = field(default_factory=dict)
    heard: int = 0
    states_s: list[float] = field(default_factory=list)

    def hear(self, type_name: str, message: Any) -> None:
        """Take a message of the run."""
        if type_name == STATE.type_name:
            self.states_s.append(monotonic())
        elif type_name == DIAGNOSTICS.type_name:
            for status in message.status:
                if status.name == "/franka_driver":
                    self.arm = {item.key: item.value for item in status.values}
                    self.heard += 1

    @property
    def seconds(self) -> float:
        """From the first state after a step to the last, s."""
        return self.states_s[-1] - self.states_s[1] if len(self.states_s) > 1 else 0.0


def solve(seed: int, approach: str, horizon: int) -> ClosedLoopTrial:
    """Solve one task.

    Args:
        seed: Seed of the task.
        approach: Name of the approach.
        horizon: Largest number of commands in one motion of the arm.
    """
    settings = RunSettings(
        DomainChoice(DOMAIN, "fair"),
        seed,
        0,
        "anytime",
        None,
        shortcuts=APPROACHES[approach],
        patience=PATIENCE,
        world=FRANKA_SIM,
        bridge={"horizon": horizon, "speed": SPEED},
        franka={"speed": SPEED, "joint_rate": JOINT_RATE},
    )
    observer = Observer()
    try:
        metrics = run_to_rest(settings, observer)
    except SlapError as error:
        print(f"seed {seed}: {error}", file=sys.stderr)
        return ClosedLoopTrial(seed, approach, horizon, False, 0, 0, 0, 0.0, 0.0, error.code.name)
    if not metrics.success:
        print(f"seed {seed}: {metrics.error_msg}", file=sys.stderr)
    return ClosedLoopTrial(
        seed,
        approach,
        horizon,
        bool(metrics.success),
        metrics.plan_length or 0,
        metrics.replans or 0,
        int(observer.arm.get("motions", 0)),
        float(observer.arm.get("moved_s", 0.0)),
        observer.seconds,
        ErrorCode(metrics.error_code).name,
    )


def run_to_rest(settings: RunSettings, observer: Observer) -> RunMetrics:
    """Solve a task, and wait for what the arm's driver says of all its motions.

    Args:
        settings: What to run.
        observer: Hears all messages.

    Raises:
        SlapError: The task was not solved, for a reason that its metrics do not have.
    """
    nodes = node_parameters(settings)
    with (
        temporary_node(lambda: RunClient(observer.hear, (DIAGNOSTICS,))) as (client, spinner),
        InProcessLauncher(nodes, spinner.executor),
    ):
        if not spinner.spin_until(lambda: client.ready(False), TIMEOUT_S):
            raise NotReadyError("the ensemble did not come up")
        sent = client.send((), 0, REPLANS)
        spinner.spin_until(sent.done, TIMEOUT_S)
        ended = sent.result().get_result_async()
        if not spinner.spin_until(ended.done, TIMEOUT_S):
            raise RunTimeoutError(f"not solved within {TIMEOUT_S} s")
        heard = observer.heard
        spinner.spin_until(lambda: observer.heard > heard + 1 and client.log.complete, LAST_S)
        metrics: RunMetrics = client.log.runs()[-1]
        return metrics


@dataclass(frozen=True)
class Tasks:
    """Which tasks are solved in which ways.

    Args:
        tasks: Number of tasks that are solved by pure planning.
        first_seed: Seed of the first task; each task has a seed of its own.
        horizon: Largest number of commands in one motion of the arm.
        stopping: Number of tasks that are also solved with a stop after each command.
        shortcuts: Number of tasks that are also solved with the shipped shortcuts.
    """

    tasks: int
    first_seed: int
    horizon: int
    stopping: int
    shortcuts: int

    @property
    def command(self) -> str:
        """The command that measures the same again."""
        options = " ".join(f"--{name.replace('_', '-')} {n}" for name, n in asdict(self).items())
        return f"python -m benchmarks.{STUDY} {options}"

    @property
    def ways(self) -> list[tuple[int, str, int]]:
        """Seed, approach and horizon of every run."""
        chosen = (
            (self.stopping, PURE, 1),
            (self.tasks, PURE, self.horizon),
            (self.shortcuts, SLAP, self.horizon),
        )
        return [
            (self.first_seed + number, approach, horizon)
            for count, approach, horizon in chosen
            for number in range(count)
        ]


Groups = dict[tuple[str, int], list[ClosedLoopTrial]]  # by approach and horizon


def groups(found: Sequence[ClosedLoopTrial]) -> Groups:
    """Runs by approach and horizon."""
    grouped: Groups = {}
    for one in found:
        grouped.setdefault((one.approach, one.horizon), []).append(one)
    return grouped


def table(found: Sequence[ClosedLoopTrial]) -> MarkdownTable:
    """The table with a row for each approach and horizon."""
    rows = []
    for (approach, horizon), trials in groups(found).items():
        solved = [one for one in trials if one.success]
        interval = wilson_interval(len(solved), len(trials))
        rows.append(
            [
                label(approach),
                str(horizon),
                f"{len(solved)} of {len(trials)} [{interval.low:.0%}, {interval.high:.0%}]",
                format_spread(spread_of([float(one.steps) for one in solved]), 1),
                str(sum(one.replans for one in trials)),
                format_spread(spread_of([one.steps / one.motions for one in solved]), 2),
                format_spread(spread_of([one.motion_s / one.steps for one in solved]), 3),
                format_spread(spread_of([one.seconds / one.steps for one in solved]), 2),
            ]
        )
    columns = ("approach", "horizon", "solved [95 %]", "steps", "replans", "steps a motion")
    return MarkdownTable((*columns, "motion [s a step]", "this machine [s a step]"), rows)


def summary(found: Sequence[ClosedLoopTrial]) -> dict[str, dict[str, float]]:
    """Figures of each approach and horizon."""
    figures = {}
    for (approach, horizon), trials in groups(found).items():
        solved = [one for one in trials if one.success]
        steps = sum(one.steps for one in solved) or 1
        figures[f"{approach}, horizon {horizon}"] = {
            "tasks": len(trials),
            "solved": len(solved),
            "mean_steps": steps / max(1, len(solved)),
            "motion_s_per_step": sum(one.motion_s for one in solved) / steps,
            "seconds_per_step": sum(one.seconds for one in solved) / steps,
        }
    return figures


def draw(figure: Figure, found: Sequence[ClosedLoopTrial]) -> None:
    """Draw the motion of each task over its steps."""
    axes = figure.subplots()
    for (approach, horizon), trials in groups(found).items():
        style, solved = APPROACH_STYLES[approach], [one for one in trials if one.success]
        axes.scatter(
            [one.steps for one in solved],
            [one.motion_s for one in solved],
            facecolors=style.colour if horizon > 1 else "none",
            edgecolors=style.colour,
            marker=style.marker,
            s=22,
            label=f"{label(approach)}, horizon {horizon}",
        )
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    axes.set_xlabel("steps")
    axes.set_ylabel("motion on the robot's clock [s]")
    figure.legend(loc="outside upper center", ncols=2)


def report(found: Sequence[ClosedLoopTrial]) -> StudyReport:
    """The page, the picture and every run."""
    return StudyReport(
        study=STUDY,
        source="",
        title="Closed loop on a simulated FR3 that speaks the robot's protocol: Obstacle Tower",
        measured=MEASURED,
        table=table(found),
        found={"trials": [asdict(one) for one in found], "summary": summary(found)},
        draw=lambda figure: draw(figure, found),
        size=(6.0, 3.4),
    )


def measure(ways: Sequence[tuple[int, str, int]], log: StudyLog) -> list[ClosedLoopTrial]:
    """Solve tasks, each in its way.

    Args:
        ways: Seed, approach and horizon of every run.
        log: Log of the runs that were made so far; it gets the others.
    """
    for way in ways:
        job = "seed {}, {}, horizon {}".format(*way)
        if job not in log.results:
            began_s = process_time()
            one = solve(*way)
            log.add(job, asdict(one), process_time() - began_s)
            print(f"{job}: {one.steps} steps {one.error_code}", flush=True)
    jobs = ["seed {}, {}, horizon {}".format(*way) for way in ways]
    return [ClosedLoopTrial(**log.results[job]) for job in jobs]


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tasks", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=500, help="seed of the first task")
    parser.add_argument("--horizon", type=int, default=3, help="commands in one motion, at most")
    parser.add_argument("--stopping", type=int, default=1, help="tasks with horizon 1 as well")
    parser.add_argument("--shortcuts", type=int, default=2, help="tasks with shortcuts as well")
    parser.add_argument("--output", type=Path, help="folder for page, picture and runs")
    parser.add_argument("--log", default=f"runs/{STUDY}.jsonl", help="file to go on from")
    parser.add_argument("--json", action="store_true")
    given = vars(parser.parse_args())
    folder, path, as_json = given.pop("output"), given.pop("log"), given.pop("json")
    tasks = Tasks(**given)
    settings = {**asdict(tasks), "speed": SPEED, "library": shipped_shortcuts(DOMAIN)}
    source = Provenance(DOMAIN, tasks.command, settings)
    output = PageOutput(folder, STUDY, source)
    with StudyLog(Path(path), source) as log:
        found = measure(tasks.ways, log)
        output.write(report(found), log.cpu_seconds)
    show(summary(found), as_json)


if __name__ == "__main__":
    main()
