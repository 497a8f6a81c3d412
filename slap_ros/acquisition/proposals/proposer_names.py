# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Names of proposers and rewarders, as options and parameters have them."""

from __future__ import annotations

from collections.abc import Sequence

from slap_ros.errors import InvalidParameterError

MANUAL, INDUCED, COMPOSED, LANGUAGE = "manual", "induced", "composed", "language"
PROPOSERS = (MANUAL, INDUCED, LANGUAGE)
REWARDERS = (MANUAL, COMPOSED, LANGUAGE)
NO_REWARDER = "none"  # name for no rewarder, where no skill is to be learned


def require_known(what: str, name: str, known: Sequence[str]) -> None:
    """Refuse a name that is not among those that there are.

    Args:
        what: Word for what has the name, such as ``proposer``.
        name: Name that was given.
        known: Names that are accepted.

    Raises:
        InvalidParameterError: It lists them.
    """
    if name not in known:
        raise InvalidParameterError(f"{what} {name!r}: there are {', '.join(known)}")
