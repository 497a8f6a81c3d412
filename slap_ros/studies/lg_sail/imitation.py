# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Acquired skills beside clones that imitate them, in the same plans (LG-SAIL Table 7)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout
from slap_ros.api.command_options import CommandOption, DomainName, Jobs, Preset
from slap_ros.api.jobs import require_torch
from slap_ros.api.left_out import Tell
from slap_ros.core import Domain
from slap_ros.core.goals import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.summary import format_spread
from slap_ros.imitation.settings import CloningSettings
from slap_ros.imitation.unchecked_plans import UncheckedPlan, carry_out_unchecked
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.skills.skill import LearnedSkill
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail.domain_choices import (
    GoalNames,
    HandWrittenLibraries,
    LibraryTasks,
    all_goals,
    hand_written,
    shipped_skills,
)
from slap_ros.studies.lg_sail.library_progress import (
    LibrariesProgress,
    LibraryProgress,
    carry_out,
    learned_skills,
    of_library,
    without_states,
)
from slap_ros.studies.lg_sail.model_attempts import LanguageModel
from slap_ros.studies.lg_sail.model_options import LanguageOptions, answered_by
from slap_ros.studies.lg_sail.written_plans import Written, written_plans
from slap_ros.studies.options import FRESH_SEED, RESULTS, FreshSeed, Output
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.row_figures import name_rows, plot_each, plot_interval, plot_whole
from slap_ros.studies.study import PaperFigure, PreparedStudy, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED = """\
A* makes a plan of the same operators for every method, as few of them as possible, and nothing is
planned again. `lg_sail` carries it out with acquired skills. `tamp_imitation` does so with a clone
of each skill: a network of the same size that was fitted by least squares to what the acquired
skill did (behaviour cloning; not a diffusion policy as in the paper). Its trajectories are those of
our own acquired skills, library by library, in plans for the goal {shown}, each from the end of the
approach to the skill's success. Nobody demonstrated anything by hand. The tasks of the trajectories
are seen neither in training nor here. Clones see what the skills see: the robot and the operator's
objects, relative to each other. *Solved* is the share of tasks whose stages were all done, with
Wilson's 95 % interval over the tasks of all libraries. Task progress is the share of stages that
were done, as the mean ± sample standard deviation over libraries. The paper's figures are shares of
solved tasks in a simulator of its own; its other goal of Peg in Hole, *goal 2*, stands beside both
of ours, as our notes do not say which one it is. `language_imitation`, {asked}"""
NOT_ASKED = """\
which plans by a language
model, was not run."""
ASKED = """\
which plans by a language
model, has neither A* nor checks. For each task, the model that the row names was asked once for the
actions of the task, once for the operator of each action, and once for a plan of these. What can be
read of an answer is taken for whatever it says. The same clones carry out the plan, each step the
clone that adds most of what the step's operator adds, for no other objects than the step's. A task
is not solved where an answer cannot be read, where no clone adds anything of what a step adds (*no
such skill*), where a stage fails, or where the goal does not hold in the end. Task progress is that
of the model's own plan, and 0 where this does not lead to the goal. All libraries and numbers of
trajectories have the same plan for a task, so the interval is too narrow by far."""
OURS, CLONES, LANGUAGE = "lg_sail", "tamp_imitation", "language_imitation"
GOAL_2 = {OURS: "0.90 (goal 2)", CLONES: "0.40 (goal 2)", LANGUAGE: "0.10 (goal 2)"}
PAPER: Mapping[tuple[str, str], Mapping[str, str]] = {
    ("stack_at_target", "training"): {OURS: "1.00", CLONES: "0.95", LANGUAGE: "0.80"},
    ("peg_in_hole", "training"): {OURS: "0.95", CLONES: "0.70", LANGUAGE: "0.50"},
    ("peg_in_hole", "test1"): GOAL_2,
    ("peg_in_hole", "test2"): GOAL_2,
}


Rollouts = tuple[PlanRollout, ...]


