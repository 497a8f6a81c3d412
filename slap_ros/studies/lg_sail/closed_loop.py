# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Acquired skills that act on what is measured on a robot in another physics, at 20 Hz."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.api.command_options import CommandOption, DomainName, Jobs, Preset
from slap_ros.api.left_out import Tell
from slap_ros.api.opening import open_chosen
from slap_ros.api.shortcut_choice import choose_library
from slap_ros.core import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.approaches import PURE_PLANNING, Approach
from slap_ros.evaluation.experiment import Trial, solve
from slap_ros.evaluation.summary import format_spread
from slap_ros.planning.execution import MAX_REPLANS
from slap_ros.robot.mujoco.installed import require_mujoco
from slap_ros.skills.domain_choice import DEMONSTRATOR, DomainChoice, open_domain
from slap_ros.studies.comparison import failures, failures_in_words, not_solved
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.domain_choices import (
    GoalNames,
    LibraryTasks,
    all_goals,
    library_origin,
    shipped_skills,
    with_demonstrator,
)
from slap_ros.studies.options import FRESH_SEED, RESULTS, FreshSeed, Output
from slap_ros.studies.replanned_trials import ReplannedTrials
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.robot_trials import solve_on_robot
from slap_ros.studies.row_figures import name_rows, plot_interval, plot_whole
from slap_ros.studies.study import PreparedStudy, Study
from slap_ros.worlds.contact.features import ROBOT
from slap_ros.worlds.panda import IMPEDANCE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from slap_ros.robot.mujoco.arm import ArmControl

OWN = "contact world"
MEASURED = f"""\
Each task is planned in the contact world, whose hand acts by forces, and executed by a Panda in
MuJoCo in closed loop. In each control period (0.05 s) the skill acts on the measured state, and its
command replaces the one before: the arm's joints are pulled to where the contact world would pull
its hand. Nothing waits for the arm to arrive or for fingers to close. The measured state has the
joints, the hand's pose and velocity that follow from them, fingers, exact poses and velocities of
things, what both fingers press on, and where the hand was told to be. Where a skill does not end as
planned, the planner plans again from the measured state, {MAX_REPLANS} times at most. The plant
knows nothing of the plan: nothing is welded, and no pose is put right. *Arm* is how stiff it is,
with the torques of a Panda: the hand is pulled by so many N/m, and by 60 N at most along each axis
(impedance), or the joints are so many times as stiff as the usual arm of `slap run --world mujoco`
(500 to 1100 Nm/rad) and, in motion, behind their commands by `lag`. The first row of each choice of
skills is the contact world itself, with the hand of the preset (`hand=panda`, or the quick one).
*Solved* is the share of the tasks whose goal holds in the measured state, with Wilson's 95 %
interval. Steps are control periods, over solved tasks; replans are over all tasks; both are
mean ± sample standard deviation. *Not solved* counts the others by error code. Skills are named by
what proposed their operators, what made their rewards, and the seed of their training; nothing was
trained again. The demonstrator's scripts know the whole state. Fingers differ as they do
[open loop](../mujoco.md#open-loop-at-a-bench)."""
COLUMNS = ("goal", "skills", "arm", "solved", "steps", "replans", "not solved")


@dataclass(frozen=True)
class ArmChoice:
    """How stiff an arm is.

    Args:
        impedance: Stiffness with which the hand is pulled, N/m; 0: that of joints counts.
        stiffness: How many times as stiff as usual the joints are.
        lag_s: Time by which a joint in motion is behind its command, s.
    """

    impedance: float = 0.0
    stiffness: float = 1.0
    lag_s: float = 0.07

    @property
    def control(self) -> ArmControl:
        """The control of the arm.

        Raises:
            InvalidParameterError: A number is not above 0 that counts.
        """
        from slap_ros.robot.mujoco.impedance import arm_control  # needs an extra

        return arm_control(self.impedance, self.stiffness, self.lag_s)

    def as_json(self) -> dict[str, Any]:
        """What counts of it."""
        if self.impedance:
            return {"stiffness": None, "impedance": self.impedance}
        return {"stiffness": self.stiffness, "impedance": None}


@dataclass(frozen=True)
class MeasuredLoop:
    """What a task is solved with, made again in the process that solves it.

    Args:
        choice: Domain with the skills to plan with.
        goal: Name of the goal; empty for the task's own.
        arm: How stiff the arm is; None for no arm: the contact world itself.
        approach: Way to plan: with shortcuts over the skills, or without.
    """

    choice: DomainChoice
    goal: str
    arm: ArmChoice | None
    approach: Approach = PURE_PLANNING

    @property
    def arm_as_json(self) -> dict[str, Any]:
        """The arm; nothing of one where there is none."""
        return {"stiffness": None, "impedance": None} if self.arm is None else self.arm.as_json()


