# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which domain is meant: its name, its preset, and whose skills it has.

Operators decide what is planned and skills what is executed, so a domain with other skills is
another domain. One value names it, wherever it has to be made again: in other processes, nodes and
bags.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.scripted_skill import with_scripts
from slap_ros.messages.protocols import DomainInfoMessage

SHIPPED = ""  # the skills that the domain itself has
NO_SKILLS = "none"
DEMONSTRATOR = "demonstrator"
SKILLS = (SHIPPED, NO_SKILLS, DEMONSTRATOR)
SKILLS_KEY = "skills"  # in what a world announces of its domain; not there for what ships


@dataclass(frozen=True)
class DomainChoice:
    """A domain by name.

    Args:
        name: One of :func:`slap_ros.domains.domain_names`.
        preset: One of the domain's, maybe with settings; empty: its first.
        skills: Empty for what ships, ``none`` for no operators and no skills, ``demonstrator`` for
            the hand-written operators with scripts in the place of skills.

    Raises:
        InvalidParameterError: Skills that are none of these.
    """

    name: str
    preset: str = ""
    skills: str = SHIPPED

    def __post_init__(self) -> None:
        if self.skills not in SKILLS:
            raise InvalidParameterError(
                f"unknown skills {self.skills!r}; there are {NO_SKILLS}, {DEMONSTRATOR}, and "
                "nothing (empty) for those that the domain itself has"
            )

    @classmethod
    def of(cls, domain: Domain, skills: str = SHIPPED) -> DomainChoice:
        """The choice of a domain's name and preset, with skills as they are said to be."""
        return cls(domain.name, domain.preset, skills)

    @classmethod
    def announced(cls, info: DomainInfoMessage) -> DomainChoice:
        """The choice that a world announces, or announced when it was recorded.

        Raises:
            InvalidParameterError: Skills that are not known here.
        """
        skills = [str(pair.value) for pair in info.configuration if pair.key == SKILLS_KEY]
        return cls(str(info.name), str(info.preset), skills[0] if skills else SHIPPED)

    @property
    def configuration(self) -> Mapping[str, str]:
        """What a world announces of it beside name and preset."""
        return {SKILLS_KEY: self.skills} if self.skills else {}


def open_domain(choice: DomainChoice) -> Domain:
    """Make the domain that is meant.

    Args:
        choice: Which one.

    Returns:
        The domain. Its predicates, those that nothing changes among them, are the same whatever
        the skills, so that the same state is perceived alike.

    Raises:
        UnknownDomainError: No such domain.
        InvalidParameterError: No such preset or setting; or the domain has no demonstrator.
        InvalidDomainError: The domain's own code fails or is inconsistent.
    """
    domain = get_domain(choice.name, choice.preset or None)
    if choice.skills == DEMONSTRATOR:
        return with_scripts(domain)
    if choice.skills == NO_SKILLS:
        return replace(domain, operators=(), skills={}, static=domain.static_predicates)
    return domain
