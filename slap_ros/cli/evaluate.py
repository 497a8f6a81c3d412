# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap evaluate``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Column, Table

from slap_ros.api.command_line import command_line
from slap_ros.api.command_options import DomainName, Jobs, Preset, Samples, ShortcutFolder
from slap_ros.api.evaluation import (
    SKILLS_ALONE,
    against_skills,
    compared_approaches,
    run_approaches,
)
from slap_ros.api.library_descriptions import both_in_words, describe_library, describe_skills
from slap_ros.cli.bars import counting_bars
from slap_ros.cli.console import console, print_json, print_result
from slap_ros.cli.options import EffortFactor, Goal, Json, NoImprove, Planner, Within, at_most
from slap_ros.cli.rivals import Against, RivalResults, open_chosen_rivals, run_rivals
from slap_ros.cli.shortcuts import choose
from slap_ros.cli.skill_choice import Skills, open_chosen
from slap_ros.core import Domain
from slap_ros.errors import ErrorCode
from slap_ros.evaluation.approaches import Approach
from slap_ros.evaluation.evaluation_file import require_replaceable, write_evaluation
from slap_ros.evaluation.experiment import Experiment, Trial
from slap_ros.evaluation.summary import Summary, format_spread
from slap_ros.files import require_writable
from slap_ros.planning.planner_choice import DEFAULT_PLANNER, with_settings
from slap_ros.relational.articles import counted
from slap_ros.shortcuts.sampling import DEFAULT
from slap_ros.shortcuts.shipped import shipped_library
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary
from slap_ros.skills.domain_choice import SHIPPED
from slap_ros.versions import versions

FirstSeed = Annotated[
    int,
    typer.Option(
        min=0, help="First seed of the tasks. Training samples its tasks from seed 1000000 on."
    ),
]
Tasks = Annotated[int, typer.Option(min=1, callback=at_most(10**6), help="Tasks per seed.")]
Seeds = Annotated[int, typer.Option(min=1, callback=at_most(10**6), help="Number of seeds.")]


def evaluate(
    domain: DomainName,
    tasks: Tasks = 10,
    seeds: Seeds = 5,
    first_seed: FirstSeed = 0,
    preset: Preset = None,
    goal: Goal = None,
    skills: Skills = SHIPPED,
    shortcuts: ShortcutFolder = None,
    samples: Samples = DEFAULT.samples,
    with_shooting: Annotated[
        bool,
        typer.Option(
            "--shooting",
            help="Show what learning is worth: compare with a search that tries random actions as "
            "often as SLAP tries its policies.",
        ),
    ] = False,
    against: Against = None,
    planner: Planner = DEFAULT_PLANNER,
    within: Within = None,
    effort: EffortFactor = None,
    no_improve: NoImprove = False,
    jobs: Jobs = 1,
    output: Annotated[
        Path | None, typer.Option(help="JSON file for all trials, with settings and libraries.")
    ] = None,
    json: Json = False,
) -> int:
    """Plan and execute many tasks; print success, plan length and planning time.

    A library adds two rows for the same tasks: SLAP with one sample, as the paper evaluates it, and
    with --samples. With --against skills, the first row is named after the acquired skills, and the
    digests of skills and shortcuts are printed. Spreads are mean ± sample standard deviation over
    all tasks.
    """
    planner = with_settings(planner, within, effort, 0 if no_improve else None)
    chosen = open_chosen(domain, preset, skills)
    settings = {"preset": chosen.preset, "tasks": tasks, "seeds": seeds, "first_seed": first_seed}
    besides = ("goal", goal), ("skills", skills), ("shooting", with_shooting)
    settings |= {"samples": samples, "planner": planner} | {n: v for n, v in besides if v}
    named = {"shortcuts": shortcuts, "against": against or []}
    command = command_line("evaluate", domain, **named, **settings)
    if output is not None:
        require_writable(output)
        require_replaceable(output, command)
    library = choose(shortcuts, chosen, planner)
    compared = compared_approaches(library, chosen, samples, with_shooting)
    libraries = _libraries(chosen, shortcuts, library)
    rivals = open_chosen_rivals([one for one in against or () if one != SKILLS_ALONE], chosen)
    if SKILLS_ALONE in (against or ()):
        compared = against_skills(compared, chosen)
        console.print(both_in_words(libraries))
    experiment = Experiment(chosen, tasks, seeds, first_seed, planner, goal=goal, skills=skills)
    results = _run(experiment, compared, jobs)
    run_rivals(experiment, rivals, results[0][1], jobs)
    if output is not None:
        origin = {"command": command, "domain": domain} | settings | libraries | rivals.described
        write_evaluation(output, origin, results + rivals.results)
    return _show(experiment, results, rivals, json)


