# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap study``, where a language model is asked: LG-SAIL's Tables 2, 3, 5, 6 and Figure 7."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import typer

from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.cli.options import LanguageFile, Preset
from slap_ros.core import Domain, task_with_goal
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidCassetteError, InvalidParameterError
from slap_ros.language.cassette import ReplayingClient, open_client, read_cassette, with_recorded
from slap_ros.language.settings import read_settings
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.lg_sail import planning_ablation, reward_ablation
from slap_ros.studies.lg_sail.model_attempts import LanguageModel, ModelsOnly
from slap_ros.studies.results import StudyReport

Data = dict[str, Any]
MakeReport = Callable[[JobRunner], StudyReport]


@dataclass(frozen=True)
class ModelOptions:
    """Whom to ask."""

    model: Annotated[
        list[str] | None,
        typer.Option(
            help="Name of the language model at the server; `models` takes several. Default: "
            "SLAP_LANGUAGE_MODEL."
        ),
    ] = None
    base_url: Annotated[
        str | None, typer.Option(help="URL of the server. Default: SLAP_LANGUAGE_BASE_URL.")
    ] = None
    language_settings: LanguageFile = None
    cassette: Annotated[
        str,
        typer.Option(
            help="How to get answers: live, record:FILE (ask and record), or "
            "replay:FILE (repeat what a model answered)."
        ),
    ] = "live"
    goal: Annotated[
        str | None, typer.Option(help="Name of a goal. Default: the domain's first.")
    ] = None
    seed: Annotated[int, typer.Option(min=0, help="Seed of the tasks.")] = 0
    preset: Preset = None

    def models(self) -> dict[str, LanguageModel]:
        """Everybody who is to be asked, by name.

        Raises:
            InvalidParameterError: A model twice, or several of one cassette.
            InvalidCassetteError: The cassette was not recorded from a model.
        """
        names: Sequence[str | None] = self.model or (None,)
        if len(set(names)) < len(names):
            raise InvalidParameterError("--model names a model twice")
        if len(names) > 1 and self.cassette != "live":
            raise InvalidParameterError("--cassette is for one model at a time")
        made = [self._model(name) for name in names]
        return {model.settings.model: model for model in made}

    def _model(self, name: str | None) -> LanguageModel:
        settings = read_settings(self.language_settings, name, self.base_url)
        client = open_client(self.cassette, settings)
        if isinstance(client, ReplayingClient) and not client.cassette.from_a_model:
            raise InvalidCassetteError(
                f"{client.cassette.path} was not recorded from a model: what a script says is no "
                "result of a study"
            )
        return LanguageModel(ModelsOnly(client), with_recorded(settings, client))

    def dated(self, report: StudyReport) -> StudyReport:
        """A report with the day of the answers, and the digest of their recording if there is one.

        Args:
            report: Once everything was answered.
        """
        mode, _, path = self.cassette.partition(":")
        day = datetime.now(UTC).date().isoformat()
        if mode == "live":
            return replace(report, circumstances={"answered_on": day})
        recording = read_cassette(Path(path))
        day = recording.recorded[: len(day)]
        return replace(
            report, circumstances={"answered_on": day, "recording_sha256": recording.digest}
        )

    def problem(self, domain: Domain, index: int) -> AcquisitionProblem:
        """A task of the domain."""
        return AcquisitionProblem.of_task(
            domain, task_with_goal(domain, self.seed, index, self.goal)
        )

    def as_settings(self) -> Data:
        """What a report names, and its command repeats; never a key."""
        return {
            "preset": self.preset,
            "goal": self.goal,
            "seed": self.seed,
            "base_url": self.base_url,
        }


def answered_by(models: Mapping[str, LanguageModel]) -> dict[str, str]:
    """What answers for each model, and for one in this process the library that runs it."""
    return {name: model.client.source for name, model in models.items()}


def planning(
    domain: str,
    variants: str,
    plans: int,
    attempts: int,
    options: ModelOptions,
) -> tuple[Data, MakeReport]:
    """Who plans with a model's operators; see :mod:`slap_ros.studies.lg_sail.planning_ablation`.

    Args:
        domain: Name of the domain.
        variants: Separated by commas.
        plans: Tasks.
        attempts: For one plan at most.
        options: Whom to ask.

    Returns:
        The settings that the report names, and what makes it.

    Raises:
        InvalidParameterError: There is no such variant, or a model is named twice.
        InvalidCassetteError: The cassette was not recorded from a model.
    """
    chosen = variants.split(",")
    if unknown := sorted(set(chosen) - set(planning_ablation.VARIANTS)):
        raise InvalidParameterError(
            f"--variants {', '.join(unknown)}: there are {', '.join(planning_ablation.VARIANTS)}"
        )
    models = options.models()
    opened = get_domain(domain, options.preset)
    problems = [options.problem(opened, index) for index in range(plans)]
    settings = {
        "variants": variants,
        "plans": plans,
        "attempts": attempts,
        "model": [*models],
        "answered_by": answered_by(models),
    }
    return settings | options.as_settings(), lambda runner: options.dated(
        planning_ablation.study(models, problems, chosen, attempts, runner)
    )


def rewards(
    domain: str, metrics: str, trials: int, options: ModelOptions
) -> tuple[Data, MakeReport]:
    """What rewards are worth; see :mod:`slap_ros.studies.lg_sail.reward_ablation`.

    Args:
        domain: Name of the domain.
        metrics: What is shown of them, separated by commas.
        trials: Number of trials for each of ``metrics``.
        options: Whom to ask.

    Returns:
        The settings that the report names, and what makes it.

    Raises:
        InvalidParameterError: There is no such choice of what is shown, or more than one model.
        InvalidCassetteError: The cassette was not recorded from a model.
    """
    shown = metrics.split(",")
    if unknown := sorted(set(shown) - set(reward_ablation.METRICS)):
        raise InvalidParameterError(
            f"--metrics {', '.join(unknown)}: there are {', '.join(reward_ablation.METRICS)}"
        )
    models = options.models()
    if len(models) > 1:
        raise InvalidParameterError("rewards are asked of one model: give --model once")
    opened = get_domain(domain, options.preset)
    written = opened.acquisition.operators if opened.acquisition else opened.operators
    ((name, model),) = models.items()
    problem = options.problem(opened, 0)
    settings = {
        "metrics": metrics,
        "trials": trials,
        "model": [name],
        "answered_by": answered_by(models),
    }
    return settings | options.as_settings(), lambda runner: options.dated(
        reward_ablation.study(model, problem, written, shown, trials, runner)
    )
