# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Operators from a file, checked as a model's are: PDDL, JSON, plain text."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from slap_ros.acquisition.proposals.complaints import Complaint, serious
from slap_ros.acquisition.proposals.drafts import check_operator
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.errors import InvalidParameterError, MalformedAnswerError, ProposalRejectedError
from slap_ros.files import parse_json, read_bytes
from slap_ros.language.formats import (
    LABELS,
    AtomDraft,
    OperatorDraft,
    ParameterDraft,
    parse_operator,
)
from slap_ros.relational import LiftedAtom, LiftedOperator
from slap_ros.relational.pddl import parse_domain
from slap_ros.relational.pddl.tokens import decode

_TITLE = re.compile(r"([A-Za-z][\w-]*)(\([^()]*\))?:?")  # Pick, Pick: or Pick(?peg):


def read_operators(path: Path, problem: AcquisitionProblem) -> tuple[LiftedOperator, ...]:
    """Read the operators of a file, each sound by itself.

    Args:
        path: Path of the file: a PDDL domain, the JSON of a proposal, or blocks of PAR, PRE, EFF-
            and EFF+, each below a line with the operator's name.
        problem: Problem whose predicates and types the operators use.

    Raises:
        InvalidParameterError: The file cannot be read.
        MalformedPddlError: It begins as PDDL and is none.
        MalformedAnswerError: It is none of the three.
        ProposalRejectedError: An operator is wrong by itself, with all complaints.
    """
    try:
        text = decode(read_bytes(path))
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidParameterError(f"cannot read {path}: {error}") from error
    operators: list[LiftedOperator] = []
    complaints: list[Complaint] = []
    for draft in _drafts(text, str(path)):
        operator, found = check_operator(draft, draft.name or "", problem)
        complaints += serious(found)
        operators += [operator] if operator is not None else []
    if complaints:
        raise ProposalRejectedError(f"{path}: {'; '.join(c.for_people for c in complaints)}")
    return tuple(operators)


def _drafts(text: str, source: str) -> list[OperatorDraft]:
    if re.match(r"\s*(;[^\n]*\n\s*)*\(\s*define", text):
        return [_draft(operator) for operator in parse_domain(text, source).operators]
    if text.lstrip().startswith("{"):
        return list(_from_json(text, source))
    drafts = list(_from_text(text, source))
    if not drafts:
        raise MalformedAnswerError(
            f"{source} has no operators: give a PDDL domain, the JSON of a proposal, or blocks of "
            "PAR, PRE, EFF- and EFF+, each below a line with the operator's name"
        )
    return drafts


def _from_json(text: str, source: str) -> Iterator[OperatorDraft]:
    try:
        entries = parse_json(text)["operators"]
        texts = [json.dumps(dict(entry)) for entry in entries]
    except (ValueError, KeyError, TypeError) as error:
        raise MalformedAnswerError(f"{source} is no proposal's JSON: {error!r}") from error
    for number, entry in enumerate(texts, start=1):
        yield _parse(entry, f"{source}, operator {number}")


def _from_text(text: str, source: str) -> Iterator[OperatorDraft]:
    blocks: list[tuple[str, list[str]]] = []
    for line in text.splitlines():
        title = _TITLE.fullmatch(line.strip())
        if title is not None and title.group(1) not in LABELS:
            blocks.append((title.group(1), []))
        elif blocks:
            blocks[-1][1].append(line)
    for name, lines in blocks:
        draft = _parse("\n".join(lines), f"{source}, {name}")
        yield OperatorDraft(
            name,
            draft.parameters,
            draft.preconditions,
            draft.delete_effects,
            draft.add_effects,
        )


def _parse(text: str, where: str) -> OperatorDraft:
    try:
        return parse_operator(text).draft
    except MalformedAnswerError as error:
        raise MalformedAnswerError(f"{where}: {error}") from error


def _draft(operator: LiftedOperator) -> OperatorDraft:
    """A draft with names alone: types and predicates of a PDDL file are not those of a world."""
    return OperatorDraft(
        operator.name,
        tuple(ParameterDraft(v.name, v.type.name) for v in operator.parameters),
        _atoms(operator.preconditions),
        _atoms(operator.delete_effects),
        _atoms(operator.add_effects),
        tuple((one.name, other.name) for one, other in operator.inequalities),
    )


def _atoms(atoms: Iterable[LiftedAtom]) -> tuple[AtomDraft, ...]:
    return tuple(
        AtomDraft(atom.predicate.name, tuple(v.name for v in atom.variables))
        for atom in sorted(atoms, key=str)
    )
