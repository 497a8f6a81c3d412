# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recorded plans on a simulated FR3 with the robot's protocol: ``python -m benchmarks.franka``.

Plans of Obstacle Tower, solved by pure planning in the planner's physics, are replayed open loop by
the driver's own arm, without ROS. Durations are on the robot's clock, which waits for its driver:
they do not depend on the machine. ``--output`` gets a page, a picture and every replay (needs
``slap_ros[studies]`` and ``slap_ros[franka-sim]``).
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.pages import PageOutput
from benchmarks.printing import show
from slap_ros.api.execution import execute
from slap_ros.api.planning import plan
from slap_ros.domains import get_domain
from slap_ros.errors import SlapError
from slap_ros.evaluation.summary import format_spread
from slap_ros.robot.blended_run import BlendedRun
from slap_ros.robot.dry_run import DryRun
from slap_ros.robot.franka.arm import ArmReading, FrankaArm, FrankaSettings, MotionResult
from slap_ros.robot.franka.limits import JERK, franka_limits
from slap_ros.robot.franka.simulation import SimulatedFr3
from slap_ros.robot.gripper import GAP_OPEN, GripperAction
from slap_ros.robot.limits import FR3, Limits, Workspace
from slap_ros.robot.recorded_motion import RecordedMotion, read_recorded_motion
from slap_ros.robot.stretches import Stretch
from slap_ros.studies.comparison import spread_of
from slap_ros.studies.results import MarkdownTable, Provenance, StudyReport
from slap_ros.studies.study_log import StudyLog

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STUDY = "franka"
ROOM = Workspace((-0.9, -0.9, -0.4), (0.9, 0.9, 1.2))  # m: nothing is around the simulated arm
FORCE = 20.0  # N, of closing fingers
PATIENCE_S = 600.0  # of this machine, for a motion
PARTS = 8  # places between two readings at which the measured path is looked at
BLENDED, STOPPING = "without stops", "from rest to rest"
WAYS = ((0.5, BLENDED), (1.0, BLENDED), (0.5, STOPPING))  # fraction of the limits, and stops
MEASURED = """\
Plans that pure planning found in the planner's physics are replayed open loop on a simulated FR3
that speaks the robot's protocol (franky-sim, in MuJoCo), by the driver's arm over franky. No real
arm was moved. Durations are those of the arm's motions on the robot's clock; grips are not among
them. The recording's duration is the number of its steps in which the arm moves, times the
simulator's period. The error at a waypoint is the smallest distance of the measured path from it,
in the joint that is furthest off; at rest, it is that of the arm when it has come to stand. A
reflex, a stop by the robot's own control, counts as a fault. Fingers stop at the recorded gap,
since the simulated FR3 is alone. Mean ± sample standard deviation over plans."""


@dataclass(frozen=True)
class FrankaReplay:
    """A replay of a recorded plan.

    Args:
        seed: Seed of the task.
        mode: Whether the arm stops at each waypoint.
        speed: Fraction of the arm's limits.
        steps: Number of steps in which the arm moves.
        recorded_s: Duration of these steps in the recording, s.
        planned_s: Duration of the motions as planned, s.
        duration_s: Duration of the motions on the robot's clock, s.
        path_error: Largest error at a waypoint, rad.
        rest_error: Largest error where the arm stands, rad.
        error: Code of the fault that ended it; empty without one.
    """

    seed: int
    mode: str
    speed: float
    steps: int
    recorded_s: float
    planned_s: float
    duration_s: float
    path_error: float
    rest_error: float
    error: str


def recorded_plan(domain_name: str, seed: int) -> RecordedMotion:
    """A plan of pure planning, executed in the planner's physics.

    Args:
        domain_name: Name of the domain.
        seed: Seed of the task.
    """
    domain = get_domain(domain_name)
    task = domain.task(seed, 0)
    run = execute(domain, task, plan(domain, task, None))
    with TemporaryDirectory(prefix="slap-") as folder:
        return read_recorded_motion(run.bag(Path(folder) / "bag"))


def limits_of(recorded: RecordedMotion, speed: float) -> Limits:
    """Limits of an FR3 at a fraction of its speed."""
    return recorded.limits_of(franka_limits(FR3.scaled(speed, ROOM), speed))


