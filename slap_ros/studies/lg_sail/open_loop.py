# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans with acquired skills, played by a robot in another physics without looking (Fig. 8)."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from statistics import median
from typing import TYPE_CHECKING, Any

from slap_ros.api.command_options import DomainName, Jobs, Preset
from slap_ros.api.left_out import Tell
from slap_ros.api.opening import open_chosen
from slap_ros.core import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.domains.benchtop.state_access import position_of
from slap_ros.errors import ErrorCode, SlapError
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.evaluation.experiment import solve
from slap_ros.evaluation.statistics import SuccessRate
from slap_ros.relational import State
from slap_ros.robot.mujoco.installed import require_mujoco
from slap_ros.robot.recorded_motion import RecordedMotion
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.studies.comparison import not_solved
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.domain_choices import (
    GoalNames,
    LibraryTasks,
    SkillLibraries,
    all_goals,
    library_origin,
    shipped_skills,
    with_demonstrator,
)
from slap_ros.studies.options import FRESH_SEED, RESULTS, FreshSeed, Output
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.row_figures import name_rows, plot_interval, plot_whole
from slap_ros.studies.study import PaperFigure, PreparedStudy, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DEMONSTRATED = "demonstrator"
MEASURED = """\
Each task is planned and executed in the contact world, whose hand acts by forces. The recorded
joint positions are then played by a Panda in MuJoCo, one after the other and each from rest to
rest. It does not look, as LG-SAIL's robot did not: poses are exact at the beginning, and nothing is
measured until everything is at rest again. Its plant begins in the task's state, with the bodies,
masses and friction of the domain's scene, and knows nothing of the recording: nothing is welded,
and no pose is put right. *Planned* is the share of tasks whose goal holds in the contact world.
*Solved* is the share whose goal holds in the state that is measured in MuJoCo, with Wilson's 95 %
interval; a task without a plan is not solved. *Not solved* counts the others by error code:
`UNSOLVABLE` and other codes of planning, `CONTROLLER_ABORTED` (the arm was held up, or the fingers
closed around nothing, and the robot holds), `REPLAY_MISMATCH` (played to the end, and the goal does
not hold). *Askew* is the angle between the recording's hand and what it has grasped, to the nearest
axis. *In the hand* is how far what is held is from where the recording's hand holds it, and how
much its x axis is turned: after the fingers have closed → before they open. Both are medians.
Skills are named by what proposed their operators, what made their rewards, and the seed of their
training. The demonstrator's scripts know the whole state and grasp straight, in the middle; they
show what the plant can do. The hands differ. The contact world's has pads of 18 × 20 mm with a
friction of 2.0, and closes at 150 mm/s; the Panda's are its real fingers with a friction of 1.0,
which close at 50 mm/s with the same force, while the arm stands. So they close where the
recording's fingers have met something, not where they were told to close. Of two bodies that touch,
the rougher one counts in MuJoCo; in the contact world, coefficients multiply. The arm's links touch
things in MuJoCo alone. A skill can therefore rest on what only one of the two hands can do."""
COLUMNS = ("goal", "skills", "planned", "solved", "askew", "in the hand", "not solved")


@dataclass(frozen=True)
class OpenLoopTrial:
    """What came of one task.

    Args:
        seed: Seed of the task.
        index: Index of the task.
        planned: Whether the goal holds at the end of the recording.
        success: Whether it holds in the state that was measured after it was played.
        steps: Environment steps of the recording.
        error_code: Error code of the failure; 0 where the task was solved.
        reason: Reason of the failure, in words; empty where the task was solved.
        grasps: How things lay in the hand, as
            :class:`~slap_ros.robot.mujoco.open_loop.GraspDeviation` has it.
        off_m: Distance of each thing from where the recording has it at the end, m, by name; empty
            where the motion was not played to its end.
    """

    seed: int
    index: int
    planned: bool
    success: bool
    steps: int
    error_code: int = 0
    reason: str = ""
    grasps: Sequence[Data] = ()
    off_m: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def from_json(cls, data: Data) -> OpenLoopTrial:
        """The trial that :func:`dataclasses.asdict` made such data of."""
        return cls(**data)


