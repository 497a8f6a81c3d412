# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How many candidate shortcuts random rollouts leave over (SLAP §4.2, B.1 and Table 2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from slap_ros.drawing.palette import MUTED, PLAN
from slap_ros.errors import InvalidParameterError, PlanningLimitError, UnsolvableError
from slap_ros.evaluation.summary import Spread
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.learning.workers import in_order, local_workers
from slap_ros.shortcuts import jobs as training_jobs
from slap_ros.shortcuts.explore import ExplorationResult
from slap_ros.shortcuts.settings import ExplorationSettings
from slap_ros.studies.comparison import StudyProgress, format_spread
from slap_ros.studies.figures import legend_above
from slap_ros.studies.results import MarkdownTable, StudyReport
from slap_ros.studies.trainings import TrainingFolder

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED = """\
Candidates are the pairs of abstract states of a task's graph, the later one second, that no option
joins. Of N random rollouts from a state at least K must end up in the other one, or the pair is
pruned. Here rollouts are made only from the abstract states that are cheapest to reach, and a pair
remains only if its shortcut would also make the plan of the task shorter, so that more is pruned
than in the paper. What remains of all tasks is then, up to objects, far fewer different things to
learn. Tasks are those of training. Spread is the sample standard deviation over tasks.

{settings} {overall}

In the paper, K/N of 5 to 25 % gives plans of 167 to 202 steps, 30 % and more 333 to 349: whatever
is pruned too eagerly is missing from the plans. Those are the paper's figures for plan length;
here pairs are counted."""


@dataclass(frozen=True)
class PrunedCandidates:
    """What is left of one task's candidates.

    Args:
        seed: Of the training.
        index: Which of its tasks.
        explored: What exploring it came to.
    """

    seed: int
    index: int
    explored: ExplorationResult

    def remaining(self, hits: int) -> int:
        """Pairs reached in at least so many rollouts."""
        return sum(candidate.hits >= hits for candidate in self.explored.candidates)

    def percent(self, hits: int) -> float:
        """The same as part of all candidates, in %; 0 where there are no candidates."""
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
    jobs: int,
    progress: StudyProgress,
) -> tuple[PrunedCandidates, ...]:
    """Explore the first tasks of trainings, as these do.

    Args:
        trainings: The tasks that each draws; all of one domain.
        tasks: Number of tasks per training.
        settings: How to explore.
        jobs: Number of processes.
        progress: Is called as tasks end.

    Returns:
        What is left of each task's candidates; tasks that could not be explored are left out.

    Raises:
        UnsolvableError: No task can be planned for, so none can be explored.
    """
    work = [(training, index, settings) for training in trainings for index in range(tasks)]
    ended = []
    progress.begin(f"exploring {trainings[0].domain}", len(work))
    with local_workers(jobs) as workers:
        for number, outcome in workers.run(_explore, work):
            ended.append((number, outcome))
            progress.advance()
            if isinstance(outcome, str):
                training, index, _ = work[number]
                where = f"seed {training.seed}, task {index}"
                progress.report_failure(f"{where} not explored: {outcome}")
    explored = [outcome for outcome in in_order(ended) if isinstance(outcome, PrunedCandidates)]
    if not explored:
        raise UnsolvableError(f"none of the {len(work)} tasks could be explored")
    return tuple(explored)


def _explore(
    distribution: TaskDistribution, index: int, settings: ExplorationSettings
) -> PrunedCandidates | str:
    """Explore one task, or say why it cannot be."""
    try:
        data = training_jobs.explore(distribution, index, settings)
    except (UnsolvableError, PlanningLimitError) as error:
        return str(error)
    return PrunedCandidates(distribution.seed, index, ExplorationResult.from_json(data))


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
    domain: str, pruned: Sequence[PrunedCandidates], settings: ExplorationSettings
) -> StudyReport:
    """The report on what is left, by the number of rollouts that must succeed.

    Args:
        domain: Name of the domain.
        pruned: One per task.
        settings: How all of them were explored.
    """
    thresholds = _thresholds(settings)
    signatures = {
        (candidate.signature.patterns, candidate.signature.context)
        for one in pruned
        for candidate in one.explored.candidates
    }
    return StudyReport(
        study="pruning",
        source="SLAP §4.2 and Table 2",
        title=f"Pruning: {domain}",
        measured=MEASURED.format(settings=_said(settings), overall=_overall(pruned, settings)),
        table=_table(pruned, settings, len(signatures)),
        found={
            "exploration": settings.as_json(),
            "thresholds": [_at(hits, pruned, settings) for hits in thresholds],
            "different_up_to_objects": len(signatures),
            "tasks": [one.as_json() for one in pruned],
        },
        draw=lambda figure: draw(figure, pruned, settings),
        size=(5.6, 3.4),
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
    return (
        f"Of {candidates:,} candidates in {len(pruned)} tasks {remaining} remain, {part:.1f} % of "
        "them all."
    )


def _thresholds(settings: ExplorationSettings) -> list[int]:
    """Hits to ask for: from what training asks for to all rollouts, doubled again and again."""
    thresholds = [settings.hits]
    while 2 * thresholds[-1] <= settings.rollouts:
        thresholds.append(2 * thresholds[-1])
    return thresholds


def _at(
    hits: int, pruned: Sequence[PrunedCandidates], settings: ExplorationSettings
) -> dict[str, Any]:
    """What is left at one threshold."""
    return {
        "k": hits,
        "k_over_n": hits / settings.rollouts,
        "remaining": sum(one.remaining(hits) for one in pruned),
        "remaining_percent": asdict(Spread.of([one.percent(hits) for one in pruned])),
    }


def _table(
    pruned: Sequence[PrunedCandidates], settings: ExplorationSettings, different: int
) -> MarkdownTable:
    """One row per task, then all of them."""
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


def draw(figure: Figure, pruned: Sequence[PrunedCandidates], settings: ExplorationSettings) -> None:
    """Draw what remains against K/N: one thin line per task, the mean with its spread.

    Args:
        figure: To draw into.
        pruned: One per task.
        settings: How all of them were explored.
    """
    axes = figure.subplots()
    thresholds = _thresholds(settings)
    places = [100.0 * hits / settings.rollouts for hits in thresholds]
    for number, one in enumerate(pruned):
        axes.plot(
            places,
            [one.percent(hits) for hits in thresholds],
            color=MUTED,
            linewidth=0.6,
            alpha=0.5,
            label="a task" if number == 0 else None,
        )
    spreads = [Spread.of([one.percent(hits) for one in pruned]) for hits in thresholds]
    axes.errorbar(
        places,
        [spread.mean for spread in spreads],
        [spread.sd for spread in spreads],
        color=PLAN,
        marker="o",
        markersize=5,
        capsize=2.5,
        label="mean ± standard deviation",
    )
    axes.set_xscale("log")
    axes.set_xticks(places, [f"{place:.3g}" for place in places])
    axes.minorticks_off()
    axes.set_ylim(bottom=0)
    axes.set_xlabel("rollouts that must succeed, K/N [%]")
    axes.set_ylabel("candidates that remain [%]")
    legend_above(figure, axes)
