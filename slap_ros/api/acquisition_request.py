# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What skills are to be acquired, how, and where they are kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from slap_ros.acquisition.proposals.proposer_names import (
    LANGUAGE,
    MANUAL,
    REWARDERS,
    require_known,
)
from slap_ros.acquisition.training.embedding_encoder import EmbeddingEncoder
from slap_ros.acquisition.training.retrieval import MetricSignatureEncoder, SkillEncoder
from slap_ros.acquisition.training.settings import ACQUISITION_SETTINGS, AcquisitionSettings
from slap_ros.api.command_line import command_line
from slap_ros.api.proposers import Proposers
from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError
from slap_ros.language.settings import LOCAL_SCHEME, read_settings
from slap_ros.language.text_embedder import LocalEmbedder, ServerEmbedder
from slap_ros.learning.setting_changes import changed, parse_changes
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.shortcuts.library_choice import LibraryChoice
from slap_ros.shortcuts.shipped import require_same_skills
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.skills.domain_choice import DomainChoice, open_domain


@dataclass(frozen=True)
class AcquisitionRequest:
    """What to acquire, how, and where to keep it.

    Args:
        domain: Domain to acquire skills in.
        library_folder: Folder that the library is saved to.
        work_folder: Folder for checkpoints.
        proposers: Proposer of the operators, with its sources, model and budget.
        goal: Name of a goal, or atoms; None for the domain's first goal.
        seed: Seed of all random numbers.
        rewarder: Name of the rewarder: manual, composed or language.
        settings: Name of the hyper-parameters.
        changes: Settings to change, as texts.
        steps: Environment steps for all skills together; None for those of the settings.
        begin_with: Libraries whose skills new ones may begin with.
        encoder: Embedding model that says which skills are alike; None for metrics alone.
        keep: Library whose skills are there already.
        revise: Whether a model may change what it has proposed for skills that are given up.
        shortcuts: Library of shortcuts over the skills to keep. Skills that fail where these
            shortcuts have led are learned from there.
        proposal_of: Work folder of an earlier acquisition whose operators and rewards are used
            again; None to have some proposed.
        continued: Folders of the trainings of skills of ``keep``, by operator. Where these skills
            are learned further, their trainings go on, with their critics and replay buffers.

    Raises:
        InvalidParameterError: They do not fit together.
    """

    domain: Domain
    library_folder: Path
    work_folder: Path
    proposers: Proposers = field(default_factory=Proposers)
    goal: str | None = None
    seed: int = 0
    rewarder: str = MANUAL
    settings: str = "small"
    changes: Sequence[str] = ()
    steps: int | None = None
    begin_with: Sequence[Path] = ()
    encoder: str | None = None
    keep: Path | None = None
    revise: bool = False
    shortcuts: Path | None = None
    proposal_of: Path | None = None
    continued: Mapping[str, Path] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_known("--rewarder", self.rewarder, REWARDERS)
        if self.encoder is not None and not self.begin_with:
            raise InvalidParameterError("--encoder is for --from: without, nothing is retrieved")
        if self.shortcuts is not None and self.keep is None:
            raise InvalidParameterError(
                "--shortcuts is for --keep: plans with shortcuts need the skills that the "
                "shortcuts were learned over"
            )
        if self.revise and LANGUAGE not in (self.proposers.proposer, self.rewarder):
            raise InvalidParameterError(
                "--revise is for --proposer language or --rewarder language: nobody else is asked"
            )

    @property
    def goal_or_first(self) -> str:
        """The goal that is trained for; empty for each task's own."""
        return self.goal if self.goal is not None else next(iter(self.domain.goals), "")

    @property
    def command(self) -> str:
        """The command that acquires the same library again."""
        return command_line(
            "acquire",
            self.domain.name,
            preset=self.domain.preset,
            goal=self.goal,
            seed=self.seed,
            **self.proposers.given,
            rewarder=self.rewarder,
            **{"from": [shareable(folder) for folder in self.begin_with]},
            encoder=self.encoder,
            keep=shareable(self.keep) if self.keep else None,
            revise=self.revise or None,
            shortcuts=shareable(self.shortcuts) if self.shortcuts else None,
            settings=self.settings,
            steps=self.steps,
            set=list(self.changes) or None,
        )

    def chosen_settings(self) -> AcquisitionSettings:
        """Hyper-parameters of the curriculum.

        Raises:
            InvalidParameterError: There are none of that name, or they cannot be changed so.
        """
        if self.settings not in ACQUISITION_SETTINGS:
            raise InvalidParameterError(
                f"unknown settings {self.settings!r}; there are {', '.join(ACQUISITION_SETTINGS)}"
            )
        changes = parse_changes(self.changes, AcquisitionSettings)
        if self.steps is not None and "total_steps" in changes:
            raise InvalidParameterError("--steps and --set total_steps say the same: give one")
        chosen = changed(ACQUISITION_SETTINGS[self.settings], changes)
        return chosen if self.steps is None else replace(chosen, total_steps=self.steps)

    def skill_encoder(self) -> SkillEncoder:
        """What says which skills are alike.

        Raises:
            InvalidParameterError: Language settings cannot be read, or name no server.
            LanguageUnavailableError: There is no key, no client, or no such package with weights.
        """
        if self.encoder is None:
            return MetricSignatureEncoder()
        work = WorkFolder(self.work_folder)
        if self.encoder.startswith(LOCAL_SCHEME):
            return EmbeddingEncoder(LocalEmbedder(self.encoder.removeprefix(LOCAL_SCHEME)), work)
        proposers = self.proposers
        settings = read_settings(proposers.language_settings, self.encoder, proposers.base_url)
        if not settings.asks_a_server:
            raise InvalidParameterError(
                f"--encoder asks a server; {settings.model} at {settings.base_url} is not one: "
                f"give another --base-url, or --encoder {LOCAL_SCHEME}PACKAGE"
            )
        return EmbeddingEncoder(ServerEmbedder(settings), work)

    def shortcuts_over_kept(self) -> LibraryChoice | None:
        """The shortcuts after which skills are tried; None for no shortcuts.

        Raises:
            InvalidLibraryError: It is no library of shortcuts of this domain.
            SkillsChangedError: It was learned over other skills than those to keep.
        """
        if self.shortcuts is None:
            return None
        assert self.keep is not None  # see above
        kept = open_domain(DomainChoice(self.domain.name, self.domain.preset, str(self.keep)))
        library = load_library(self.shortcuts, kept)
        require_same_skills(library, kept, str(self.shortcuts))
        return LibraryChoice(self.shortcuts.resolve(), library.digest)


def shareable(folder: Path) -> str:
    """A folder as it was given, or its name alone: no path of this machine goes into a record."""
    return folder.name if folder.is_absolute() else folder.as_posix()