def play_task(choice: DomainChoice, goal: str, seed: int, index: int) -> OpenLoopTrial:
    """Plan for a task, execute the plan, and play what was recorded in MuJoCo.

    Args:
        choice: Domain with the skills to plan with.
        goal: Name of the goal; empty for the task's own.
        seed: Seed of the task.
        index: Index of the task among those of its seed.

    Returns:
        What came of it; a robot that holds after a fault has not solved its task.
    """
    from slap_ros.robot.mujoco.open_loop import OpenLoopPlayer  # needs an extra

    domain = open_domain(choice)
    task = task_with_goal(domain, seed, index, goal or None)
    episode = solve(domain, task, PURE_PLANNING)
    trial = OpenLoopTrial(seed, index, episode.success, False, episode.plan_length)
    if not episode.success:
        return replace(trial, error_code=int(episode.error.code), reason=episode.error.reason)
    recorded = RecordedMotion.of(domain, seed, index, episode.states, task.goal)
    player = OpenLoopPlayer(recorded)
    try:
        final = player.play()
    except SlapError as error:
        trial = replace(trial, error_code=int(error.code), reason=str(error))
    else:
        trial = _compared(trial, recorded, final)
    return replace(trial, grasps=[asdict(grasp) for grasp in player.grasps])


def _compared(trial: OpenLoopTrial, recorded: RecordedMotion, final: State) -> OpenLoopTrial:
    """The trial with what was measured beside what was recorded."""
    space, end = recorded.domain.atom_space(final), recorded.states[-1]
    missing = recorded.goal & ~space.abstract(final)
    things = [thing for thing in final.objects if "held" in thing.type.column]
    off_m = {
        thing.name: math.dist(position_of(final, thing), position_of(end, thing))
        for thing in things
    }
    code = ErrorCode.REPLAY_MISMATCH if missing else ErrorCode.NONE
    reason = f"{space.describe(missing)} does not hold" if missing else ""
    return replace(trial, success=not missing, error_code=int(code), reason=reason, off_m=off_m)


@dataclass(frozen=True)
class PlayedSkills:
    """Tasks of a goal, planned with the same skills.

    Args:
        goal: Name of the goal; empty for the goal that comes with each task.
        skills: Name of the skills.
        library: Digest of the library; empty for the demonstrator.
        trials: Trials, one per task.
    """

    goal: str
    skills: str
    library: str
    trials: tuple[OpenLoopTrial, ...]

    @property
    def planned(self) -> SuccessRate:
        """Share of the tasks whose recording reaches the goal."""
        return SuccessRate(sum(trial.planned for trial in self.trials), len(self.trials))

    @property
    def solved(self) -> SuccessRate:
        """Share of the tasks whose goal holds after the recording was played."""
        return SuccessRate(sum(trial.success for trial in self.trials), len(self.trials))

    @property
    def failures(self) -> Counter[str]:
        """Tasks that were not solved, by the name of their error code."""
        failed = [trial for trial in self.trials if not trial.success]
        return Counter(ErrorCode(trial.error_code).name for trial in failed)

    def in_hand(self, closed: bool) -> dict[str, float]:
        """How things lie in the hand, beside how they lie in the recording's.

        Args:
            closed: Whether fingers have just closed; else they are about to open.

        Returns:
            Medians of the deviations, by name; none where nothing was held.
        """
        found = [g for trial in self.trials for g in trial.grasps if g["closed"] == closed]
        names = ("shift_m", "turn_rad", "askew_rad") if found else ()
        return {name: median(one[name] for one in found) for name in names}

    def as_json(self) -> dict[str, Any]:
        """The summary, and every trial."""
        return {
            "goal": self.goal,
            "skills": self.skills,
            "library": self.library,
            "planned": self.planned.successes,
            "solved": self.solved.successes,
            "solved_interval": asdict(self.solved.interval),
            "failures": dict(self.failures),
            "in_hand_after_closing": self.in_hand(closed=True),
            "in_hand_before_opening": self.in_hand(closed=False),
            "trials": [asdict(trial) for trial in self.trials],
        }

    def as_row(self) -> list[str]:
        """Row of a table."""
        failures = [f"`{name}` {count}" for name, count in self.failures.most_common()]
        closed, opening = (self.in_hand(closed) for closed in (True, False))
        return [
            self.goal or "(the task's own)",
            self.skills,
            f"{self.planned.successes} of {self.planned.trials}",
            f"{self.solved.successes} of {self.solved.trials} ({self.solved})",
            f"{math.degrees(closed['askew_rad']):.0f}°" if closed else "-",
            f"{_in_words(closed)} → {_in_words(opening)}",
            ", ".join(failures) or "none",
        ]


def _in_words(in_hand: Mapping[str, float]) -> str:
    if not in_hand:
        return "-"
    return f"{1e3 * in_hand['shift_m']:.1f} mm, {math.degrees(in_hand['turn_rad']):.0f}°"