def stretches(recorded: RecordedMotion, speed: float, mode: str) -> Sequence[Stretch]:
    """The parts in which a recording is executed.

    Args:
        recorded: Recorded plan.
        speed: Fraction of the arm's limits.
        mode: Whether the arm stops at each waypoint.
    """
    limits = limits_of(recorded, speed)
    run = BlendedRun.without_stops(recorded, limits, tuple(speed * jerk for jerk in JERK))
    run.require_safe()
    if mode == BLENDED:
        return run.stretches
    moving = {step for stretch in run.stretches for step in stretch.steps}
    pairs = zip(recorded.waypoints, DryRun.of(recorded, limits).motions, strict=True)
    return [
        Stretch.of(waypoint, motion)
        if waypoint.step in moving
        else Stretch((waypoint,), motion.start, (), ())
        for waypoint, motion in pairs
    ]


def replay(recorded: RecordedMotion, speed: float, mode: str) -> FrankaReplay:
    """Replay a recorded plan on a simulated FR3.

    Args:
        recorded: Recorded plan.
        speed: Fraction of the arm's limits.
        mode: Whether the arm stops at each waypoint.
    """
    parts = stretches(recorded, speed, mode)
    durations, path_errors, rest_errors, error = [], [0.0], [0.0], ""
    settings = FrankaSettings("", limits_of(recorded, speed), speed, realtime=False)
    with SimulatedFr3(recorded.start) as simulation:
        arm = FrankaArm(FrankaSettings(simulation.ip, settings.limits, speed, realtime=False))
        try:
            for part in parts:
                _grip(arm, part)
                if part.points:
                    moved, path = _moved(arm, part)
                    durations.append(moved.ended_s - moved.began_s)
                    path_errors.append(_path_error(path, part))
                    rest_errors.append(_off(arm.reading.joints, part.points[-1].positions))
        except SlapError as failure:
            error = failure.code.name
        finally:
            arm.close()
    steps = sum(len(part.steps) for part in parts)
    return FrankaReplay(
        recorded.seed,
        mode,
        speed,
        steps,
        steps * recorded.domain.execution.control_period_s,
        sum(part.duration_s for part in parts),
        float(sum(durations)),
        max(path_errors),
        max(rest_errors),
        error,
    )


def _grip(arm: FrankaArm, part: Stretch) -> None:
    first = part.waypoints[0]
    if first.gripper is not GripperAction.KEEP:
        closing = first.gripper is GripperAction.CLOSE
        _wait(arm.grip(first.gap if closing else GAP_OPEN, FORCE))


def _moved(arm: FrankaArm, part: Stretch) -> tuple[MotionResult, list[ArmReading]]:
    """A motion, and what was read of the arm meanwhile."""
    path: list[ArmReading] = [arm.reading]
    arm.on_reading = path.append
    moved = _wait(arm.follow(part.points))
    path.append(arm.reading)
    return moved, path


def _wait(outcome: MotionResult) -> MotionResult:
    if not outcome.done.wait(PATIENCE_S):
        raise TimeoutError(f"no end of a motion within {PATIENCE_S} s")
    if outcome.error is not None:
        raise outcome.error
    return outcome


def _off(joints: Sequence[float], target: Sequence[float]) -> float:
    """How far the joint that is furthest off is from a target, rad."""
    return max(abs(a - b) for a, b in zip(joints, target, strict=True))


def _path_error(path: Sequence[ArmReading], part: Stretch) -> float:
    """The largest distance of a waypoint from the measured path, rad."""
    read: NDArray[np.float64] = np.array([reading.joints for reading in path])
    between = np.linspace(0.0, 1.0, PARTS)[:, None, None]
    places = (read[:-1] + between * np.diff(read, axis=0)).reshape(-1, read.shape[1])
    return max(
        float(np.abs(places - np.array(point.positions)).max(axis=1).min()) for point in part.points
    )


def table(found: Sequence[FrankaReplay]) -> MarkdownTable:
    """The table with a row for each way to replay."""
    rows = []
    for mode, speed in sorted({(one.mode, one.speed) for one in found}, reverse=True):
        some = [one for one in found if (one.mode, one.speed) == (mode, speed)]
        rows.append(
            [
                mode,
                f"{speed:g}",
                f"{sum(not one.error for one in some)} of {len(some)}",
                format_spread(spread_of([one.duration_s for one in some]), 1),
                format_spread(spread_of([one.duration_s / one.recorded_s for one in some]), 2),
                f"{max(one.path_error for one in some):.4f}",
                f"{max(one.rest_error for one in some):.4f}",
            ]
        )
    columns = ("motion", "speed", "without a fault", "duration [s]", "of the recording's")
    return MarkdownTable(
        (*columns, "error at a waypoint, at most [rad]", "at rest, at most [rad]"), rows
    )


