# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap domains``."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated, Any

import typer
from rich.table import Table

from slap_ros.api.command_options import Preset, matching_domains
from slap_ros.cli.console import console, print_json, print_result
from slap_ros.cli.options import Json
from slap_ros.core import Domain
from slap_ros.domains import domain_names, preset_names
from slap_ros.errors import InvalidDomainError, InvalidParameterError, UnknownObjectError
from slap_ros.relational import LiftedOperator, Metric, Predicate
from slap_ros.relational.metrics import typed_arguments, variable_names
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.skills.operator_json import metrics_of

GOAL_SEED = 0  # of the task in which named goals are shown


def domains(
    domain: Annotated[
        str | None,
        typer.Argument(
            help="Name of a domain to show in detail. Default: list all.",
            autocompletion=matching_domains,
        ),
    ] = None,
    preset: Preset = None,
    json: Json = False,
) -> None:
    """List the installed domains, or the predicates, metrics, goals and operators of one."""
    if domain is not None:
        one = open_domain(DomainChoice(domain, preset or ""))
        if json:
            print_json(_data(one))
        else:
            _show(one)
        return
    if preset is not None:
        raise InvalidParameterError("--preset is for one domain: slap domains DOMAIN --preset NAME")
    found = list(_available())
    if json:
        print_json([_data(one) for one in found])
        return
    table = Table("domain", "preset", "operators", "goals", "configuration")
    for one in found:
        table.add_row(
            one.name,
            one.preset,
            ", ".join(operator.name for operator in one.operators) or _by_hand(one),
            ", ".join(one.goals),
            _settings(one),
        )
    print_result(table)


def _available() -> Iterator[Domain]:
    """Every domain that can be made here; for the others, say why not."""
    for name in domain_names():
        try:
            yield from [open_domain(DomainChoice(name, preset)) for preset in preset_names(name)]
        except InvalidDomainError as error:
            console.print(str(error))


def _by_hand(domain: Domain) -> str:
    """The hand-written operators of a domain that has no skills."""
    names = [operator.name for operator in _hand_written(domain)]
    return f"hand-written, without skills: {', '.join(names)}" if names else "none"


def _hand_written(domain: Domain) -> tuple[LiftedOperator, ...]:
    return domain.acquisition.operators if domain.acquisition is not None else ()


def _settings(domain: Domain) -> str:
    return ", ".join(f"{key} {value}" for key, value in domain.configuration.items())


def _metrics(domain: Domain) -> tuple[Metric, ...]:
    """Those that predicates rest on, then the others."""
    return tuple(dict.fromkeys((*metrics_of(domain.predicates), *domain.metrics)))


def _goals(domain: Domain) -> dict[str, str]:
    """The goals by name, as the atoms that they are in the first task that has their objects."""
    shown = {}
    for name in domain.goals:
        try:
            atoms = domain.task(GOAL_SEED, goal=name).goal
        except UnknownObjectError as error:
            shown[name] = f"in no task of this preset: {error}"
        else:
            shown[name] = ", ".join(sorted(map(str, atoms)))
    return shown


# -- as data ---------------------------------------------------------------------------------------


def _data(domain: Domain) -> dict[str, Any]:
    acquisition = domain.acquisition
    return {
        "name": domain.name,
        "preset": domain.preset,
        "operators": [operator.name for operator in domain.operators],
        "predicates": [predicate.name for predicate in domain.predicates],
        "step_limit": domain.step_limit,
        "configuration": dict(domain.configuration),
        "types": [
            {"name": kind.name, "parent": None if kind.parent is None else kind.parent.name}
            for kind in domain.types
        ],
        "predicate_definitions": [_predicate_data(domain, p) for p in domain.predicates],
        "metrics": [_metric_data(metric) for metric in _metrics(domain)],
        "goals": _goals(domain),
        "hand_written_operators": [_operator_data(one) for one in _hand_written(domain)],
        "hand_written_rewards": {
            name: str(template) for name, template in acquisition.rewards.items()
        }
        if acquisition is not None
        else {},
        "demonstrator": sorted(acquisition.scripts) if acquisition is not None else [],
    }


