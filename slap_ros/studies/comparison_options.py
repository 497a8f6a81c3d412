# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The options of studies that compare pure planning with SLAP, and what they choose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from slap_ros.api.command_options import DomainName, Jobs, Preset, Samples, ShortcutFolder
from slap_ros.api.left_out import Tell
from slap_ros.api.library_descriptions import describe_library
from slap_ros.api.shortcut_choice import SAMPLES, choose_library, sampling, shortcuts_of_option
from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.approaches import Approach, approaches
from slap_ros.shortcuts.shipped import shipped_library
from slap_ros.studies.comparison import Comparison
from slap_ros.studies.job_runner import JobRunner
from slap_ros.studies.options import FRESH_SEED, RESULTS, FirstSeed, Output, Seeds, Tasks
from slap_ros.studies.results import Data, StudyReport
from slap_ros.studies.study import PreparedStudy


@dataclass(frozen=True, kw_only=True)
class ComparisonOptions:
    """Which tasks a study samples, how it compares pure planning with SLAP, and where it writes."""

    domain: DomainName
    tasks: Tasks = 4
    seeds: Seeds = 5
    first_seed: FirstSeed = FRESH_SEED
    preset: Preset = None
    jobs: Jobs = 1
    output: Output = RESULTS
    shortcuts: ShortcutFolder = None
    samples: Samples = SAMPLES


@dataclass(frozen=True)
class ChosenComparison:
    """Pure planning and SLAP, and for which tasks.

    Args:
        domain: Domain under the chosen preset.
        approaches: Ways to plan, pure planning first.
        settings: Settings that a report names.
        options: Options of the command.
    """

    domain: Domain
    approaches: tuple[Approach, ...]
    settings: Data
    options: ComparisonOptions

    @classmethod
    def of(
        cls,
        options: ComparisonOptions,
        tell: Tell,
        settings: Data | None = None,
        needs_library: bool = True,
    ) -> ChosenComparison:
        """What the options ask for.

        Args:
            options: Options of the command.
            tell: Function that receives warnings about shortcuts that are left out.
            settings: Settings of the study itself that a report names.
            needs_library: Whether there is nothing to study without shortcuts.

        Raises:
            InvalidParameterError: There are none, and they are needed.
        """
        chosen = get_domain(options.domain, options.preset)
        given = shortcuts_of_option(options.shortcuts)
        library = choose_library(given, chosen, "lazy", tell)
        folder = Path(options.shortcuts) if options.shortcuts else shipped_library(options.domain)
        if library is None and needs_library:
            raise InvalidParameterError(
                f"there is nothing to compare with pure planning in {options.domain}: give a "
                "shortcut library with --shortcuts"
            )
        named = {
            **(settings or {}),
            "preset": chosen.preset,
            "tasks": options.tasks,
            "seeds": options.seeds,
            "first_seed": options.first_seed,
            "samples": options.samples,
        }
        if library is not None and folder is not None:
            named["library"] = describe_library(folder.name, library)
        return cls(chosen, approaches(library, sampling(options.samples)), named, options)

    def ends(self) -> ChosenComparison:
        """The same for pure planning and SLAP alone, without the approaches between them."""
        return replace(self, approaches=(self.approaches[0], self.approaches[-1]))

    def prepare(self, make: Callable[[Comparison], StudyReport], **given: Any) -> PreparedStudy:
        """Make the study ready.

        Args:
            make: Function that makes the report.
            given: Options of the command beside the settings.
        """
        options = self.options

        def compare(runner: JobRunner) -> StudyReport:
            return make(
                Comparison(
                    domain=self.domain,
                    approaches=self.approaches,
                    tasks=options.tasks,
                    seeds=options.seeds,
                    first_seed=options.first_seed,
                    runner=runner,
                )
            )

        return PreparedStudy(self.settings, compare, {**given, "shortcuts": options.shortcuts})
