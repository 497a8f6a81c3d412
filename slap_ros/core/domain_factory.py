# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What makes a domain under each of its presets."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from inspect import Parameter, signature
from types import MappingProxyType
from typing import Any

from slap_ros.core.domain import Domain
from slap_ros.errors import InvalidDomainError, InvalidParameterError

ONLY_PRESET = "default"  # of a domain that names none
_POSITIONAL = (Parameter.POSITIONAL_ONLY, Parameter.POSITIONAL_OR_KEYWORD)


@dataclass(frozen=True)
class DomainFactory:
    """Makes a domain under each of its presets; see :func:`presets`.

    Args:
        make: Function that makes the domain; it takes nothing, or a preset's name, or that and
            settings to change.
        presets: Names; the first is used where none is asked for.

    Raises:
        InvalidDomainError: Names that occur twice, or that no command line could tell apart.
    """

    make: Callable[..., Domain]
    presets: tuple[str, ...] = (ONLY_PRESET,)

    def __post_init__(self) -> None:
        if not self.presets or len(set(self.presets)) < len(self.presets):
            raise InvalidDomainError(f"presets must be one or more, each once: {self.presets}")
        for name in self.presets:
            if not isinstance(name, str) or not name.isidentifier():
                raise InvalidDomainError(
                    f"{name!r} is not a name of a preset: use only letters, digits and _"
                )

    def __call__(
        self,
        preset: str | None = None,
        changes: Mapping[str, str] = MappingProxyType({}),
        **more: Any,
    ) -> Domain:
        """Make the domain.

        Args:
            preset: Name of the preset, one of ``presets``; None for the first.
            changes: Settings of the preset to change, by name.
            more: Further arguments of ``make``.

        Raises:
            InvalidParameterError: No such preset; or it has no such setting, or none at all.
        """
        preset = preset or self.presets[0]
        if preset not in self.presets:
            settings = f"; settings follow one, {self.presets[0]}:{preset}" if "=" in preset else ""
            raise InvalidParameterError(
                f"unknown preset {preset!r}; there are {', '.join(self.presets)}{settings}"
            )
        places = self._places()
        if changes and places < 2:
            raise InvalidParameterError(f"preset {preset!r} has no settings to change")
        return self.make(*(preset, changes)[:places], **more)

    def _places(self) -> int:
        """How many arguments ``make`` takes, up to two."""
        parameters = signature(self.make).parameters.values()
        if any(parameter.kind is Parameter.VAR_POSITIONAL for parameter in parameters):
            return 2
        return min(2, sum(parameter.kind in _POSITIONAL for parameter in parameters))


def presets(first: str, *others: str) -> Callable[[Callable[..., Domain]], DomainFactory]:
    """Name the presets that a function can make a domain with; a decorator.

    Args:
        first: Name of the preset that is used where none is given.
        others: Names of further presets.

    Returns:
        Makes the function a :class:`DomainFactory`.

    Raises:
        InvalidDomainError: See :class:`DomainFactory`.
    """
    return lambda make: DomainFactory(make, (first, *others))
