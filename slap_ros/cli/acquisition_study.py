# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap study``, for domains whose skills are acquired: LG-SAIL's tables, and what comes before.

Before skills are learned: can the tasks be solved, is there anything to learn, how many
demonstrations do operators take. After that, how far plans get with what was learned; and what
language models make of operators and rewards.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from slap_ros.cli import language_study
from slap_ros.cli.console import exits
from slap_ros.cli.language_study import MakeReport, ModelOptions
from slap_ros.cli.options import DomainName, Jobs, Preset, flat_options
from slap_ros.cli.skill_choice import open_chosen
from slap_ros.cli.study_report import (
    FRESH_SEED,
    RESULTS,
    FreshSeed,
    Output,
    make_report,
    provenance,
    require_report,
)
from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.experiment import Experiment
from slap_ros.policies.shipped_models import shipped_with_siblings
from slap_ros.skills.domain_choice import DEMONSTRATOR, DomainChoice, open_domain
from slap_ros.skills.skill_library import read_library_record
from slap_ros.studies.lg_sail import acquisition, demonstrations, induction, replanning, vacuity
from slap_ros.studies.lg_sail.planning_ablation import SEARCH, VARIANTS
from slap_ros.studies.results import Data, describe_skills

GoalNames = Annotated[
    list[str] | None,
    typer.Option(help="Name of a goal. May be repeated. Default: all goals of the domain."),
]


@exits
def demonstrations_(
    domain: DomainName,
    goal: GoalNames = None,
    tasks: Annotated[int, typer.Option(min=1, help="Number of tasks of the first goal.")] = 100,
    others: Annotated[int, typer.Option(min=1, help="Number of tasks of every other goal.")] = 50,
    seed: FreshSeed = FRESH_SEED,
    preset: Preset = None,
    jobs: Jobs = 1,
    output: Output = RESULTS,
) -> None:
    """Whether tasks can be solved: success of the domain's demonstrator, per goal."""
    choice = _demonstrator(domain, preset, output)
    names = goal or _all_goals(open_domain(choice))
    counts = {name: others if i else tasks for i, name in enumerate(names)}
    settings = {"preset": choice.preset, "tasks": tasks, "others": others, "seed": seed}
    origin = provenance("demonstrations", domain, settings, goal=goal)
    make_report(
        "demonstrations",
        origin,
        output,
        jobs,
        lambda runner: demonstrations.study(choice, counts, seed, runner),
    )


@exits
def vacuity_(
    domain: DomainName,
    starts: Annotated[int, typer.Option(min=1, help="Number of start states per operator.")] = 200,
    seed: FreshSeed = FRESH_SEED,
    preset: Preset = None,
    skills: Annotated[
        Path | None,
        typer.Option(help="Folder that `slap acquire` made. Its skills are judged as well."),
    ] = None,
    jobs: Jobs = 1,
    output: Output = RESULTS,
) -> None:
    """Whether there is anything to learn: success of blind policies from where skills begin."""
    choice = _demonstrator(domain, preset, output)
    settings: dict[str, Any] = {"preset": choice.preset, "starts": starts, "seed": seed}
    given, learned = {}, None
    if skills is not None:
        acquired = open_chosen(domain, choice.preset, str(skills))
        learned = DomainChoice.of(acquired, str(skills))
        settings["skills"] = describe_skills(acquired)
        given["skills"] = skills
    make_report(
        "vacuity",
        provenance("vacuity", domain, settings, **given),
        output,
        jobs,
        lambda runner: vacuity.study(choice, starts, seed, runner, learned),
    )


@exits
def acquisition_(
    domain: DomainName,
    library: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FOLDER",
            help="Folder that `slap acquire` made. May be repeated. Default: all that ship.",
        ),
    ] = None,
    goal: GoalNames = None,
    tasks: Annotated[int, typer.Option(min=1, help="Number of tasks per goal and library.")] = 100,
    seed: FreshSeed = FRESH_SEED,
    preset: Preset = None,
    jobs: Jobs = 1,
    output: Output = RESULTS,
) -> None:
    """Task progress with acquired skills, per goal, without planning again."""
    require_report(output)
    folders = library or _shipped(domain)
    chosen = get_domain(domain, preset)
    choices = [DomainChoice(domain, chosen.preset, str(folder)) for folder in folders]
    names = goal or _all_goals(chosen)
    settings = {"preset": chosen.preset, "tasks": tasks, "seed": seed}
    make_report(
        "acquisition",
        provenance("acquisition", domain, settings, library=library, goal=goal),
        output,
        jobs,
        lambda runner: acquisition.study(choices, dict.fromkeys(names, tasks), seed, runner),
    )


@exits
def replanning_(
    domain: DomainName,
    library: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FOLDER",
            help="Folder that `slap acquire` made. May be repeated. Default: all that ship with "
            "hand-written operators and rewards.",
        ),
    ] = None,
    goal: GoalNames = None,
    tasks: Annotated[int, typer.Option(min=1, help="Number of tasks per seed and goal.")] = 20,
    seeds: Annotated[int, typer.Option(min=1, help="Number of seeds for the first library.")] = 5,
    others: Annotated[
        int, typer.Option(min=1, help="Number of seeds for every other library.")
    ] = 1,
    first_seed: FreshSeed = FRESH_SEED,
    preset: Preset = None,
    jobs: Jobs = 1,
    output: Output = RESULTS,
) -> None:
    """Success with acquired skills, per goal, with a new plan after each failure."""
    require_report(output)
    folders = library or _hand_written(_shipped(domain))
    opened = [open_chosen(domain, preset, str(folder)) for folder in folders]
    chosen = opened[0].preset
    settings = {
        "preset": chosen,
        "tasks": tasks,
        "seeds": seeds,
        "others": others,
        "first_seed": first_seed,
    }
    experiments = [
        Experiment(one, tasks, others if i else seeds, first_seed, skills=str(folder))
        for i, (one, folder) in enumerate(zip(opened, folders, strict=True))
    ]
    names = goal or _all_goals(get_domain(domain, chosen))
    make_report(
        "replanning",
        provenance("replanning", domain, settings, library=library, goal=goal),
        output,
        jobs,
        lambda runner: replanning.study(experiments, names, runner),
    )


