# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How many candidate shortcuts random rollouts leave over (SLAP §4.2, B.1 and Table 2)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from slap_ros.api.command_options import CommandOption
from slap_ros.api.left_out import Tell
from slap_ros.drawing.palette import MUTED, PLAN
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.experiment import Trial
from slap_ros.evaluation.summary import Spread, format_spread
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.shortcuts import jobs as training_jobs
from slap_ros.shortcuts.candidate_groups import problem_key
from slap_ros.shortcuts.exploration_result import ExplorationResult
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.named_settings import training_settings
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.comparison import Comparison
from slap_ros.studies.comparison_options import ChosenComparison, ComparisonOptions
from slap_ros.studies.figures import legend_above
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.results import Data, MarkdownTable, StudyReport
from slap_ros.studies.slap.explored_tasks import explore_tasks
from slap_ros.studies.slap.library_plans import LibraryPlans, plan_with
from slap_ros.studies.slap.trainings import TrainingFolder, described
from slap_ros.studies.study import SLAP_DOMAINS, PaperFigure, PreparedStudy, Study, format_steps

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MEASURED = """\
Candidates are pairs of abstract states of a task's graph, the later one second, that no option
joins. Of N random rollouts from the first state, at least K must end in the second; otherwise the
pair is pruned. Here, rollouts begin only in the abstract states that are cheapest to reach. A pair
remains only if its shortcut would also make the plan of the task shorter. So more is pruned than in
the paper. Up to objects, the pairs that remain in all tasks are far fewer different things to
learn. Tasks are those of training. Spread is the sample standard deviation over tasks.

{settings} {overall}

In the paper, K/N of 5 to 25 % gives plans of 167 to 202 steps, and 30 % and more gives 333 to 349:
shortcuts that are pruned too eagerly are missing from the plans."""
PLANNED = """

Plan length is the length of executed plans on the same {tasks} tasks of evaluation. They use the
library named below, but not those of its shortcuts whose candidates all have fewer than K hits.
Length is the mean ± sample standard deviation, and relative to pure planning. Nothing is trained
again, so the numbers leave out what a training would have learned instead of a pruned shortcut."""


@dataclass(frozen=True)
class PrunedCandidates:
    """What is left of one task's candidates.

    Args:
        seed: Seed of the training.
        index: Index of the task in the training.
        explored: Result of exploring the task.
    """

    seed: int
    index: int
    explored: ExplorationResult

    def remaining(self, hits: int) -> int:
        """Number of pairs reached in at least so many rollouts."""
        return sum(candidate.hits >= hits for candidate in self.explored.candidates)

    def percent(self, hits: int) -> float:
        """Share of the pairs that remain, in %; 0 where there are no candidates."""
        return 100.0 * self.remaining(hits) / max(1, self.explored.pairs)

    def as_json(self) -> dict[str, Any]:
        """Candidates, environment steps and hits, for the report's JSON."""
        return {
            "seed": self.seed,
            "index": self.index,
            "candidates": self.explored.pairs,
            "environment_steps": self.explored.environment_steps,
            "hits": sorted(
                (candidate.hits for candidate in self.explored.candidates), reverse=True
            ),
        }


def explore(
    trainings: Sequence[TaskDistribution],
    tasks: int,
    settings: ExplorationSettings,
    runner: JobRunner,
) -> tuple[PrunedCandidates, ...]:
    """Explore the first tasks of trainings, as these do.

    Args:
        trainings: Task distributions of the trainings, all of one domain.
        tasks: Number of tasks per training.
        settings: Settings of exploration.
        runner: Runner of the jobs.

    Returns:
        What is left of each task's candidates; tasks that could not be explored are left out.

    Raises:
        UnsolvableError: No task can be planned for, so none can be explored.
    """
    jobs = {
        f"seed {training.seed}, task {index}": (training, index, settings)
        for training in trainings
        for index in range(tasks)
    }
    decode, domain = ExplorationResult.from_json, trainings[0].domain.name
    found = explore_tasks(runner, domain, training_jobs.try_to_explore, decode, jobs)
    return tuple(
        PrunedCandidates(jobs[name][0].seed, jobs[name][1], explored)
        for name, explored in found.items()
    )


