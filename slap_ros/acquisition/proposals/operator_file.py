# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Operators from a file, checked as a model's are: PDDL, JSON, what is printed, plain text."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from slap_ros.acquisition.proposals.complaints import Complaint, serious
from slap_ros.acquisition.proposals.drafts import check_operator
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.errors import InvalidParameterError, MalformedAnswerError, ProposalRejectedError
from slap_ros.files import parse_json, read_bytes, reason_of
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

_TITLE = re.compile(r"([A-Za-z][\w-]*)(?:\(([^()]*)\))?:?")  # Pick, Pick: or Pick(?peg):
_PRINTED = re.compile(r"\s*(PRE|EFF-|EFF\+) +(?![:=])(.*)")  # a line of `slap propose`
_DIFFERENT = re.compile(r",? *(\?[\w-]+) != (\?[\w-]+)")


def read_operators(path: Path, problem: AcquisitionProblem) -> tuple[LiftedOperator, ...]:
    """Read the operators of a file, each sound by itself.

    Args:
        path: Path of the file: a PDDL domain, the JSON of a proposal, what ``slap propose`` prints,
            or blocks of PAR, PRE, EFF- and EFF+, each below a line with the operator's name.
        problem: Problem whose predicates and types the operators use.

    Raises:
        InvalidParameterError: The file cannot be read.
        MalformedPddlError: It begins as PDDL and is none.
        MalformedAnswerError: It is none of them.
        ProposalRejectedError: An operator is wrong by itself, with all complaints.
    """
    try:
        text = decode(read_bytes(path))
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidParameterError(f"cannot read {path}: {reason_of(error)}") from error
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
    if re.match(r"\s*(;[^\n]*\n\s*)*\(\s*define", text, re.IGNORECASE):
        return [_draft(operator) for operator in parse_domain(text, source).operators]
    if text.lstrip().startswith("{"):
        return list(_from_json(text, source))
    drafts = list(_from_text(text, source))
    if not drafts:
        raise MalformedAnswerError(
            f"{source} has no operators: give a PDDL domain, the JSON of a proposal, what `slap "
            "propose` prints, or blocks of PAR, PRE, EFF- and EFF+, each below a line with the "
            "operator's name"
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
    blocks: list[tuple[re.Match[str], list[str]]] = []
    for line in text.splitlines():
        title = _TITLE.fullmatch(line.strip())
        if title is not None and title.group(1) not in LABELS:
            blocks.append((title, []))
        elif blocks:
            blocks[-1][1].append(line)
    for title, lines in blocks:
        block = _block(title.group(2) or "", lines)
        draft = _parse(_DIFFERENT.sub("", block), f"{source}, {title.group(1)}")
        yield replace(draft, name=title.group(1), inequalities=tuple(_DIFFERENT.findall(block)))


def _block(parameters: str, lines: Sequence[str]) -> str:
    """The text of one operator; where it was printed, the title has its parameters.

    Args:
        parameters: Parameters in the title.
        lines: Lines below the title.
    """
    printed = [part.groups() for line in lines if (part := _PRINTED.fullmatch(line))]
    if not printed:
        return "\n".join(lines)
    parts = [
        ("PAR", parameters),
        *((label, "" if atoms == "-" else atoms) for label, atoms in printed),
    ]
    return "\n".join(f"{label}: {{{content}}}" for label, content in parts)


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