def solve_in_loop(loop: MeasuredLoop, seed: int, index: int) -> Trial:
    """Plan for a task, and execute the plan in closed loop.

    Args:
        loop: What it is solved with.
        seed: Seed of the task.
        index: Index of the task among those of its seed.

    Returns:
        What came of it.
    """
    arm = loop.arm
    domain = open_domain(replace(loop.choice, measured=arm is not None))
    task = task_with_goal(domain, seed, index, loop.goal or None)
    if arm is None:
        return Trial.of(seed, index, solve(domain, task, loop.approach))
    from slap_ros.robot.mujoco.contact_loop import ContactLoopWorld  # needs an extra

    return solve_on_robot(
        domain,
        task,
        lambda domain, state: loop.approach.planner("lazy", domain, state),
        lambda domain, state: ContactLoopWorld(domain, state, arm.control),
    )


def arm_in_words(row: Mapping[str, Any]) -> str:
    """The arm by its stiffness, or what is in its place; earlier results have no impedance."""
    if impedance := row.get("impedance"):
        return f"{impedance:g} N/m"
    return OWN if row["stiffness"] is None else f"× {row['stiffness']:g}"


@dataclass(frozen=True)
class LoopRow:
    """Tasks of a goal, solved with the same skills by the same arm.

    Args:
        loop: What they were solved with.
        skills: Name of the skills.
        trials: Trials, one per task.
    """

    loop: MeasuredLoop
    skills: str
    trials: tuple[Trial, ...]

    @property
    def arm(self) -> str:
        """The arm in words."""
        return arm_in_words(self.loop.arm_as_json)

    @property
    def figures(self) -> ReplannedTrials:
        """Success, length and replans."""
        return ReplannedTrials(self.trials)

    def as_json(self) -> dict[str, Any]:
        """The summary, and every trial."""
        return {
            "goal": self.loop.goal,
            "skills": self.skills,
            "library": self.loop.choice.digest,
            **self.loop.arm_as_json,
            **self.figures.as_json(),
            "failures": dict(failures(self.trials)),
            "trials": [trial.as_json() for trial in self.trials],
        }

    def as_row(self) -> list[str]:
        """Row of a table."""
        figures = self.figures
        return [
            self.loop.goal or "(the task's own)",
            self.skills,
            self.arm,
            f"{figures.solved.successes} of {figures.solved.trials} ({figures.solved})",
            format_spread(figures.length, 0),
            format_spread(figures.replans, 1),
            failures_in_words(self.trials),
        ]


def study(
    loops: Mapping[str, Sequence[MeasuredLoop]], tasks: int, seed: int, runner: JobRunner
) -> StudyReport:
    """Solve the tasks of every goal in closed loop.

    Args:
        loops: What tasks are solved with, by the name of the skills.
        tasks: Number of tasks per goal, choice of skills and arm.
        seed: Seed of the tasks.
        runner: Runner of the jobs.

    Returns:
        The report.
    """
    rows = [
        _solved(loop, skills, range(tasks), seed, runner)
        for skills, some in loops.items()
        for loop in some
    ]
    return StudyReport(
        study="closed_loop",
        source="",
        title=f"Closed loop in another physics: {rows[0].loop.choice.name}",
        measured=MEASURED,
        table=MarkdownTable(COLUMNS, [row.as_row() for row in rows]),
        found={"rows": [row.as_json() for row in rows]},
        draw=lambda figure: draw(figure, rows),
        size=(7.0, 1.4 + 0.3 * len(rows)),
    )


def _solved(
    loop: MeasuredLoop, skills: str, indices: Iterable[int], seed: int, runner: JobRunner
) -> LoopRow:
    """What comes of a goal's tasks with some skills and an arm."""
    what = f"{loop.goal or loop.choice.name}, {skills}, {arm_in_words(loop.arm_as_json)}"
    jobs = {f"{what}: task {i}": (loop, seed, i) for i in indices}
    trials = runner.run(what, solve_in_loop, Trial.from_json, jobs, failure=not_solved)
    return LoopRow(loop, skills, tuple(trials.values()))


def draw(figure: Figure, rows: Sequence[LoopRow]) -> None:
    """Draw the share of solved tasks with its interval, row by row."""
    axes = figure.subplots()
    for place, row in enumerate(rows):
        solved = row.figures.solved
        plot_interval(axes, place, solved.interval)
        plot_whole(axes, place, 100 * solved.share)
    name_rows(axes, [f"{one.loop.goal or 'own goal'}: {one.skills}, {one.arm}" for one in rows])
    axes.set_xlim(-3, 103)
    axes.set_xlabel("solved in closed loop [%], with 95 % interval")


