# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What varies in a study: one setting of a domain's preset, which takes one value after another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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
        """For an axis, with the unit."""
        return LABELS.get(self.setting, self.setting.replace("_", " "))


# What SLAP Fig. 5 varies, by whatever name a domain has for it: fewer and more of each thing;
# half, the same, and twice the mass and friction that blocks have by default.
OBSTACLES = Variation("obstacles", ("1", "2", "3", "4", "5"))
DISTRACTORS = Variation("distractors", ("0", "1", "2", "3", "4"))
BYSTANDERS = Variation("bystanders", ("0", "1", "2"))  # a fourth block has hardly any room
MASS = Variation("mass", ("0.25", "0.5", "1.0"))
FRICTION = Variation("friction", ("0.45", "0.9", "1.8"))
USUAL = (OBSTACLES, DISTRACTORS, BYSTANDERS, MASS, FRICTION)
NUMBERS = (OBSTACLES, BYSTANDERS, DISTRACTORS)  # of objects; the one that makes tasks harder first
LABELS = {
    "obstacles": "obstacles",
    "distractors": "distractors",
    "bystanders": "bystanders",
    "mass": "mass of a block [kg]",
    "friction": "coefficient of friction",
}


def offered(domain: Domain, variations: Sequence[Variation] = USUAL) -> tuple[Variation, ...]:
    """Those whose setting the domain's preset has.

    Raises:
        InvalidParameterError: It has none of them.
    """
    found = tuple(one for one in variations if one.setting in domain.configuration)
    if not found:
        raise InvalidParameterError(
            f"preset {domain.preset} of {domain.name} has none of the settings "
            f"{', '.join(one.setting for one in variations)}; name others with --vary, as in "
            f"--vary setting=1,2,3: it has {', '.join(domain.configuration) or 'none'}"
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
