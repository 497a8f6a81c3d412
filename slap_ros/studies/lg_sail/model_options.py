# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The options of studies that ask a language model, and the models that they choose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.api.command_options import CommandOption, DomainName, LanguageFile, Preset
from slap_ros.core import Domain, task_with_goal
from slap_ros.errors import InvalidCassetteError, InvalidParameterError
from slap_ros.language.cassette import ReplayingClient, open_client, read_cassette, with_recorded
from slap_ros.language.settings import read_settings
from slap_ros.studies.lg_sail.model_attempts import LanguageModel, ModelsOnly
from slap_ros.studies.options import RESULTS, Output
from slap_ros.studies.results import Data, StudyReport


@dataclass(frozen=True, kw_only=True)
class LanguageOptions:
    """Which models a study asks, and how."""

    model: Annotated[
        list[str] | None,
        CommandOption(
            "Name of the language model at the server; `models` takes several. Default: "
            "SLAP_LANGUAGE_MODEL."
        ),
    ] = None
    base_url: Annotated[
        str | None, CommandOption("URL of the server. Default: SLAP_LANGUAGE_BASE_URL.")
    ] = None
    language_settings: LanguageFile = None
    cassette: Annotated[
        str,
        CommandOption(
            "How to get answers: live, record:FILE (ask and record), or "
            "replay:FILE (repeat what a model answered)."
        ),
    ] = "live"

    def models(self) -> dict[str, LanguageModel]:
        """The models to ask, by name.

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

    @property
    def replayed(self) -> Data:
        """The option with which the command repeats recorded answers; none where none are."""
        _, _, path = self.cassette.partition(":")
        return {"cassette": f"replay:{path}"} if path else {}

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


@dataclass(frozen=True, kw_only=True)
class ModelOptions(LanguageOptions):
    """Which models a study asks, about which tasks, and where it writes."""

    domain: DomainName
    output: Output = RESULTS
    goal: Annotated[str | None, CommandOption("Name of a goal. Default: the domain's first.")] = (
        None
    )
    seed: Annotated[int, CommandOption("Seed of the tasks.", least=0)] = 0
    preset: Preset = None

    @property
    def jobs(self) -> int:
        """Number of processes: models are asked one question at a time."""
        return 1

    def problem(self, domain: Domain, index: int) -> AcquisitionProblem:
        """A task of the domain."""
        return AcquisitionProblem.of_task(
            domain, task_with_goal(domain, self.seed, index, self.goal)
        )

    def as_settings(self) -> dict[str, Any]:
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