@dataclass(frozen=True)
class ClonedLibrary:
    """The clones of a library's skills, and what came of tasks with them.

    Args:
        transitions: Number of observations that each clone learned from, by skill.
        errors: Root of the mean squared error of each clone's actions there, by skill.
        rollouts: Rollouts of A*'s plans, one per task, by goal.
        unchecked: Rollouts of the plans that each model wrote, by its name and by goal.
    """

    transitions: Mapping[str, int]
    errors: Mapping[str, float]
    rollouts: Mapping[str, Rollouts]
    unchecked: Mapping[str, Mapping[str, Rollouts]]

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> ClonedLibrary:
        """The clones of :func:`clone_and_carry_out`."""
        return cls(
            dict(data["transitions"]),
            dict(data["errors"]),
            _by_goal(data["rollouts"]),
            {str(model): _by_goal(some) for model, some in data.get("unchecked", {}).items()},
        )


def _by_goal(data: Mapping[str, Any]) -> dict[str, Rollouts]:
    return {str(goal): tuple(map(PlanRollout.from_json, some)) for goal, some in data.items()}


@dataclass(frozen=True, kw_only=True)
class MethodProgress(LibrariesProgress):
    """What a method makes of a goal's tasks, library by library.

    Args:
        domain: Name of the domain.
        goal: Name of the goal; empty for the goal that comes with each task.
        libraries: Progress with each library, or with clones of its skills.
        method: Name of the method.
        trajectories: Number of trajectories of each skill; None where nothing is imitated.
        model: Name of the language model that planned; empty where A* did.
    """

    method: str
    trajectories: int | None = None
    model: str = ""

    @property
    def name(self) -> str:
        """Name of the row in pictures."""
        of = "" if self.trajectories is None else f" {self.trajectories}"
        by = f"\n{self.model}" if self.model else ""
        return f"{self.goal or 'own goal'}: {self.method}{of}{by}"

    @property
    def paper(self) -> str:
        """The paper's share of solved tasks; empty where it has none."""
        return PAPER.get((self.domain, self.goal), {}).get(self.method, "")

    def as_json(self) -> dict[str, Any]:
        """The summary, and that of each library."""
        return {
            "goal": self.goal,
            "method": self.method,
            "trajectories": self.trajectories,
            "model": self.model,
            "solved": self.solved.share,
            "solved_interval": asdict(self.solved.interval),
            "progress": asdict(self.progress),
            "paper": self.paper,
            "libraries": [library.as_json() for library in self.libraries],
        }

    def as_row(self) -> list[str]:
        """Row of a table."""
        return [
            self.goal or "(the task's own)",
            f"`{self.method}`{self.model and f' ({self.model})'}",
            "-" if self.trajectories is None else str(self.trajectories),
            f"{len(self.libraries)} × {len(self.libraries[0].rollouts)}",
            str(self.solved),
            format_spread(self.progress, 2),
            self.failures,
            self.paper,
        ]


COLUMNS = (
    "goal",
    "method",
    "trajectories per skill",
    "libraries × tasks",
    "solved [95 %]",
    "task progress",
    "stages that failed",
    "paper",
)


def study(
    choices: Sequence[DomainChoice],
    counts: Sequence[int],
    goals: Sequence[str],
    tasks: tuple[int, int],
    models: Mapping[str, LanguageModel],
    runner: JobRunner,
) -> StudyReport:
    """Carry out plans with acquired skills, and with clones of them.

    Args:
        choices: Domain with the skills of each library.
        counts: Numbers of trajectories per skill.
        goals: Names of goals, the one of the trajectories first; an empty name for the goal that
            comes with each task.
        tasks: Number of tasks per goal and library, and their seed.
        models: Language models by name, whose plans the clones carry out as well.
        runner: Runner of the jobs.

    Returns:
        The report.
    """
    count, seed = tasks
    written = written_plans(models, choices[0], goals, tasks, runner)
    acquired = {
        goal: [of_library(one, goal, range(count), seed, runner)[1] for one in choices]
        for goal in goals
    }
    libraries = acquired[goals[0]]
    batch = {
        _job(library, number): (one, number, tuple(goals), tasks, written)
        for number, (one, library) in product(counts, zip(choices, libraries, strict=True))
    }
    found = runner.run("cloning", clone_and_carry_out, ClonedLibrary.from_json, batch)
    cloned = {number: [found[_job(one, number)] for one in libraries] for number in counts}
    rows = [row for goal in goals for row in _rows(choices[0].name, goal, acquired[goal], cloned)]
    return StudyReport(
        study="imitation",
        source="LG-SAIL Table 7",
        title=f"Acquired skills and clones of them: {choices[0].name}",
        measured=MEASURED.format(
            shown=goals[0] or "that comes with each task", asked=ASKED if models else NOT_ASKED
        ),
        table=MarkdownTable(COLUMNS, [row.as_row() for row in rows]),
        found={
            "cloning": asdict(CloningSettings()),
            "clones": {
                name: {"transitions": one.transitions, "errors": one.errors}
                for name, one in found.items()
            },
            "rows": [row.as_json() for row in rows],
            **({"written": _in_words(written)} if written else {}),
        },
        draw=lambda figure: draw(figure, rows),
        size=(7.0, 1.2 + 0.35 * len(rows)),
    )


