# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Domains by name: ours, and those that other distributions register.

Another distribution adds a domain with an entry point in the group ``slap_ros.domains`` whose
value is a function ``make(preset: str) -> Domain``; one that also takes a mapping of settings to
change, by name and as text, has presets such as ``fair:obstacles=6``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from importlib import import_module
from importlib.metadata import entry_points

from slap_ros.core import Domain
from slap_ros.domains.variation import parse_preset
from slap_ros.errors import InvalidDomainError, InvalidParameterError, UnknownDomainError

PRESETS = ("fair", "paper")  # random tasks; the paper's own start states
ENTRY_POINTS = "slap_ros.domains"
OURS = {
    "obstacle2d": "slap_ros.domains.obstacle2d",
    "obstacle_tower": "slap_ros.domains.obstacle_tower",
    "cluttered_drawer": "slap_ros.domains.cluttered_drawer",
    "cleanup_table": "slap_ros.domains.cleanup_table",
}


def domain_names() -> list[str]:
    """Every known domain: ours first, then those of other distributions."""
    others = {entry.name for entry in entry_points(group=ENTRY_POINTS)} - set(OURS)
    return [*OURS, *sorted(others)]


@lru_cache(maxsize=64)
def get_domain(name: str, preset: str = "fair") -> Domain:
    """Make a domain.

    Args:
        name: One of :func:`domain_names`.
        preset: One of ``PRESETS``, maybe with settings: ``fair:obstacles=6``.

    Raises:
        UnknownDomainError: No such domain.
        InvalidParameterError: No such preset or setting.
        InvalidDomainError: The domain's own code fails or is inconsistent.
    """
    base, changes = parse_preset(preset)
    if base not in PRESETS:
        raise InvalidParameterError(f"unknown preset {base!r}; there are {', '.join(PRESETS)}")
    factory = _factory(name)
    return replace(factory(base, changes), preset=preset) if changes else factory(base)


def _factory(name: str) -> Callable[..., Domain]:
    if name in OURS:
        return _load(name, lambda: import_module(OURS[name]).make)
    for entry in entry_points(group=ENTRY_POINTS):
        if entry.name == name:
            return _load(entry.name, entry.load)
    raise UnknownDomainError(f"unknown domain {name!r}; there are {', '.join(domain_names())}")


def _load(name: str, load: Callable[[], Callable[..., Domain]]) -> Callable[..., Domain]:
    try:
        return load()
    except (ImportError, AttributeError) as error:
        raise InvalidDomainError(
            f"domain {name!r} cannot be imported: {error}; `slap doctor` says what is missing"
        ) from error
