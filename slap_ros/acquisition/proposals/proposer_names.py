# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Names of those who propose operators and rewards, as options and parameters have them."""

from __future__ import annotations

from collections.abc import Sequence

from slap_ros.errors import InvalidParameterError

MANUAL, INDUCED, COMPOSED, LANGUAGE = "manual", "induced", "composed", "language"
PROPOSERS = (MANUAL, INDUCED, LANGUAGE)
REWARDERS = (MANUAL, COMPOSED, LANGUAGE)
NO_REWARDER = "none"  # where no skill is to be learned


def require_known(what: str, name: str, known: Sequence[str]) -> None:
    """Refuse a name that is not among those that there are.

    Args:
        what: Whose name it is.
        name: As it was given.
        known: All that there are.

    Raises:
        InvalidParameterError: It lists them.
    """
    if name not in known:
        raise InvalidParameterError(f"{what} {name!r}: there are {', '.join(known)}")
