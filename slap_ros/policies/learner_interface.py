# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The learner's interface of a domain, or the error where there is none."""

from __future__ import annotations

from dataclasses import replace

from slap_ros.core import Domain, LearnerInterface
from slap_ros.errors import InvalidDomainError, InvalidParameterError


def learner_interface(domain: Domain) -> LearnerInterface:
    """The learner's interface of a domain.

    Raises:
        InvalidDomainError: It has none: ``Domain.learning`` is None.
    """
    if domain.learning is None:
        raise InvalidDomainError(
            f"domain {domain.name} has no learner's interface, so that nothing can be learned in "
            "it; see Domain.learning"
        )
    return domain.learning.interface


def without(domain: Domain, term: str) -> Domain:
    """The domain with a learner's interface that lacks one of the terms made by hand.

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
