# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The choice of a domain: its name, its preset, and its skills.

Operators decide what is planned and skills what is executed, so a domain with other skills is
another domain. One value names it, wherever it has to be made again: in other processes, nodes and
bags. A library of skills is known by its digest, wherever its folder may be.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from slap_ros.errors import InvalidLibraryError, InvalidParameterError, SkillsChangedError
from slap_ros.policies.shipped_models import shipped_folder

if TYPE_CHECKING:  # a choice is named wherever options are read, and costs no import there
    from slap_ros.core import Domain
    from slap_ros.messages.protocols import DomainInfoMessage
    from slap_ros.skills.skill_library import SkillLibrary

SHIPPED = ""  # choice of the library that ships for the domain, else of its own skills
NO_SKILLS = "none"
DEMONSTRATOR = "demonstrator"
WORDS = (SHIPPED, NO_SKILLS, DEMONSTRATOR)
# Keys of a domain's configuration, which worlds announce and bags have; absent for its own skills.
SKILLS_KEY, DIGEST_KEY = "skills", "skills_digest"
# The choice of skills, by the digest of the library that was found there: a domain has no
# path in its configuration, which goes into bags.
_OPENED: dict[str, str] = {}


@dataclass(frozen=True)
class DomainChoice:
    """A domain by name.

    Args:
        name: Name of the domain, one of :func:`slap_ros.domains.domain_names`.
        preset: Preset of the domain, maybe with settings; empty for its first.
        skills: Choice of skills: empty for what ships, ``none`` for no operators and no skills,
            ``demonstrator`` for the hand-written operators with scripts in the place of skills, or
            the folder of a library of acquired skills.
        digest: Digest of the library that must be found; empty for any library.
        measured: Whether its states are measured on a robot.

    Raises:
        InvalidParameterError: Skills that are none of these.
    """

    name: str
    preset: str = ""
    skills: str = SHIPPED
    digest: str = ""
    measured: bool = False

    def __post_init__(self) -> None:
        if self.skills not in WORDS and not Path(self.skills).is_dir():
            raise InvalidParameterError(
                f"unknown skills {self.skills!r}; there are {NO_SKILLS}, {DEMONSTRATOR}, any "
                "folder that `slap acquire` made, and nothing (empty) for what ships"
            )

    @classmethod
    def of(cls, domain: Domain, skills: str = SHIPPED) -> DomainChoice:
        """The choice by which a domain was opened.

        Args:
            domain: Domain that was opened.
            skills: Choice of skills with which the domain was opened; their digest is taken from
                the domain.
        """
        digest = str(domain.configuration.get(DIGEST_KEY, ""))
        return cls(domain.name, domain.preset, skills, digest, domain.is_measured)

    @classmethod
    def opened_as(cls, domain: Domain) -> DomainChoice:
        """The choice by which a domain was opened in this process, from the domain's configuration.

        Args:
            domain: Domain that was opened by :func:`open_domain`; or made otherwise, and then
                without a library.
        """
        said = domain.configuration
        digest = str(said.get(DIGEST_KEY, ""))
        skills = _OPENED.get(digest, SHIPPED) if digest else str(said.get(SKILLS_KEY, SHIPPED))
        return cls(domain.name, domain.preset, skills, digest, domain.is_measured)

    @property
    def identity(self) -> dict[str, str]:
        """The values that tell the domain from others: name, preset, and skills unless its own.

        A library counts by its digest, which a choice has that was made by :meth:`of`.
        """
        whose = self.digest or self.skills
        return {"domain": self.name, "preset": self.preset} | ({"skills": whose} if whose else {})

    def make(self) -> Domain:
        """Open the domain; see :func:`open_domain`. For jobs that receive a choice."""
        return open_domain(self)

    @classmethod
    def announced(cls, info: DomainInfoMessage) -> DomainChoice:
        """The choice that a world announces, or announced when it was recorded.

        Raises:
            InvalidParameterError: Skills that are not known here. A folder is none: whose skills
                they are is said by a digest, and a path from elsewhere is not opened.
        """
        said = {str(pair.key): str(pair.value) for pair in info.configuration}
        digest = said.get(DIGEST_KEY, "")
        skills = SHIPPED if digest else said.get(SKILLS_KEY, SHIPPED)
        if skills not in WORDS:
            raise InvalidParameterError(f"unknown skills {skills!r}, announced without a digest")
        return cls(str(info.name), str(info.preset), skills, digest, _is_measured(said))

    def with_skills_of(self, name: str, given: str) -> DomainChoice:
        """The choice of a node that was given skills of its own.

        Args:
            name: Name of the node.
            given: Value of the node's parameter skills; empty where it takes whatever is announced.

        Returns:
            The choice; whether a folder has the digest that is announced is seen once it is
            opened.

        Raises:
            SkillsChangedError: The node was given others.
        """
        if not given or (given == self.skills and not self.digest):
            return self
        if given in WORDS or not self.digest:
            raise SkillsChangedError(
                f"{self.name} runs with {self._in_words}, but {name} was given {given}: start "
                "every node with the same parameter skills"
            )
        return replace(self, skills=given)

    @property
    def library_folder(self) -> Path | None:
        """The folder of the library; None where no library is chosen, or none ships."""
        if self.skills == SHIPPED:
            return shipped_folder("skills", self.name)
        return None if self.skills in WORDS else Path(self.skills)

    def require_digest(self, found: str) -> None:
        """Refuse another library than the one that is chosen, if one is.

        Raises:
            SkillsChangedError: Another library is there, or none.
        """
        if self.digest in ("", found):
            return
        here = self.library_folder
        there = f"{here} has {found}" if here else f"no library of {self.name} ships"
        raise SkillsChangedError(
            f"{self.name} runs with {self._in_words}, but {there}: give the folder of that "
            "library as skills, here and to every node"
        )

    @property
    def _in_words(self) -> str:
        if self.digest:
            return f"the library of skills {self.digest}"
        return f"skills {self.skills or 'of its own'}"


