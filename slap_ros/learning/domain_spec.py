# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which domain something is learned in, as data that other processes can be sent."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from slap_ros.core import Domain


class DomainSpec(Protocol):
    """A domain that is made where it is needed.

    Learning asks for no more. Who names a domain knows whose skills it has:
    :class:`~slap_ros.acquisition.domain_choice.DomainChoice`.
    """

    @property
    def name(self) -> str:
        """The domain's."""
        ...

    @property
    def preset(self) -> str:
        """The domain's."""
        ...

    @property
    def identity(self) -> Mapping[str, str]:
        """What tells it from other domains, as work folders keep it."""
        ...

    def make(self) -> Domain:
        """The domain itself, in this process."""
        ...