def explored_in(
    folders: Sequence[TrainingFolder], domain: str
) -> tuple[tuple[PrunedCandidates, ...], ExplorationSettings]:
    """What trainings have explored already, and how all of them did.

    Raises:
        InvalidParameterError: A folder has nothing explored, damaged files, another domain's, or
            another way to explore than the first.
    """
    how = folders[0].exploration()
    for folder in folders:
        folder.require_domain(domain)
        if folder.exploration() != how:
            raise InvalidParameterError(
                f"{folder.path} was explored in another way than {folders[0].path}; give trainings "
                "that differ in their seeds alone"
            )
    pruned = tuple(
        PrunedCandidates(folder.distribution()["seed"], index, explored)
        for folder in folders
        for index, explored in enumerate(folder.explored())
    )
    return pruned, how


def study(
    pruned: Sequence[PrunedCandidates], settings: ExplorationSettings, comparison: Comparison
) -> StudyReport:
    """The report on what is left, by the number of rollouts that must succeed.

    Args:
        pruned: Candidates of each task.
        settings: Settings with which all tasks were explored.
        comparison: Pure planning, and for plan length SLAP with a library.

    Returns:
        The report.
    """
    thresholds = _thresholds(settings)
    explored = [one.explored for one in pruned]
    several = len(comparison.approaches) > 1
    plans = plan_without_pruned(comparison, explored, thresholds) if several else {}
    measured = MEASURED.format(settings=_said(settings), overall=_overall(pruned, settings))
    if plans:
        measured += PLANNED.format(tasks=len(comparison.experiment))
        measured += f"\n\n{_by_threshold(pruned, settings, plans).as_markdown()}"
    signatures = {
        (candidate.signature.patterns, candidate.signature.context)
        for one in pruned
        for candidate in one.explored.candidates
    }
    return StudyReport(
        study="pruning",
        source="SLAP §4.2 and Table 2",
        title=f"Pruning: {comparison.domain.name}",
        measured=measured,
        table=_table(pruned, settings, len(signatures)),
        found={
            "exploration": settings.as_json(),
            "thresholds": [_at(hits, pruned, settings, plans.get(hits)) for hits in thresholds],
            "different_up_to_objects": len(signatures),
            **({"plans": _different(plans.values())} if plans else {}),
            "tasks": [one.as_json() for one in pruned],
        },
        draw=lambda figure: draw(figure, pruned, settings, plans),
        size=(5.6, 5.4 if plans else 3.4),
    )


def _said(settings: ExplorationSettings) -> str:
    return (
        f"N = {settings.rollouts} rollouts of {settings.length} environment steps from each of the "
        f"{settings.nodes} cheapest abstract states; training prunes with K = {settings.hits}."
    )


def _overall(pruned: Sequence[PrunedCandidates], settings: ExplorationSettings) -> str:
    candidates = sum(one.explored.pairs for one in pruned)
    remaining = sum(one.remaining(settings.hits) for one in pruned)
    part = 100.0 * remaining / max(1, candidates)
    return f"In {len(pruned)} tasks, {remaining} of {candidates:,} candidates remain: {part:.1f} %."


def _thresholds(settings: ExplorationSettings) -> list[int]:
    """Hits to ask for: from what training asks for to all rollouts, doubled again and again."""
    thresholds = [settings.hits]
    while 2 * thresholds[-1] <= settings.rollouts:
        thresholds.append(2 * thresholds[-1])
    return thresholds


def most_hits(shortcut: Shortcut, explored: Sequence[ExplorationResult]) -> int:
    """Rollouts that reached a candidate which the shortcut was, or could be, learned for.

    Args:
        shortcut: Shortcut of a library.
        explored: Results of the tasks in which candidates were looked for.

    Returns:
        The most in any task; 0 where there was no such candidate.
    """
    key = problem_key(shortcut.signature)
    candidates = (candidate for one in explored for candidate in one.candidates)
    same = (one.hits for one in candidates if problem_key(one.signature) == key)
    return max(same, default=0)