def summary(found: Sequence[FrankaReplay]) -> dict[str, Any]:
    """Figures over all replays."""
    pairs: dict[tuple[int, float], dict[str, FrankaReplay]] = {}
    for one in found:
        pairs.setdefault((one.seed, one.speed), {})[one.mode] = one
    ratios = [
        both[STOPPING].duration_s / both[BLENDED].duration_s
        for both in pairs.values()
        if len(both) > 1
    ]
    figures = {
        "replays": len(found),
        "faults": sum(bool(one.error) for one in found),
        "largest_path_error_rad": max(one.path_error for one in found),
        "largest_rest_error_rad": max(one.rest_error for one in found),
    }
    return figures | ({"blended_is_faster_by": float(np.mean(ratios))} if ratios else {})


def draw(figure: Figure, found: Sequence[FrankaReplay]) -> None:
    """Draw durations over those of the recordings."""
    axes = figure.subplots()
    for mode, marker in ((BLENDED, "o"), (STOPPING, "s")):
        for speed, colour in ((0.5, "#0072b2"), (1.0, "#d55e00")):
            some = [one for one in found if (one.mode, one.speed) == (mode, speed)]
            if some:
                axes.scatter(
                    [one.recorded_s for one in some],
                    [one.duration_s for one in some],
                    marker=marker,
                    color=colour,
                    s=18,
                    label=f"{mode}, speed {speed:g}",
                )
    axes.axline((0.0, 0.0), slope=1.0, color="0.7", linewidth=1)
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    axes.set_xlabel("duration in the recording [s]")
    axes.set_ylabel("duration on the robot's clock [s]")
    figure.legend(loc="outside upper center", ncols=2)


def report(found: Sequence[FrankaReplay], domain: str) -> StudyReport:
    """The page, the picture and every replay."""
    return StudyReport(
        study=STUDY,
        source="",
        title=f"Recorded plans on a simulated FR3 that speaks the robot's protocol: {domain}",
        measured=MEASURED,
        table=table(found),
        found={"replays": [asdict(one) for one in found], "summary": summary(found)},
        draw=lambda figure: draw(figure, found),
        size=(5.6, 3.6),
    )


def measure(domain: str, seeds: Sequence[int], compared: int, log: StudyLog) -> list[FrankaReplay]:
    """Replay a plan for each seed at half speed, and some of them in other ways as well.

    Args:
        domain: Name of the domain.
        seeds: Seeds of the tasks.
        compared: Number of plans that are also replayed at full speed, and from rest to rest.
        log: Log of the replays that were made so far; it gets the others.
    """
    for number, seed in enumerate(seeds):
        ways = WAYS if number < compared else WAYS[:1]
        missing = [way for way in ways if _job(seed, *way) not in log.results]
        recorded = recorded_plan(domain, seed) if missing else None
        for speed, mode in missing:
            assert recorded is not None
            began_s = process_time()
            one = replay(recorded, speed, mode)
            log.add(_job(seed, speed, mode), asdict(one), process_time() - began_s)
            print(f"{_job(seed, speed, mode)}: {one.duration_s:.2f} s {one.error}", flush=True)
    return [FrankaReplay(**result) for result in log.results.values()]


def _job(seed: int, speed: float, mode: str) -> str:
    return f"seed {seed}, speed {speed:g}, {mode}"


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--domain", default="obstacle_tower")
    parser.add_argument("--tasks", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=500, help="seed of the first task")
    parser.add_argument("--compared", type=int, default=3, help="plans replayed in all ways")
    parser.add_argument("--output", type=Path, help="folder for page, picture and replays")
    parser.add_argument("--log", default="runs/franka.jsonl", help="file to go on from")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    command = (
        f"python -m benchmarks.{STUDY} --domain {given.domain} --tasks {given.tasks} "
        f"--first-seed {given.first_seed} --compared {given.compared}"
    )
    tasks = {"tasks": given.tasks, "first_seed": given.first_seed, "compared": given.compared}
    source = Provenance(given.domain, command, tasks)
    output = PageOutput(given.output, STUDY, source)
    seeds = range(given.first_seed, given.first_seed + given.tasks)
    with StudyLog(Path(given.log), source) as log:
        found = measure(given.domain, seeds, given.compared, log)
        output.write(report(found, given.domain), log.cpu_seconds)
    show(summary(found), given.json)


if __name__ == "__main__":
    main()
