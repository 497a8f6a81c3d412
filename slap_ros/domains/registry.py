# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Domains by name: ours, and those that other distributions register.

Another distribution adds a domain with an entry point in the group ``slap_ros.domains``, whose name
is the domain's and whose value is a function that makes it. A function that takes nothing makes the
one preset ``default``; :func:`slap_ros.core.presets` names others.

Whatever the code of another distribution raises is an InvalidDomainError of that domain, and
nobody else's.
"""

from __future__ import annotations

import reprlib
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from importlib import import_module
from importlib.metadata import Distribution, EntryPoint, distributions
from traceback import format_exception_only
from types import TracebackType

from slap_ros.core import Domain, DomainFactory
from slap_ros.domains.variation import parse_preset
from slap_ros.errors import InvalidDomainError, InvalidParameterError, UnknownDomainError

ENTRY_POINTS = "slap_ros.domains"
OURS = {
    "obstacle2d": "slap_ros.domains.obstacle2d",
    "obstacle_tower": "slap_ros.domains.obstacle_tower",
    "cluttered_drawer": "slap_ros.domains.cluttered_drawer",
    "cleanup_table": "slap_ros.domains.cleanup_table",
    "stack_at_target": "slap_ros.domains.stack_at_target",
    "groceries": "slap_ros.domains.groceries",
    "stow_hammer": "slap_ros.domains.stow_hammer",
    "make_coffee": "slap_ros.domains.make_coffee",
    "peg_in_hole": "slap_ros.domains.peg_in_hole",
    "bowls": "slap_ros.domains.bowls",
}
CACHED = 64  # domains that are made once
UNREADABLE = (TypeError, ValueError, OSError)  # what entry points of a distribution may raise


@dataclass(frozen=True)
class Registrations:
    """What other distributions register.

    Args:
        entries: Entry points of all distributions that can be read.
        unreadable: Distributions that cannot be read, each with the error.
    """

    entries: tuple[EntryPoint, ...]
    unreadable: tuple[str, ...]


@cache
def registrations() -> Registrations:
    """Read every distribution by itself: ``entry_points`` raises for all if one is malformed.

    Names are read where something registers alone: to read all takes a tenth of a second.
    """
    installed = list(distributions())
    registering = [place for place, one in enumerate(installed) if _may_register(one)]
    names = [_name(one) for one in installed] if registering else []
    entries: list[EntryPoint] = []
    unreadable: list[str] = []
    for place in registering:
        if names.index(names[place]) < place:  # one that comes later on the path is hidden
            continue
        try:
            entries += installed[place].entry_points.select(group=ENTRY_POINTS)
        except UNREADABLE as error:
            unreadable.append(f"{names[place]}: {error!r}")
    return Registrations(tuple(entries), tuple(unreadable))


def _may_register(distribution: Distribution) -> bool:
    """Whether a distribution's entry points name our group, or cannot be read."""
    try:
        return ENTRY_POINTS in (distribution.read_text("entry_points.txt") or "")
    except UNREADABLE:
        return True


def _name(distribution: Distribution) -> str:
    return distribution.metadata["Name"] or str(distribution)


def domain_names() -> list[str]:
    """Every known domain: ours first, then those of other distributions."""
    others = {entry.name for entry in registrations().entries} - set(OURS)
    return [*OURS, *sorted(others)]


def preset_names(name: str) -> tuple[str, ...]:
    """The presets of a domain, the default one first.

    Raises:
        UnknownDomainError: No such domain.
        InvalidDomainError: The domain's own code fails.
    """
    return _factory(name).presets


def get_domain(name: str, preset: str | None = None) -> Domain:
    """Make a domain.

    Args:
        name: Name of the domain, one of :func:`domain_names`.
        preset: Name of the preset, one of :func:`preset_names`, maybe with settings:
            ``fair:obstacles=6``. None, or empty: the first.

    Raises:
        UnknownDomainError: No such domain.
        InvalidParameterError: No such preset or setting.
        InvalidDomainError: The domain's own code fails or is inconsistent.
    """
    return _make(name, preset or preset_names(name)[0])


def forget_domains() -> None:
    """Look again at what is installed, and make domains again."""
    registrations.cache_clear()
    _factory.cache_clear()
    _make.cache_clear()


@lru_cache(maxsize=CACHED)
def _make(name: str, preset: str) -> Domain:
    factory = _factory(name)
    base, changes = parse_preset(preset)
    with _Blame(name, let_pass=(InvalidParameterError,)):
        domain = factory(base, changes)
        if not isinstance(domain, Domain):
            made = reprlib.repr(domain)  # not all of a large one
            raise InvalidDomainError(f"domain {name!r} made {made}, which is not a Domain")
        if domain.name != name:
            raise InvalidDomainError(
                f"domain {name!r} calls itself {domain.name!r}; give the entry point that name"
            )
    return domain if domain.preset == preset else replace(domain, preset=preset)


@lru_cache(maxsize=CACHED)
def _factory(name: str) -> DomainFactory:
    entries = [entry for entry in registrations().entries if entry.name == name]
    if name not in OURS and not entries:
        raise UnknownDomainError(f"unknown domain {name!r}; there are {', '.join(domain_names())}")
    with _Blame(name):
        made = import_module(OURS[name]).make if name in OURS else _load(name, entries)
        if not callable(made):
            raise InvalidDomainError(f"domain {name!r}: {made!r} is not a function that makes it")
        return made if isinstance(made, DomainFactory) else DomainFactory(made)


def _load(name: str, entries: list[EntryPoint]) -> object:
    """What the entry points of this name, one as a rule, stand for."""
    if len({entry.value for entry in entries}) > 1:
        owners = ", ".join(sorted(f"{e.dist.name if e.dist else '?'} ({e.value})" for e in entries))
        raise InvalidDomainError(f"domain {name!r} is registered more than once: by {owners}")
    return entries[0].load()


class _Blame:
    """Raise whatever a domain's own code raises, even to end the process, as that domain's error.

    No generator: one that Ctrl-C leaves behind gets a GeneratorExit, which would be blamed as well.
    """

    def __init__(self, name: str, let_pass: tuple[type[Exception], ...] = ()) -> None:
        self._name = name
        self._let_pass = let_pass  # the caller's fault

    def __enter__(self) -> None:
        """Watch from now on."""

    def __exit__(
        self, _: type[BaseException] | None, error: BaseException | None, __: TracebackType | None
    ) -> None:
        if error is None or isinstance(error, (KeyboardInterrupt, *self._let_pass)):
            return
        if isinstance(error, InvalidDomainError) and self._name in str(error):
            return
        # Also of an exception whose own message fails.
        *_lines, said = "".join(format_exception_only(error)).strip().splitlines()
        raise InvalidDomainError(
            f"domain {self._name!r} cannot be made: {said}; `slap doctor` says what is missing of "
            f'ours, `python -c "from slap_ros.domains import get_domain; '
            f'get_domain({self._name!r})"` where it fails'
        ) from error