def open_domain(choice: DomainChoice) -> Domain:
    """Make the domain of a choice.

    Args:
        choice: Choice of the domain.

    Returns:
        The domain; its configuration says whose skills it has, unless they are its own, and whether
        its states are measured. Its predicates, those that nothing changes among them, are the same
        whatever the skills, so that the same state is perceived alike.

    Raises:
        UnknownDomainError: No such domain.
        InvalidParameterError: No such preset or setting; or the domain has no demonstrator.
        InvalidDomainError: The domain's own code fails or is inconsistent.
        InvalidLibraryError: The folder has no library of this domain that can be read.
        SkillsChangedError: The folder has another library than the one that is chosen.
    """
    domain = _with_chosen_skills(choice)
    if not choice.measured:
        return domain
    from slap_ros.core.domain import MEASURED

    return _configured(domain, MEASURED)


def _with_chosen_skills(choice: DomainChoice) -> Domain:
    domain = _with_own_skills(choice)
    library = _library(choice, domain)
    if library is not None:
        from slap_ros.skills.acquired_domain import acquired_domain

        choice.require_digest(library.digest)
        folder = choice.library_folder
        assert folder is not None
        _OPENED[library.digest] = choice.skills
        said = {SKILLS_KEY: folder.resolve().name, DIGEST_KEY: library.digest}
        return _configured(acquired_domain(domain, library), said)
    choice.require_digest("")
    if choice.skills == DEMONSTRATOR:
        from slap_ros.skills.scripted_skill import with_scripts

        return _configured(with_scripts(domain), {SKILLS_KEY: DEMONSTRATOR})
    if choice.skills == NO_SKILLS:
        bare = replace(domain, operators=(), skills={}, static=domain.static_predicates)
        return _configured(bare, {SKILLS_KEY: NO_SKILLS})
    return domain


def chosen_skills(choice: DomainChoice) -> SkillLibrary | None:
    """The library of skills of a choice; None where the domain has other skills, or none.

    Raises:
        SlapError: As :func:`open_domain`.
    """
    return _library(choice, _with_own_skills(choice))


def _with_own_skills(choice: DomainChoice) -> Domain:
    from slap_ros.domains import get_domain

    return get_domain(choice.name, choice.preset or None)


def _library(choice: DomainChoice, domain: Domain) -> SkillLibrary | None:
    folder = choice.library_folder
    if folder is None:
        return None
    from slap_ros.skills.skill_library import load_skill_library

    library = load_skill_library(folder, domain)
    if not library.skills:
        reasons = "; ".join(map(str, library.refused)) or "it has none"
        raise InvalidLibraryError(f"{folder}: no skill of it can be used: {reasons}")
    return library


def _is_measured(said: Mapping[str, str]) -> bool:
    from slap_ros.core.domain import MEASURED

    return MEASURED.items() <= said.items()


def _configured(domain: Domain, said: Mapping[str, str]) -> Domain:
    return replace(domain, configuration={**domain.configuration, **said})