def _predicate_data(domain: Domain, predicate: Predicate) -> dict[str, Any]:
    return {
        "name": predicate.name,
        "types": [kind.name for kind in predicate.types],
        "conditions": _conditions(predicate),
        "description": predicate.description,
        "static": predicate in domain.static_predicates,
        "margin": predicate.margin is not None,
    }


def _conditions(predicate: Predicate) -> list[str]:
    names = variable_names(predicate.types)
    return [condition.text(names) for condition in predicate.conditions]


def _metric_data(metric: Metric) -> dict[str, Any]:
    return {
        "name": metric.name,
        "types": [kind.name for kind in metric.types],
        "unit": metric.unit,
        "normalised": metric.form.formula,
        "description": metric.description,
    }


def _operator_data(operator: LiftedOperator) -> dict[str, Any]:
    return {
        "name": operator.name,
        "parameters": [f"{v.name}: {v.type.name}" for v in operator.parameters],
        "preconditions": _texts(operator.preconditions),
        "delete_effects": _texts(operator.delete_effects),
        "add_effects": _texts(operator.add_effects),
    }


def _texts(atoms: Iterable[object]) -> list[str]:
    return sorted(map(str, atoms))


# -- in words --------------------------------------------------------------------------------------


def _show(domain: Domain) -> None:
    """One domain in detail."""
    print_result(f"{domain.name}, preset {domain.preset}")
    if domain.configuration:
        print_result(f"  {_settings(domain)}")
    _list("goals, in the first task that has their objects", _goals(domain).items())
    _list("predicates", ((_signature(p), _meaning(domain, p)) for p in domain.predicates))
    _list("metrics", ((m.signature, _measure(m)) for m in _metrics(domain)))
    if domain.operators:
        _list("operators", ((str(one), "") for one in domain.operators))
    if by_hand := _hand_written(domain):
        rewards = domain.acquisition.rewards if domain.acquisition is not None else {}
        _list(
            "hand-written operators, for learning" if domain.operators else _by_hand_title(domain),
            ((str(one), _operator(one, str(rewards.get(one.name, "")))) for one in by_hand),
        )


def _by_hand_title(domain: Domain) -> str:
    shown = domain.acquisition is not None and domain.acquisition.scripts
    return (
        f"hand-written operators, without skills{'; a demonstrator has scripts' if shown else ''}"
    )


def _list(title: str, entries: Iterable[tuple[str, str]]) -> None:
    """A heading, and an entry with what there is to say of it in each paragraph."""
    listed = list(entries)
    print_result(f"\n{title}{'' if listed else ': none'}")
    for name, text in listed:
        print_result(f"  {name}")
        for line in filter(None, text.split("\n")):
            print_result(f"      {line}")


def _signature(predicate: Predicate) -> str:
    return f"{predicate.name}({typed_arguments(predicate.types)})"


def _meaning(domain: Domain, predicate: Predicate) -> str:
    notes = ["nothing changes it"] if predicate in domain.static_predicates else []
    conditions = " and ".join(_conditions(predicate))
    return "\n".join(filter(None, [predicate.description, conditions, *notes]))


def _measure(metric: Metric) -> str:
    return f"{metric.description} [{metric.unit}]\nin rewards: {metric.form.formula}"


def _operator(operator: LiftedOperator, reward: str) -> str:
    lines = [
        f"{label} {', '.join(_texts(atoms)) or '-'}"
        for label, atoms in (
            ("PRE ", operator.preconditions),
            ("EFF-", operator.delete_effects),
            ("EFF+", operator.add_effects),
        )
    ]
    if reward:
        lines.append(f"R    {reward}")
    return "\n".join(lines)
