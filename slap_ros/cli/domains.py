# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap domains``."""

from __future__ import annotations

from collections.abc import Iterator

from rich.table import Table

from slap_ros.cli.console import console, print_json
from slap_ros.cli.options import Json
from slap_ros.core import Domain
from slap_ros.domains import domain_names, get_domain, preset_names
from slap_ros.errors import InvalidDomainError


def _available() -> Iterator[Domain]:
    """Every domain that can be made here; for the others, say why not."""
    for name in domain_names():
        try:
            yield from [get_domain(name, preset) for preset in preset_names(name)]
        except InvalidDomainError as error:
            console.print(str(error))


def domains(json: Json = False) -> None:
    """List the domains that are installed."""
    found = list(_available())
    if json:
        print_json(
            [
                {
                    "name": domain.name,
                    "preset": domain.preset,
                    "operators": [operator.name for operator in domain.operators],
                    "predicates": [predicate.name for predicate in domain.predicates],
                    "step_limit": domain.step_limit,
                    "configuration": dict(domain.configuration),
                }
                for domain in found
            ]
        )
        return
    table = Table("domain", "preset", "operators", "configuration")
    for domain in found:
        settings = ", ".join(f"{key} {value}" for key, value in domain.configuration.items())
        table.add_row(
            domain.name, domain.preset, ", ".join(o.name for o in domain.operators), settings
        )
    console.print(table)
