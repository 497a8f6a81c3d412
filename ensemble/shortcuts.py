# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The shortcuts that a node may use: parameters, loading, those grounded in an episode."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

from rclpy.node import Node

from ensemble.observation import Episode
from ensemble.parameters import parameter
from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError, SkillsChangedError
from slap_ros.planning.planner_choice import DEFAULT_PLANNER
from slap_ros.relational import Layout, State
from slap_ros.shortcuts.grounded_shortcuts import GroundedShortcuts
from slap_ros.shortcuts.sampling import DEFAULT
from slap_ros.shortcuts.shipped import (
    NONE,
    chosen_library,
    remark_on_skills,
    require_usable,
    skills_digest,
)
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary

GROWN = "grown"  # the choice of what lies beside the skills that slap/skills announces


@dataclass(frozen=True)
class ShortcutParameters:
    """What planner and skill server must be given alike."""

    shortcuts: str = parameter(
        "", "folder of a shortcut library, or none, or grown; empty: the shipped one"
    )
    samples: int = parameter(DEFAULT.samples, "attempts of a shortcut in the model when planning")


class ShortcutProvider:
    """The library of whatever domain the simulator runs, and what it offers in each episode."""

    def __init__(
        self, node: Node, settings: ShortcutParameters, planner: str = DEFAULT_PLANNER
    ) -> None:
        """Refuse what is wrong whatever the domain.

        Args:
            node: Logs which shortcuts of a library are left out.
            settings: Which library, and how many samples.
            planner: Name of the planner that is to use the shortcuts.

        Raises:
            InvalidParameterError: No samples, or a planner that cannot use shortcuts.
            InvalidLibraryError: The library cannot be used as a whole.
            UnknownDomainError: It is a library of a domain that is not installed here.
        """
        if settings.samples < 1:
            raise InvalidParameterError(
                f"parameter samples must be at least 1, not {settings.samples}"
            )
        self._follows = settings.shortcuts == GROWN
        self._choice = NONE if self._follows else settings.shortcuts
        require_usable(self._choice, planner)
        self.sampling = replace(DEFAULT, samples=settings.samples)
        self._node, self._planner = node, planner
        self._libraries: dict[tuple[str, str], ShortcutLibrary | None] = {}  # by _key
        self._made: dict[Layout, GroundedShortcuts] = {}  # of one episode
        self._made_for: Episode | None = None

    def prepare_episode(self, episode: Episode) -> None:
        """See :meth:`prepare`; the episode's skills are those that count.

        Raises:
            InvalidLibraryError: See :meth:`prepare`.
            SkillsChangedError: The shortcuts were learned over other skills.
        """
        if self._follows:
            self._choice = str(episode.grown or NONE)
            self._libraries.pop(_key(episode.domain), None)
        self._load(episode.domain)

    def prepare(self, domain: Domain | None) -> None:
        """Load the library of a domain, once; does nothing where there is no domain yet.

        Other skills than the domain has here may be announced before there is an episode.

        Raises:
            InvalidLibraryError: It cannot be used as a whole, or is another domain's.
        """
        if domain is not None:
            with suppress(SkillsChangedError):
                self._load(domain)

    def _load(self, domain: Domain) -> None:
        key = _key(domain)
        if key not in self._libraries:
            library = chosen_library(self._choice, domain, self._planner)
            self._libraries[key] = library
            for reason in library.refused if library is not None else ():
                self._node.get_logger().warning(f"a shortcut is left out: {reason}")
            if library is not None and (remark := remark_on_skills(library, domain)):
                self._node.get_logger().info(remark)

    def shortcuts(self, domain: Domain) -> tuple[Shortcut, ...]:
        """Those of a domain that was opened."""
        library = self._libraries.get(_key(domain))
        return library.shortcuts if library is not None else ()

    def provenance(self, domain: Domain) -> dict[str, str | int]:
        """Which library is used and how, as a plan's message has it."""
        library = self._libraries.get(_key(domain))
        digest = library.digest if library is not None else ""
        return {"library": digest, "samples": self.sampling.samples}

    def grounded(self, episode: Episode, known: State) -> GroundedShortcuts | None:
        """What there is in an episode over the objects of a state; None without shortcuts.

        It has a world of its own, so make it in the worker thread that uses it.
        """
        shortcuts = self.shortcuts(episode.domain)
        if not shortcuts:
            return None
        if self._made_for is not episode:
            self._made, self._made_for = {}, episode
        if known.layout not in self._made:
            initial = episode.task.initial_state
            start = initial if known.layout == initial.layout else known
            self._made[known.layout] = GroundedShortcuts(
                episode.domain, shortcuts, start, self.sampling
            )
        return self._made[known.layout]


def _key(domain: Domain) -> tuple[str, str]:
    """The domain's name, and the digest of its acquired skills: shortcuts are tied to both."""
    return domain.name, skills_digest(domain)