def _all_goals(domain: Domain) -> list[str]:
    """The names of a domain's goals; where it has none, the empty one: each task's own."""
    return list(domain.goals) or [""]


def _shipped(domain: str) -> list[Path]:
    """The libraries of skills that ship for a domain.

    Raises:
        InvalidParameterError: None does.
    """
    folders = shipped_with_siblings("skills", domain)
    if not folders:
        raise InvalidParameterError(
            f"no library of skills ships for {domain}; give --library, a folder that `slap acquire "
            f"{domain}` made"
        )
    return folders


def _hand_written(folders: Sequence[Path]) -> list[Path]:
    """Those whose operators and rewards are hand-written."""
    records = {folder: read_library_record(folder) for folder in folders}
    return [
        folder
        for folder, record in records.items()
        if (record["proposer"], record["rewarder"]) == ("manual", "manual")
    ]


@exits
def induction_(
    domain: DomainName,
    demonstrations: Annotated[
        list[int] | None,
        typer.Option(help="Number of demonstrations. May be repeated. Default: 1, 3 and 10."),
    ] = None,
    tasks: Annotated[int, typer.Option(min=1, help="Number of tasks to plan per goal.")] = 20,
    seed: FreshSeed = FRESH_SEED,
    preset: Preset = None,
    jobs: Jobs = 1,
    output: Output = RESULTS,
) -> None:
    """Operators from demonstrations: whether A* finds equally short plans for every goal."""
    choice = _demonstrator(domain, preset, output)
    counts = demonstrations or [1, 3, 10]
    settings = {
        "preset": choice.preset,
        "tasks": tasks,
        "seed": seed,
        "demonstrations": counts,
    }
    origin = provenance("induction", domain, settings, demonstrations=counts)
    make_report(
        "induction",
        origin,
        output,
        jobs,
        lambda runner: induction.study(choice, counts, tasks, seed, runner),
    )


def _demonstrator(domain: str, preset: str | None, output: Path) -> DomainChoice:
    """The domain with its demonstrator for skills, once it is known that there is one."""
    require_report(output)
    choice = DomainChoice(domain, preset or "", DEMONSTRATOR)
    return replace(choice, preset=open_domain(choice).preset)


@exits
@flat_options
def planning_ablation_(
    domain: DomainName,
    variants: Annotated[
        str,
        typer.Option(
            help="Ways to plan, separated by commas: language+search, language, one_shot."
        ),
    ] = ",".join(VARIANTS),
    plans: Annotated[int, typer.Option(min=1, help="Number of tasks to plan.")] = 25,
    attempts: Annotated[
        int, typer.Option(min=1, help="Maximum number of attempts at operators, per plan.")
    ] = 10,
    output: Output = RESULTS,
    *,
    options: ModelOptions,
) -> None:
    """LG-SAIL Table 2: operators of a language model; A* or the model plans with them."""
    require_report(output)
    settings, make = language_study.planning(domain, variants, plans, attempts, options)
    _ask("planning_ablation", domain, settings, output, make)


@exits
@flat_options
def models_(
    domain: DomainName,
    plans: Annotated[int, typer.Option(min=1, help="Number of tasks to plan.")] = 100,
    attempts: Annotated[
        int, typer.Option(min=1, help="Maximum number of attempts at operators, per plan.")
    ] = 10,
    output: Output = RESULTS,
    *,
    options: ModelOptions,
) -> None:
    """LG-SAIL Tables 5 and 6: operators of several language models; A* plans with them."""
    require_report(output)
    settings, make = language_study.planning(domain, SEARCH, plans, attempts, options)
    _ask("models", domain, settings, output, lambda runner: replace(make(runner), study="models"))


@exits
@flat_options
def reward_ablation_(
    domain: DomainName,
    metrics: Annotated[
        str,
        typer.Option(
            help="What the model sees of the metrics, separated by commas: full, headers."
        ),
    ] = "full,headers",
    trials: Annotated[
        int, typer.Option(min=1, help="Number of trials per choice of --metrics.")
    ] = 25,
    output: Output = RESULTS,
    *,
    options: ModelOptions,
) -> None:
    """LG-SAIL Table 3, Fig. 7: rewards of a language model, and their errors."""
    require_report(output)
    settings, make = language_study.rewards(domain, metrics, trials, options)
    _ask("reward_ablation", domain, settings, output, make)


def _ask(study: str, domain: str, settings: Data, output: Path, make: MakeReport) -> None:
    """Make the report of a study that asks a model, one question at a time."""
    make_report(study, provenance(study, domain, settings), output, 1, make)


COMMANDS: Mapping[str, Callable[..., Any]] = {
    "demonstrations": demonstrations_,
    "vacuity": vacuity_,
    "acquisition": acquisition_,
    "replanning": replanning_,
    "induction": induction_,
    "planning_ablation": planning_ablation_,
    "models": models_,
    "reward_ablation": reward_ablation_,
}
