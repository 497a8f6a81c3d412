# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What varies in a study: one setting of a domain's preset, which takes one value after another."""

from __future__ import annotations

from ast import literal_eval
from collections.abc import Iterable
from dataclasses import dataclass
from statistics import fmean

from slap_ros.core import Domain
from slap_ros.domains.variation import parse_preset
from slap_ros.errors import InvalidParameterError


@dataclass(frozen=True)
class Variation:
    """A setting and its values, as presets have them: numbers, or ranges such as ``0.8..1.2``."""

    setting: str
    values: tuple[str, ...]

    def preset(self, base: str, value: str) -> str:
        """A preset with this setting at a value, in place of the one that it may have."""
        name, changes = parse_preset(base)
        changes[self.setting] = value
        return f"{name}:{','.join(f'{key}={text}' for key, text in changes.items())}"

    @property
    def label(self) -> str:
        """The label for an axis, with the unit."""
        return LABELS.get(self.setting, self.setting.replace("_", " "))


# What SLAP Fig. 5 varies, by whatever name a domain has for it: fewer and more of each thing.
OBSTACLES = Variation("obstacles", ("1", "2", "3", "4", "5"))
TOYS = Variation("toys", ("1", "2", "3", "4"))
DISTRACTORS = Variation("distractors", ("0", "1", "2", "3", "4"))
BYSTANDERS = Variation("bystanders", ("0", "1", "2"))  # a fourth block has hardly any room
NUMBERS = (OBSTACLES, TOYS, BYSTANDERS, DISTRACTORS)  # what makes tasks harder first
FACTORS = (0.5, 1.0, 2.0)  # of the mass and friction that things have by default
LABELS = {
    "mass": "mass of a thing [kg]",
    "friction": "coefficient of friction",
}


def offered(domain: Domain) -> tuple[Variation, ...]:
    """The usual variations of what the domain's preset has settings for.

    Raises:
        InvalidParameterError: It has none of them.
    """
    known = {one.setting: one for one in NUMBERS}
    found = _settings(domain, (*known, "mass", "friction"))
    return tuple(known.get(name) or _scaled(domain, name) for name in found)


def offered_number(domain: Domain) -> Variation:
    """The number of things, of what the domain's preset has a setting for.

    Raises:
        InvalidParameterError: It has none.
    """
    known = {one.setting: one for one in NUMBERS}
    return known[_settings(domain, known)[0]]


def _scaled(domain: Domain, setting: str) -> Variation:
    """A setting at parts and multiples of its default."""
    middle = fmean(literal_eval(str(domain.configuration[setting])))
    return Variation(setting, tuple(str(factor * middle) for factor in FACTORS))


def _settings(domain: Domain, wanted: Iterable[str]) -> list[str]:
    """The settings that the domain's preset has, one at least."""
    found = [setting for setting in wanted if setting in domain.configuration]
    if not found:
        raise InvalidParameterError(
            f"preset {domain.preset} of {domain.name} has none of the settings "
            f"{', '.join(wanted)}; name others with --vary, as in --vary setting=1,2,3: it has "
            f"{', '.join(domain.configuration) or 'none'}"
        )
    return found


def parse_variation(text: str) -> Variation:
    """The variation ``setting=value,value,...``.

    Raises:
        InvalidParameterError: Not of that form.
    """
    setting, _, rest = text.partition("=")
    values = tuple(value.strip() for value in rest.split(","))
    if not setting.strip() or not all(values):
        raise InvalidParameterError(
            f"{text!r} is not of the form setting=value,value,..., as in obstacles=1,2,3"
        )
    return Variation(setting.strip(), values)