def study(
    choices: Mapping[str, DomainChoice],
    goals: Sequence[str],
    tasks: int,
    seed: int,
    runner: JobRunner,
) -> StudyReport:
    """Play the plans of every goal's tasks in MuJoCo.

    Args:
        choices: Domain with each choice of skills, by the name of the skills.
        goals: Names of goals; an empty name for the goal that comes with each task.
        tasks: Number of tasks per goal and choice of skills.
        seed: Seed of the tasks.
        runner: Runner of the jobs.

    Returns:
        The report.
    """
    rows = [
        _played(choice, name, goal, range(tasks), seed, runner)
        for goal in goals
        for name, choice in choices.items()
    ]
    domain = next(iter(choices.values())).name
    return StudyReport(
        study="open_loop",
        source="LG-SAIL Fig. 8",
        title=f"Open loop in another physics: {domain}",
        measured=MEASURED,
        table=MarkdownTable(COLUMNS, [row.as_row() for row in rows]),
        found={"rows": [row.as_json() for row in rows]},
        draw=lambda figure: draw(figure, rows),
        size=(7.0, 1.4 + 0.3 * len(rows)),
    )


def _played(
    choice: DomainChoice,
    name: str,
    goal: str,
    indices: Iterable[int],
    seed: int,
    runner: JobRunner,
) -> PlayedSkills:
    """What comes of a goal's tasks with some skills."""
    jobs = {f"{goal}, {name}: task {i}": (choice, goal, seed, i) for i in indices}
    what = f"{goal or choice.name}, {name}"
    trials = runner.run(what, play_task, OpenLoopTrial.from_json, jobs, failure=not_solved)
    return PlayedSkills(goal, name, choice.digest, tuple(trials.values()))


def draw(figure: Figure, rows: Sequence[PlayedSkills]) -> None:
    """Draw the share of solved tasks with its interval, row by row."""
    axes = figure.subplots()
    for place, row in enumerate(rows):
        plot_interval(axes, place, row.solved.interval)
        plot_whole(axes, place, 100 * row.solved.share)
    name_rows(axes, [f"{row.goal or 'own goal'}: {row.skills}" for row in rows])
    axes.set_xlim(-3, 103)
    axes.set_xlabel("solved open loop in MuJoCo [%], with 95 % interval")


def _summary(found: Data) -> str:
    """Solved tasks of every goal, with the first library, the others and the demonstrator."""
    goals: dict[str, list[Data]] = {}
    for row in found["rows"]:
        goals.setdefault(row["goal"], []).append(row)
    return "in MuJoCo, " + "; ".join(map(_of_goal, goals.values()))


def _of_goal(rows: Sequence[Data]) -> str:
    first, *others, shown = (row["solved"] for row in rows)
    besides = f"{min(others)} to {max(others)} with other libraries, " if others else ""
    tasks = len(rows[0]["trials"])
    return f"{rows[0]['goal']}: {first} of {tasks}, {besides}{shown} with {DEMONSTRATED}"


@dataclass(frozen=True, kw_only=True)
class OpenLoopOptions:
    """Options of this study."""

    domain: DomainName
    library: SkillLibraries = None
    goal: GoalNames = None
    tasks: LibraryTasks = 10
    seed: FreshSeed = FRESH_SEED
    preset: Preset = None
    jobs: Jobs = 1
    output: Output = RESULTS


def prepare(options: OpenLoopOptions, tell: Tell) -> PreparedStudy:
    """Open the domain with each library and with its demonstrator, and choose goals.

    Raises:
        InvalidParameterError: MuJoCo is not installed.
    """
    require_mujoco()
    folders = options.library or shipped_skills(options.domain)
    preset = get_domain(options.domain, options.preset).preset
    choices = {}
    for folder in folders:
        choice = DomainChoice(options.domain, preset, str(folder))
        choices[library_origin(choice)] = DomainChoice.of(open_chosen(choice, tell), choice.skills)
    choices[DEMONSTRATED] = with_demonstrator(options.domain, preset)
    goals = options.goal or all_goals(get_domain(options.domain, preset))
    return PreparedStudy(
        {"preset": preset, "tasks": options.tasks, "seed": options.seed},
        lambda runner: study(choices, goals, options.tasks, options.seed, runner),
        {"library": options.library, "goal": options.goal},
    )


STUDY = Study(
    "open_loop",
    help="LG-SAIL Fig. 8: plans of acquired skills, played open loop by a robot in MuJoCo.",
    example="slap study open_loop stack_at_target",
    options=OpenLoopOptions,
    prepare=prepare,
    summary=_summary,
    figures=(
        PaperFigure(
            "LG-SAIL Fig. 8",
            "open loop: theirs on a real robot, ours in MuJoCo",
            ("stack_at_target",),
            {"stack_at_target": "0.8 and 1.0 of 10 trials"},
        ),
    ),
    costs="planning and simulation",
)
