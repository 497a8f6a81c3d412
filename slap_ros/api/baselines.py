# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Training baselines, and trying them beside planning."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slap_ros.api.command_line import command_line
from slap_ros.api.jobs import require_torch, some_workers
from slap_ros.api.setting_texts import Changes, change_texts
from slap_ros.api.training import training_folder
from slap_ros.baselines.imported_policy import ImportedPolicy
from slap_ros.baselines.method import BaselineProgress, Method, MethodSettings, Report
from slap_ros.baselines.methods import METHODS
from slap_ros.baselines.trained_baseline import (
    BASELINE,
    TrainedBaseline,
    load_baseline,
    save_baseline,
)
from slap_ros.core import Domain, task_with_goal
from slap_ros.errors import InvalidLibraryError, InvalidParameterError
from slap_ros.evaluation.experiment import Experiment, Trial
from slap_ros.files import sole_use
from slap_ros.learning.setting_changes import changed, parse_changes
from slap_ros.learning.success_curve import SUCCESS_CURVE
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.policies.library_files import require_places
from slap_ros.skills.domain_choice import DomainChoice

if TYPE_CHECKING:
    from slap_ros.baselines.trials import Rival


def train_baseline(
    method: str,
    domain: Domain,
    folder: Path | str,
    *,
    seed: int = 0,
    goal: str | None = None,
    settings: str = "ours",
    changes: Changes = (),
    steps: int | None = None,
    work: Path | str | None = None,
    report: Report | None = None,
) -> TrainedBaseline:
    """Train a baseline: a learner of whole tasks that SLAP is compared with.

    Interrupted, it continues where it was when it is called with the same arguments.

    Args:
        method: Name of the method, one of ``slap_ros.baselines.methods.METHODS``.
        domain: Domain to train in, as :func:`make` makes it.
        folder: Folder that the baseline is saved to.
        seed: Seed of all random numbers.
        goal: Goal of every task, by name or as atoms; None for each task's own.
        settings: Name of the hyper-parameters: ours or paper.
        changes: Settings to change, by name; or texts, as ``n_envs=16``.
        steps: Environment steps of the training; None for those of the settings.
        work: Folder for checkpoints; None for one beside the baseline's folder.
        report: Function that receives the figures now and then.

    Returns:
        The baseline.

    Raises:
        InvalidParameterError: There is no such method, setting or goal, torch is not installed, or
            the folder has something that is no baseline.
        BusyError: Another process trains in the same folder.
    """
    kept_in = training_folder(folder, work)
    require_places(Path(folder), kept_in, "", BASELINE)
    task_with_goal(domain, 0, 0, goal)
    kind = open_method(method)
    chosen = chosen_settings(kind, settings, changes, steps)
    from slap_ros.baselines.training import BaselineTraining  # gymnasium

    tasks = TaskDistribution(DomainChoice.opened_as(domain), seed)
    with sole_use(kept_in):
        training = BaselineTraining(method, kind, chosen, tasks, goal, kept_in)
        trained = training.run(report or _unwatched)
    command = command_line(
        *("baseline", "train", method, domain.name),
        preset=domain.preset,
        goal=goal,
        seed=seed or None,
        settings=None if settings == "ours" else settings,
        set=change_texts(changes),
        steps=steps,
    )
    trained = replace(trained, record={"command": command, **trained.record})
    save_baseline(Path(folder), trained)
    return trained


def open_method(name: str) -> Method:
    """A method, with all that it needs.

    Raises:
        InvalidParameterError: There is none of that name, or something is not installed.
    """
    if name not in METHODS:
        raise InvalidParameterError(f"unknown method {name!r}; there are {', '.join(METHODS)}")
    require_torch()
    require_gymnasium()
    return METHODS[name].load()


