# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Evaluating approaches on many tasks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

from slap_ros.api.argument_kinds import checks_arguments
from slap_ros.api.jobs import some_workers
from slap_ros.api.left_out import warn_caller
from slap_ros.api.library_descriptions import describe_skills
from slap_ros.api.shortcut_choice import SAMPLES, Shortcuts, choose_library, sampling
from slap_ros.core import Domain
from slap_ros.errors import ErrorCode, InvalidParameterError
from slap_ros.evaluation.approaches import Approach, approaches, shooting
from slap_ros.evaluation.experiment import Experiment, Trial, run_with
from slap_ros.planning.planner import make_planner
from slap_ros.planning.planner_choice import DEFAULT_PLANNER
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.whole_numbers import require_whole

SKILLS_ALONE = "skills"  # name of planning without shortcuts, where skills were acquired
OnTrial = Callable[[Approach, Trial], None]


@dataclass(frozen=True)
class TrialRow:
    """One task that was tried, as a row of a table: ``pandas.DataFrame(rows)`` takes them as is.

    Args:
        domain: Name of the domain.
        preset: Preset of the domain.
        approach: Name of the way to plan: pure_planning, slap_1_sample, slap or shooting.
        seed: Seed of the task.
        index: Index of the task among those of its seed.
        success: Whether the goal was reached.
        plan_length: Environment steps executed.
        shortcut_steps: Environment steps of these that shortcuts took.
        planning_seconds: Time that all plans together took, s.
        edges_rolled_out: Options simulated while planning.
        replans: Plans that replaced a diverged one.
        error: Name of the error code, as ``STEP_LIMIT``; ``NONE`` for a success.
        reason: Why it failed, in words; empty for a success.
        bound: How many times as long as the shortest the first plan is at most; None where nothing
            is proven.
    """

    domain: str
    preset: str
    approach: str
    seed: int
    index: int
    success: bool
    plan_length: int
    shortcut_steps: int
    planning_seconds: float
    edges_rolled_out: int
    replans: int
    error: str
    reason: str
    bound: float | None

    @classmethod
    def of(cls, domain: Domain, approach: str, trial: Trial) -> TrialRow:
        """The row of a trial.

        Args:
            domain: Domain of the task.
            approach: Name of the way to plan.
            trial: Figures of the task.
        """
        row = {field.name for field in fields(cls)}
        figures = {field.name for field in fields(trial)}
        return cls(
            domain=domain.name,
            preset=domain.preset,
            approach=approach,
            error=ErrorCode(trial.error_code).name,
            **{name: getattr(trial, name) for name in row & figures},
        )


@checks_arguments
def evaluate(
    domain: Domain,
    shortcuts: Shortcuts = "shipped",
    *,
    tasks: int = 10,
    seeds: int = 5,
    first_seed: int = 0,
    goal: str | None = None,
    planner: str = DEFAULT_PLANNER,
    samples: int = SAMPLES,
    compare_shooting: bool = False,
    jobs: int | None = None,
) -> list[TrialRow]:
    """Plan and execute many tasks, with every approach: what ``slap evaluate`` does.

    The approaches are pure planning and, with shortcuts, SLAP as the paper evaluates it (one
    sample) and SLAP with ``samples``, all on the same tasks.

    Args:
        domain: Domain of the tasks, as :func:`make` makes it.
        shortcuts: Learned shortcuts to plan with, as for :func:`plan`.
        tasks: Tasks per seed.
        seeds: Number of seeds.
        first_seed: First of the seeds; training draws its tasks from seed 1000000 on.
        goal: Goal in place of each task's own: one of ``domain.goals``, or atoms in PDDL; None for
            each task's own.
        planner: Name of the planner.
        samples: Attempts of a shortcut in the model.
        compare_shooting: Whether to compare with a search of as many rollouts of random actions.
        jobs: Number of processes; None for this one. Figures are the same but for planning
            times: motion plans are cached, so that in one process an approach looks faster than
            those before it. A script that uses processes needs ``if __name__ == "__main__"``.

    Returns:
        A row per approach and task, approach by approach, in the order of seeds and indices.

    Raises:
        InvalidParameterError: There is no such planner, or it cannot use shortcuts; or a number
            that cannot be.
        NoSkillsError: The domain has no skills yet.
        UnknownGoalError: There is no such goal.
        InvalidLibraryError: The library cannot be used as a whole.
    """
    for name, number in (("tasks", tasks), ("seeds", seeds)):
        require_whole(name, number, least=1)
    require_whole("first_seed", first_seed)
    library = choose_library(shortcuts, domain, planner, warn_caller)
    compared = compared_approaches(library, domain, samples, compare_shooting)
    skills = DomainChoice.opened_as(domain).skills
    experiment = Experiment(domain, tasks, seeds, first_seed, planner, goal=goal, skills=skills)
    results = run_approaches(experiment, compared, jobs)
    return [
        TrialRow.of(domain, approach.name, trial)
        for approach, trials in results
        for trial in trials
    ]


def compared_approaches(
    library: ShortcutLibrary | None, domain: Domain, samples: int, compare_shooting: bool
) -> list[Approach]:
    """What is compared, pure planning first.

    Args:
        library: Shortcuts to plan with, if any.
        domain: Domain of the library.
        samples: Attempts of a shortcut in the model.
        compare_shooting: Whether search without anything learned is compared, too.

    Raises:
        InvalidParameterError: Shooting is to be compared, and there is no library.
    """
    compared = list(approaches(library, sampling(samples)))
    if compare_shooting:
        if library is None:
            raise InvalidParameterError(
                "--shooting searches where shortcuts of a library would be used: give --shortcuts"
            )
        compared.insert(1, shooting(library, domain, sampling(samples)))
    return compared


def against_skills(compared: Sequence[Approach], domain: Domain) -> list[Approach]:
    """What is compared, the first being called the acquired skills alone.

    Args:
        compared: Ways to plan, without shortcuts first.
        domain: Domain with the skills.

    Raises:
        InvalidParameterError: There is nothing to compare.
    """
    without, *others = compared
    if not describe_skills(domain) or not others:
        raise InvalidParameterError(
            f"--against {SKILLS_ALONE} compares shortcuts with the acquired skills that they were "
            "learned over: give --skills and --shortcuts, the folders of both libraries"
        )
    return [replace(without, name=SKILLS_ALONE), *others]


def run_approaches(
    experiment: Experiment,
    compared: Sequence[Approach],
    jobs: int | None,
    on_trial: OnTrial = lambda *_: None,
) -> list[tuple[Approach, list[Trial]]]:
    """Solve every task with every approach, each approach with processes of its own.

    Args:
        experiment: Tasks to solve.
        compared: Ways to plan.
        jobs: Number of processes; None for this one.
        on_trial: Function that receives each trial as it ends.

    Returns:
        The trials of each approach, in the order of seeds and indices.

    Raises:
        InvalidParameterError: There is no such planner.
        NoSkillsError: The domain has no skills.
    """
    first = experiment.task(experiment.first_seed, 0)
    make_planner(experiment.planner, experiment.domain, first.initial_state)
    results = []
    for approach in compared:
        trials = []
        with some_workers(jobs) as workers:
            for trial in run_with(workers, experiment, approach):
                trials.append(trial)
                on_trial(approach, trial)
        results.append((approach, sorted(trials, key=lambda trial: (trial.seed, trial.index))))
    return results