def plan_without_pruned(
    comparison: Comparison, explored: Sequence[ExplorationResult], thresholds: Sequence[int]
) -> Mapping[int, LibraryPlans]:
    """Plan with the shortcuts that each threshold leaves over, as if there never were others.

    Args:
        comparison: Pure planning, and SLAP with the whole library; the tasks.
        explored: The tasks in which candidates were looked for.
        thresholds: Hits that a candidate must have.

    Returns:
        The plans by threshold.
    """
    library = comparison.approaches[-1].shortcuts
    hits = {shortcut.name: most_hits(shortcut, explored) for shortcut in library}
    solved: dict[tuple[str, ...], tuple[Trial, ...]] = {}

    def plans_with(threshold: int) -> LibraryPlans:
        kept = tuple(one for one in library if hits[one.name] >= threshold)
        names = tuple(one.name for one in kept)
        if names not in solved:
            solved[names] = plan_with(comparison, kept, f"{len(names)} shortcuts")
        return LibraryPlans(names, solved[names], solved[()])

    solved[()] = plan_with(comparison, (), "0 shortcuts")
    return {threshold: plans_with(threshold) for threshold in thresholds}


def _at(
    hits: int,
    pruned: Sequence[PrunedCandidates],
    settings: ExplorationSettings,
    plans: LibraryPlans | None,
) -> dict[str, Any]:
    """What is left at one threshold.

    Args:
        hits: Threshold: number of rollouts that must succeed.
        pruned: Candidates of each task.
        settings: Settings with which all tasks were explored.
        plans: Plans with the shortcuts that are left, if any were made.
    """
    return {
        "k": hits,
        "k_over_n": hits / settings.rollouts,
        "remaining": sum(one.remaining(hits) for one in pruned),
        "remaining_percent": asdict(Spread.of([one.percent(hits) for one in pruned])),
        **(plans.summary() if plans else {}),
    }


def _different(plans: Iterable[LibraryPlans]) -> list[dict[str, Any]]:
    """The plans with different shortcuts, for the report's JSON."""
    by_shortcuts = {one.shortcuts: one.as_json() for one in plans}
    return list(by_shortcuts.values())


def _by_threshold(
    pruned: Sequence[PrunedCandidates],
    settings: ExplorationSettings,
    plans: Mapping[int, LibraryPlans],
) -> MarkdownTable:
    """A table with a row per threshold."""
    rows = []
    for hits, own in plans.items():
        percent = format_spread(Spread.of([one.percent(hits) for one in pruned]), 1)
        rows.append([str(hits), f"{100 * hits / settings.rollouts:.3g}", percent, *own.as_cells()])
    return MarkdownTable(
        ["K", "K/N [%]", "remaining [%]", "shortcuts", "plan length [steps]", "relative"], rows
    )


def _table(
    pruned: Sequence[PrunedCandidates], settings: ExplorationSettings, different: int
) -> MarkdownTable:
    """A table with one row per task, then one for all of them."""
    hits = settings.hits
    candidates = sum(one.explored.pairs for one in pruned)
    remaining = sum(one.remaining(hits) for one in pruned)
    rows = [
        [
            str(one.seed),
            str(one.index),
            f"{one.explored.pairs:,}",
            str(one.remaining(hits)),
            f"{one.percent(hits):.1f}",
            "",
        ]
        for one in pruned
    ]
    percent = format_spread(Spread.of([one.percent(hits) for one in pruned]), 1)
    total = ["all", str(len(pruned)), f"{candidates:,}", str(remaining), percent, str(different)]
    return MarkdownTable(
        ["seed", "task", "candidates", "remaining", "remaining [%]", "different up to objects"],
        [*rows, [f"**{cell}**" for cell in total]],
    )