def chosen_settings(kind: Method, name: str, changes: Changes, steps: int | None) -> MethodSettings:
    """The hyper-parameters of a training.

    Args:
        kind: Method that is trained.
        name: Name of the settings.
        changes: Settings to change.
        steps: Environment steps of the training; None for those of the settings.

    Raises:
        InvalidParameterError: There are none of that name, or they cannot be changed so.
    """
    if name not in kind.settings:
        raise InvalidParameterError(
            f"unknown settings {name!r}; there are {', '.join(kind.settings)}"
        )
    chosen = kind.settings[name]
    parsed = parse_changes(change_texts(changes), type(chosen))
    if steps is not None:
        if "total_steps" in parsed:
            raise InvalidParameterError("--steps and --set total_steps say the same: give one")
        parsed["total_steps"] = steps
    return changed(chosen, parsed)


def require_gymnasium() -> None:
    """Refuse what acts in Gymnasium's environments where it is not installed.

    Raises:
        InvalidParameterError: It is not.
    """
    if find_spec("gymnasium") is None:
        raise InvalidParameterError(
            "baselines act in environments of Gymnasium, which is not installed: pip install "
            "'slap_ros[gym]'"
        )


def open_rivals(
    sources: Sequence[str], domain: Domain, refused: Callable[[str], None]
) -> dict[str, Rival]:
    """Policies for whole tasks, by what they are called in tables.

    Args:
        sources: Folders that ``slap baseline train`` made, and functions that return policies with
            ``predict(observation)``, as ``module:function``.
        domain: Domain that they must be of.
        refused: Function that receives why one cannot be used; the others are.

    Returns:
        The policies that can be used.
    """
    require_gymnasium()
    found: dict[str, Rival] = {}
    for source in sources:
        try:
            rival = _open_rival(source, domain)
        except InvalidLibraryError as error:
            refused(str(error))
            continue
        name = rival.name
        found[name if name not in found else f"{name} {Path(source).name}"] = rival
    return found


def _open_rival(source: str, domain: Domain) -> Rival:
    """The baseline in a folder, or the policy of a function."""
    if ":" in source and not Path(source).exists():
        return ImportedPolicy.of(source, domain.name, domain.preset)
    return load_baseline(Path(source), domain)


def describe_rival(rival: Rival) -> dict[str, Any]:
    """What results say of a policy for whole tasks."""
    if isinstance(rival, TrainedBaseline):
        return describe_baseline(rival)
    return {"method": rival.name, "environment": dict(rival.environment)}


def describe_baseline(baseline: TrainedBaseline) -> dict[str, Any]:
    """What results say of a baseline: how it was trained, and never by the path of its folder."""
    record = baseline.record
    figures = ("seed", "environment_steps", "episodes", "joints_moved", "cpu_s", "validation")
    known = {name: record[name] for name in (*figures, SUCCESS_CURVE) if name in record}
    return {
        "method": baseline.method,
        "preset": baseline.preset,
        "noise": baseline.noise,
        **known,
        "settings": record.get("settings"),
        "command": record.get("command"),
    }


def run_baseline(
    experiment: Experiment,
    baseline: Rival,
    jobs: int | None,
    on_trial: Callable[[Trial], None] = lambda _: None,
) -> list[Trial]:
    """Let a baseline act in every task of an experiment.

    Args:
        experiment: Tasks to solve.
        baseline: Baseline that acts.
        jobs: Number of processes; None for this one.
        on_trial: Function that receives each trial as it ends.

    Returns:
        The trials, in the order of seeds and indices.
    """
    from slap_ros.baselines.trials import try_baseline

    preset, goal, trials = experiment.domain.preset, experiment.goal, []
    with some_workers(jobs) as workers:
        work = [(baseline, preset, goal, seed, index) for seed, index in experiment]
        for _, trial in workers.run(try_baseline, work):
            trials.append(trial)
            on_trial(trial)
    return sorted(trials, key=lambda trial: (trial.seed, trial.index))


def _unwatched(_: BaselineProgress) -> None:
    """Do nothing with the figures of a training."""