def _job(library: LibraryProgress, trajectories: int) -> str:
    return f"clones of {library.digest}, {trajectories} trajectories"


def _in_words(written: Written) -> dict[str, dict[str, list[dict[str, Any]]]]:
    """The plans as the report's JSON has them."""
    return {
        model: {goal: [one.as_json() for one in some] for goal, some in goals.items()}
        for model, goals in written.items()
    }


def _rows(
    domain: str,
    goal: str,
    acquired: Sequence[LibraryProgress],
    cloned: Mapping[int, Sequence[ClonedLibrary]],
) -> list[MethodProgress]:
    """The rows of a goal: acquired skills, then clones, with A*'s plans and with each model's.

    Clones from each number of trajectories have a row.
    """

    def row(
        rollouts: Sequence[Rollouts], method: str, number: int | None = None, model: str = ""
    ) -> MethodProgress:
        libraries = tuple(
            replace(library, rollouts=some)
            for library, some in zip(acquired, rollouts, strict=True)
        )
        return MethodProgress(
            domain=domain,
            goal=goal,
            libraries=libraries,
            method=method,
            trajectories=number,
            model=model,
        )

    rows = [row([library.rollouts for library in acquired], OURS)]
    rows += [
        row([one.rollouts[goal] for one in clones], CLONES, number)
        for number, clones in cloned.items()
    ]
    rows += [
        row([one.unchecked[model][goal] for one in clones], LANGUAGE, number, model)
        for number, clones in cloned.items()
        for model in clones[0].unchecked
    ]
    return rows


def clone_and_carry_out(
    choice: DomainChoice,
    trajectories: int,
    goals: Sequence[str],
    tasks: tuple[int, int],
    written: Written,
) -> dict[str, Any]:
    """Clone the skills of a library, and carry out plans with the clones.

    Args:
        choice: Domain with the skills of the library.
        trajectories: Number of trajectories of each skill, from plans for the first goal.
        goals: Names of goals to carry out plans for.
        tasks: Number of tasks per goal, and their seed.
        written: Plans that language models wrote, one per task, by model and goal.

    Returns:
        A :class:`ClonedLibrary` as JSON.
    """
    from slap_ros.imitation.cloning import clone_skills
    from slap_ros.imitation.trajectories import record_trajectories

    domain = open_domain(choice)
    skills = learned_skills(domain)
    shown = record_trajectories(domain, goals[0], skills, trajectories)
    clones = clone_skills(skills, shown, CloningSettings(), seed=0)
    cloned = {name: clone.skill for name, clone in clones.items()}
    count, seed = tasks
    return {
        "transitions": {name: clone.transitions for name, clone in clones.items()},
        "errors": {name: clone.error for name, clone in clones.items()},
        "rollouts": {
            goal: [carry_out(domain, goal, seed, index, cloned) for index in range(count)]
            for goal in goals
        },
        "unchecked": {
            model: {
                goal: [
                    _carry_out_written(domain, goal, seed, index, one.plan, cloned)
                    for index, one in enumerate(plans)
                ]
                for goal, plans in by_goal.items()
            }
            for model, by_goal in written.items()
        },
    }


def _carry_out_written(
    domain: Domain,
    goal: str,
    seed: int,
    index: int,
    plan: UncheckedPlan,
    skills: Mapping[str, LearnedSkill],
) -> dict[str, Any]:
    task = task_with_goal(domain, seed, index, goal)
    return without_states(carry_out_unchecked(domain, task, index, plan, skills))


def draw(figure: Figure, rows: Sequence[MethodProgress]) -> None:
    """Draw the share of solved tasks with its interval, and that of each library."""
    axes = figure.subplots()
    for place, row in enumerate(rows):
        plot_interval(axes, place, row.solved.interval)
        plot_each(axes, place, [_solved(library) for library in row.libraries])
        plot_whole(axes, place, 100 * row.solved.share)
    name_rows(axes, [row.name for row in rows])
    axes.set_xlim(-3, 103)
    axes.set_xlabel("tasks solved [%]: each library, all of a row (dot) with 95 % interval")