def _summary(found: Data) -> str:
    """Solved tasks by arm, for every choice of skills at the first goal."""
    first = found["rows"][0]["goal"]
    words: dict[str, list[str]] = {}
    for row in (row for row in found["rows"] if row["goal"] == first):
        arm = arm_in_words(row)
        solved = sum(trial["success"] for trial in row["trials"])
        words.setdefault(row["skills"], []).append(f"{arm} {solved} of {len(row['trials'])}")
    return "; ".join(f"{skills}: {', '.join(arms)}" for skills, arms in words.items())


@dataclass(frozen=True, kw_only=True)
class ClosedLoopOptions:
    """Options of this study."""

    domain: DomainName
    library: Annotated[
        list[Path] | None,
        CommandOption(
            "Folder that `slap acquire` made. May be repeated. Default: the one that ships.",
            metavar="FOLDER",
            name="--library",
        ),
    ] = None
    goal: GoalNames = None
    impedance: Annotated[
        list[float] | None,
        CommandOption(
            f"Stiffness with which the hand is pulled, in N/m. May be repeated. "
            f"Default: {IMPEDANCE:g}, without --stiffness.",
            name="--impedance",
        ),
    ] = None
    stiffness: Annotated[
        list[float] | None,
        CommandOption("Stiffness of joints that are pulled instead, as a factor. May be repeated."),
    ] = None
    lag: Annotated[
        float, CommandOption("Time by which a joint in motion is behind its command, in s.")
    ] = 0.07
    tasks: LibraryTasks = 10
    seed: FreshSeed = FRESH_SEED
    preset: Preset = None
    jobs: Jobs = 1
    output: Output = RESULTS
    shortcuts: Annotated[
        Path | None,
        CommandOption(
            "Shortcuts over the skills of --library: rows with them stand beside those without.",
            metavar="FOLDER",
        ),
    ] = None


def _ways_to_plan(
    options: ClosedLoopOptions, preset: str, tell: Tell
) -> dict[str, tuple[DomainChoice, Approach]]:
    """Skills with their ways to plan, by their name: libraries first, the demonstrator last."""
    ways: dict[str, tuple[DomainChoice, Approach]] = {}
    for folder in options.library or shipped_skills(options.domain)[:1]:
        chosen = DomainChoice(options.domain, preset, str(folder))
        domain, skills = open_chosen(chosen, tell), library_origin(chosen)
        choice = DomainChoice.of(domain, chosen.skills)
        ways[skills] = choice, PURE_PLANNING
        library = choose_library(options.shortcuts, domain, "lazy", tell)
        if library is not None:
            ways[f"{skills}, and shortcuts"] = choice, Approach("slap", library.shortcuts)
    ways[DEMONSTRATOR] = with_demonstrator(options.domain, preset), PURE_PLANNING
    return ways


def _arms(options: ClosedLoopOptions) -> list[ArmChoice]:
    """The arms that are asked for: impedances first.

    Raises:
        InvalidParameterError: There is no such arm.
    """
    impedances = options.impedance or ([] if options.stiffness else [IMPEDANCE])
    arms = [ArmChoice(impedance=impedance) for impedance in impedances]
    arms += [ArmChoice(0.0, factor, options.lag) for factor in options.stiffness or ()]
    for arm in arms:
        _ = arm.control
    return arms


def prepare(options: ClosedLoopOptions, tell: Tell) -> PreparedStudy:
    """Open the domain with each library and with its demonstrator; choose goals and arms.

    Raises:
        InvalidParameterError: MuJoCo is not installed, there is no such arm, or the domain has no
            hand that acts by forces.
    """
    require_mujoco()
    domain = get_domain(options.domain, options.preset)
    if ROBOT not in domain.types:
        raise InvalidParameterError(
            f"{options.domain} has no hand that acts by forces; `slap study transfer "
            f"{options.domain}` is its closed loop"
        )
    arms = _arms(options)
    loops = {
        skills: [
            MeasuredLoop(choice, goal, arm, approach)
            for goal in options.goal or all_goals(domain)
            for arm in (None, *arms)
        ]
        for skills, (choice, approach) in _ways_to_plan(options, domain.preset, tell).items()
    }
    return PreparedStudy(
        {
            "preset": domain.preset,
            "impedance": [arm.impedance for arm in arms if arm.impedance] or None,
            "stiffness": [arm.stiffness for arm in arms if not arm.impedance] or None,
            "lag": options.lag,
            "tasks": options.tasks,
            "seed": options.seed,
        },
        lambda runner: study(loops, options.tasks, options.seed, runner),
        {"library": options.library, "goal": options.goal, "shortcuts": options.shortcuts},
    )


STUDY = Study(
    "closed_loop",
    help="Acquired skills in closed loop on a robot in MuJoCo that is commanded as it moves.",
    example="slap study closed_loop stack_at_target",
    options=ClosedLoopOptions,
    prepare=prepare,
    summary=_summary,
    costs="planning and simulation",
)
