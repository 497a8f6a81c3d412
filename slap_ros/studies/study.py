# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a study's file says of it: its command, how it is made, and the papers' figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from slap_ros.api.left_out import Tell
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.options import StudyOptions
from slap_ros.studies.results import Data, StudyReport

Options = TypeVar("Options", bound=StudyOptions)

SLAP_DOMAINS = ("obstacle2d", "obstacle_tower", "cluttered_drawer", "cleanup_table")


@dataclass(frozen=True)
class PaperFigure:
    """A table or figure of a paper.

    Args:
        source: Paper and number, such as SLAP Table 1.
        shows: What it shows, in a few words.
        domains: Names of the domains for which the paper has it.
        found: Figures of the paper by domain; those of all domains under an empty name.
        not_run: Reason why there is no data, where there is none.
    """

    source: str
    shows: str
    domains: Sequence[str] = ()
    found: Mapping[str, str] = field(default_factory=dict)
    not_run: str = ""


def not_made(source: str, shows: str, found: str, reason: str) -> PaperFigure:
    """A figure that exists for no domain here.

    Args:
        source: Paper and number.
        shows: What it shows, in a few words.
        found: Figures of the paper.
        reason: Reason why there is no data.
    """
    return PaperFigure(source, shows, found={"": found}, not_run=reason)


@dataclass(frozen=True)
class PreparedStudy:
    """A study whose options are checked.

    Args:
        settings: Settings that the report names, and its command repeats.
        make: Function that makes the report.
        given: Options that the command has besides, or states otherwise than the report.
    """

    settings: Data
    make: Callable[[JobRunner], StudyReport]
    given: Data = field(default_factory=dict)


@dataclass(frozen=True)
class Study(Generic[Options]):
    """A study, as ``slap study`` and the tables of all results need it.

    Args:
        name: Name of the study in ``slap study``.
        help: Text of the command's help: figure of the paper, and what is measured.
        example: Command of the help page's example.
        options: Dataclass whose fields are the options of the command, as
            :mod:`slap_ros.api.command_options` states options.
        prepare: Function that checks the options and opens what they name. It receives a function
            as well that takes warnings about parts of libraries that are left out.
        figures: Figures of the papers that it makes; none where no paper has one.
        summary: Tells its main figures in a few words; None where its page does.
        costs: What its recorded seconds of the processor were spent on.
    """

    name: str
    help: str
    example: str
    options: type[Options]
    prepare: Callable[[Options, Tell], PreparedStudy]
    figures: tuple[PaperFigure, ...] = ()
    summary: Callable[[Data], str] | None = None
    costs: str = "planning"


def format_steps(length: Mapping[str, float] | None) -> str:
    """A mean number of environment steps; a dash where nothing was solved."""
    return "-" if length is None else f"{length['mean']:.1f}"