def draw(
    figure: Figure,
    pruned: Sequence[PrunedCandidates],
    settings: ExplorationSettings,
    plans: Mapping[int, LibraryPlans],
) -> None:
    """Draw what remains against K/N, a thin line per task and the mean; below it plan length.

    Args:
        figure: Figure to draw into.
        pruned: Candidates of each task.
        settings: Settings with which all tasks were explored.
        plans: Plans by threshold; may be none.
    """
    above, *below = figure.subplots(2 if plans else 1, 1, squeeze=False, sharex=True)[:, 0]
    thresholds = _thresholds(settings)
    places = [100.0 * hits / settings.rollouts for hits in thresholds]
    for number, one in enumerate(pruned):
        above.plot(
            places,
            [one.percent(hits) for hits in thresholds],
            color=MUTED,
            linewidth=0.6,
            alpha=0.5,
            label="a task" if number == 0 else None,
        )
    spreads = [Spread.of([one.percent(hits) for one in pruned]) for hits in thresholds]
    _plot(above, places, spreads, "mean ± standard deviation")
    above.set_ylabel("candidates that remain [%]")
    for axes in below:
        _plot(axes, places, [plans[hits].length for hits in thresholds], None)
        axes.set_ylabel("plan length [steps]")
    bottom = (above, *below)[-1]
    bottom.set_xscale("log")
    bottom.set_xticks(places, [f"{float(f'{place:.2g}'):g}" for place in places])
    bottom.minorticks_off()
    bottom.set_xlabel("rollouts that must succeed, K/N [%]")
    legend_above(figure, above)


def _plot(
    axes: Axes, places: Sequence[float], spreads: Sequence[Spread | None], name: str | None
) -> None:
    """Draw means with their deviations, joined by a line; from 0 on."""
    known = [(place, one) for place, one in zip(places, spreads, strict=True) if one is not None]
    axes.errorbar(
        [place for place, _ in known],
        [spread.mean for _, spread in known],
        [spread.sd for _, spread in known],
        color=PLAN,
        marker="o",
        markersize=5,
        capsize=2.5,
        label=name,
    )
    axes.set_ylim(bottom=0)


def _summary(found: Data) -> str:
    least = found["thresholds"][0]
    kept = f"{least['remaining_percent']['mean']:.1f}% of candidates kept with K = {least['k']}"
    if "plan_length" not in least:
        return kept
    steps = [f"{format_steps(least['plan_length'])} steps"]
    for before, one in pairwise(found["thresholds"]):
        if one["plan_length"] != before["plan_length"]:
            share = 100 * one["k_over_n"]
            steps.append(f"from K/N = {share:.2g}% on {format_steps(one['plan_length'])}")
    return f"{kept}; {', '.join(steps)}"


@dataclass(frozen=True, kw_only=True)
class PruningOptions(ComparisonOptions):
    """Options of this study."""

    work: Annotated[
        list[Path] | None,
        CommandOption(
            "Work folder of a `slap train` that has explored. May be repeated.", metavar="FOLDER"
        ),
    ] = None
    settings: Annotated[
        str, CommandOption("Settings of exploration where --work is not given: ours or paper.")
    ] = "ours"


def prepare(options: PruningOptions, tell: Tell) -> PreparedStudy:
    """Open domain, library and trainings; without trainings, the study explores itself."""
    folders = [TrainingFolder(folder) for folder in options.work or ()]
    sampled_from = described(folders) if folders else {"settings": options.settings}
    compared = ChosenComparison.of(options, tell, sampled_from, needs_library=False)

    def make(comparison: Comparison) -> StudyReport:
        if folders:
            explored, how = explored_in(folders, options.domain)
        else:
            how = training_settings(options.settings, compared.domain).exploration
            explored = _explore_as_trainings(comparison, how)
        return study(explored, how, comparison)

    return compared.prepare(make, work=options.work)


def _explore_as_trainings(
    comparison: Comparison, how: ExplorationSettings
) -> tuple[PrunedCandidates, ...]:
    """Explore as many tasks as are planned for, each seed's as a training with that seed does."""
    choice = DomainChoice.of(comparison.domain)
    trainings = [TaskDistribution(choice, seed) for seed in range(comparison.seeds)]
    return explore(trainings, comparison.tasks, how, comparison.runner)


STUDY = Study(
    "pruning",
    help="SLAP Table 2: candidates that random rollouts keep, and plan length without the others.",
    example="slap study pruning obstacle_tower --settings ours",
    options=PruningOptions,
    prepare=prepare,
    summary=_summary,
    figures=(
        PaperFigure(
            "SLAP Table 2, §4.2",
            "pruning by random rollouts",
            SLAP_DOMAINS,
            {  # of one domain, which by its lengths is this one
                "cluttered_drawer": "K/N up to 25%: 167 to 202 steps; from 30% on: 333 to 349"
            },
        ),
    ),
)
