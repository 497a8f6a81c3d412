# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a domain offers to learners, or that it offers nothing."""

from __future__ import annotations

from dataclasses import replace

from slap_ros.core import Domain, LearnerInterface
from slap_ros.errors import InvalidDomainError, InvalidParameterError


def learner_interface(domain: Domain) -> LearnerInterface:
    """What the domain offers to learners.

    Raises:
        InvalidDomainError: Nothing: ``Domain.learning`` is None.
    """
    if domain.learning is None:
        raise InvalidDomainError(
            f"domain {domain.name} has no learner's interface, so that nothing can be learned in "
            "it; see Domain.learning"
        )
    return domain.learning.interface


def without(domain: Domain, term: str) -> Domain:
    """The domain as learners have it without one of the terms that were made by hand.

    Raises:
        InvalidParameterError: There is no such term.
    """
    ablations = {} if domain.learning is None else domain.learning.ablations
    if domain.learning is None or term not in ablations:
        known = f"there are {', '.join(ablations)}" if ablations else "there is none"
        raise InvalidParameterError(
            f"domain {domain.name} has no learner's interface without {term!r}; {known}"
        )
    return replace(domain, learning=replace(domain.learning, interface=ablations[term]))
