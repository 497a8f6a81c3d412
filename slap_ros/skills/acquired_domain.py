# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A domain with acquired operators and skills, like any other."""

from __future__ import annotations

from dataclasses import replace

from slap_ros.core import Domain
from slap_ros.skills.skill_library import SkillLibrary


def acquired_domain(domain: Domain, library: SkillLibrary) -> Domain:
    """The domain with a library's operators and skills in the place of its own.

    Args:
        domain: Domain whose predicates, worlds and approach are used.
        library: Library of skills of that domain.

    Returns:
        The domain; what is static in it is what was static before, and of the operators written by
        hand it knows those for which the library has no skill.
    """
    skills = {skill.operator.name: skill for skill in library.skills}
    written = domain.acquisition.operators if domain.acquisition else ()
    return replace(
        domain,
        operators=tuple(skill.operator for skill in skills.values()),
        skills={name: skill.in_domain(domain) for name, skill in skills.items()},
        unskilled=tuple(operator for operator in written if operator.name not in skills),
        static=domain.static_predicates,
        exact=False,
    )