def _solved(library: LibraryProgress) -> float:
    """Percent of a library's tasks whose stages were all done."""
    done = sum(rollout.progress == 1.0 for rollout in library.rollouts)
    return 100 * done / len(library.rollouts)


def _summary(found: Data) -> str:
    """Shares of solved tasks by goal, each method's; of clones, those with most trajectories."""
    rows = found["rows"]
    most = max(row["trajectories"] or 0 for row in rows)
    goals = dict.fromkeys(row["goal"] for row in rows)
    return ", ".join(
        f"{goal} {' / '.join(_share(r) for r in rows if _is_of(r, goal, most))}".strip()
        for goal in goals
    )


def _is_of(row: Data, goal: str, trajectories: int) -> bool:
    return row["goal"] == goal and row["trajectories"] in (None, trajectories)


def _share(row: Data) -> str:
    by = f" ({row['model']})" if row.get("model") else ""
    return f"{row['solved']:.2f}{by}"


@dataclass(frozen=True, kw_only=True)
class ImitationOptions(LanguageOptions):
    """Options of this study."""

    domain: DomainName
    model: Annotated[
        list[str] | None,
        CommandOption(
            "Name of a language model whose plans the clones carry out as well. May be repeated. "
            "Default: none, unless a cassette is replayed."
        ),
    ] = None
    library: HandWrittenLibraries = None
    trajectories: Annotated[
        list[int] | None,
        CommandOption(
            "Number of trajectories per skill, from plans for the first goal. May be repeated. "
            "Default: 50, as in the paper.",
            least=1,
        ),
    ] = None
    goal: GoalNames = None
    tasks: LibraryTasks = 50
    seed: FreshSeed = FRESH_SEED
    preset: Preset = None
    jobs: Jobs = 1
    output: Output = RESULTS

    @property
    def asked(self) -> dict[str, LanguageModel]:
        """The models to ask, by name; none where no option names one.

        Raises:
            InvalidParameterError: There are options for a model, and no model.
            SlapError: As for :meth:`LanguageOptions.models`.
        """
        if self.model or self.cassette != "live":
            return self.models()
        if self.base_url or self.language_settings:
            raise InvalidParameterError("--base-url and --language-settings need --model")
        return {}


def prepare(options: ImitationOptions, _: Tell) -> PreparedStudy:
    """Open the domain with each library and the language models, and choose goals."""
    require_torch()
    models = options.asked
    folders = options.library or hand_written(shipped_skills(options.domain))
    domain = get_domain(options.domain, options.preset)
    choices = [DomainChoice(domain.name, domain.preset, str(folder)) for folder in folders]
    counts = list(dict.fromkeys(options.trajectories or (50,)))
    goals = list(dict.fromkeys(options.goal or all_goals(domain)))
    tasks = options.tasks, options.seed

    def make(runner: JobRunner) -> StudyReport:
        report = study(choices, counts, goals, tasks, models, runner)
        return options.dated(report) if models else report

    return PreparedStudy(
        {
            "preset": domain.preset,
            "trajectories": counts,
            "trainings": len(choices) * len(counts),
            "tasks": options.tasks,
            "seed": options.seed,
            **(
                {
                    "model": [*models],
                    "answered_by": answered_by(models),
                    "base_url": options.base_url,
                }
                if models
                else {}
            ),
        },
        make,
        {
            "library": options.library,
            "goal": options.goal,
            "trainings": None,
            **options.replayed,
        },
    )


STUDY = Study(
    "imitation",
    help="LG-SAIL Table 7: acquired skills beside clones that imitate them, per goal; with "
    "`--model`, also by the plans of a language model.",
    example="slap study imitation peg_in_hole --preset fair:clearance=5",
    options=ImitationOptions,
    prepare=prepare,
    summary=_summary,
    figures=(
        PaperFigure(
            "LG-SAIL Table 7",
            "acquired skills / imitation with planning / with a language model's plans",
            ("stack_at_target", "peg_in_hole"),
            {
                "stack_at_target": "1.00 / 0.95 / 0.80",
                "peg_in_hole": "0.95 / 0.70 / 0.50, goal 2 0.90 / 0.40 / 0.10",
            },
        ),
    ),
)