def _libraries(
    domain: Domain, shortcuts: str | None, library: ShortcutLibrary | None
) -> dict[str, Any]:
    """The libraries that an evaluation was made with, of skills and of shortcuts."""
    folder = Path(shortcuts) if shortcuts else shipped_library(domain.name)
    described = describe_library(folder.name, library) if folder and library else None
    skills = describe_skills(domain)
    return ({"skills": skills} if skills else {}) | {"library": described}


def _show(
    experiment: Experiment,
    results: Sequence[tuple[Summary, list[Trial]]],
    rivals: RivalResults,
    json: bool,
) -> int:
    """Print what came out; the command's exit code, which is that of planning before rivals'."""
    summaries = [summary for summary, _ in results]
    compared = [*summaries, *(summary for summary, _ in rivals.results)]
    if json:
        rows = [summary.as_row() for summary in compared]
        made = {"approaches": rows, "versions": versions()}
        print_json(summaries[-1].as_json() | made)
    else:
        print_result(_table(experiment, compared))
    solved = all(summary.success_rate == 1.0 for summary in summaries)
    return rivals.exit_code if solved else int(ErrorCode.UNKNOWN)


def _run(
    experiment: Experiment, compared: Sequence[Approach], jobs: int
) -> list[tuple[Summary, list[Trial]]]:
    """Approach by approach, pure planning first."""
    with counting_bars() as bar:
        watched = bar.add_task(experiment.domain.name, total=len(experiment) * len(compared))

        def on_trial(approach: Approach, trial: Trial) -> None:
            bar.advance(watched)
            if not trial.success:
                console.print(_complaint(approach, trial))

        tried = run_approaches(experiment, compared, jobs, on_trial)
    yardstick = tried[0][1]
    return [
        (Summary.of(experiment, approach.name, trials, yardstick), trials)
        for approach, trials in tried
    ]


def _complaint(approach: Approach, trial: Trial) -> str:
    return f"{approach.name}: seed {trial.seed}, task {trial.index} not solved: {trial.reason}"


def _table(experiment: Experiment, summaries: Sequence[Summary]) -> Table:
    table = Table(
        Column("approach", overflow="fold"),  # two names may differ in their last letters
        "success [95 %]",
        "plan length [steps]",
        "relative length [95 %]",
        "planning [s]",
        "edges rolled out",
        "steps in shortcuts",
        title=(
            f"{experiment.domain.name}, preset {experiment.domain.preset}: "
            f"{counted(experiment.seeds, 'seed')} from {experiment.first_seed} × "
            f"{counted(experiment.tasks, 'task')}"
        ),
    )
    for summary in summaries:
        success = summary.success_interval
        table.add_row(
            summary.approach,
            f"{summary.success_rate:.0%} [{success.low:.0%}, {success.high:.0%}]",
            format_spread(summary.plan_length, 1),
            _relative(summary),
            format_spread(summary.planning_seconds, 3),
            f"{summary.edges_rolled_out:.1f}",
            f"{summary.shortcut_share:.0%}",
        )
    return table


def _relative(summary: Summary) -> str:
    if summary.relative_length is None:
        return "-"
    interval = summary.relative_interval
    if interval is None or interval.low == interval.high:
        return f"{summary.relative_length:.2f}"
    return f"{summary.relative_length:.2f} [{interval.low:.2f}, {interval.high:.2f}]"
