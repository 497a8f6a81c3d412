# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What models answer, parsed into drafts: JSON as the schemas have it, and the paper's plain texts.

A draft has names and numbers as they are written; whether they mean anything is checked elsewhere.
What does not parse is refused: nothing is guessed, completed or executed. What stands around an
answer (prose, code fences, a reasoning model's thoughts) is cut off and counted. Every step takes
time that is linear in the text's length.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice
from typing import Any, Generic, NoReturn, TypeVar

from slap_ros.errors import MalformedAnswerError

T = TypeVar("T")

MAX_ITEMS = 64  # atoms of a list, terms of a reward, actions of a decomposition
MAX_NAME = 64  # characters
THOUGHTS_END = "</think>"
OPERATOR_KEYS = ("name", "parameters", "preconditions", "delete_effects", "add_effects")
LABELS = ("PAR", "PRE", "EFF-", "EFF+")
NOTHING = frozenset({"", "none", "∅"})

_JSON_START = re.compile(r'\{\s*"')  # empty braces are the plain text's
_LABEL = re.compile(r"\b(PAR|PRE|EFF ?[-−–⁻+⁺])[*_`]{0,3} ?[:=][*_`]{0,3}")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")
_LIST = re.compile(r"\[[^\[\]]*\]")
_SEPARATOR = re.compile(r"[(),;\n]")


@dataclass(frozen=True)
class ParameterDraft:
    """A variable as it is written, with its type where one stands beside it."""

    name: str
    type: str | None = None


@dataclass(frozen=True)
class AtomDraft:
    """A predicate or an action with arguments, as it is written."""

    name: str
    arguments: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.name}({', '.join(self.arguments)})"


@dataclass(frozen=True)
class ActionDraft:
    """An action of a decomposition."""

    name: str
    parameters: tuple[ParameterDraft, ...]

    def __str__(self) -> str:
        return f"{self.name}({', '.join(p.name for p in self.parameters)})"


@dataclass(frozen=True)
class OperatorDraft:
    """An operator; the paper's block of plain text does not name it."""

    name: str | None
    parameters: tuple[ParameterDraft, ...]
    preconditions: tuple[AtomDraft, ...]
    delete_effects: tuple[AtomDraft, ...]
    add_effects: tuple[AtomDraft, ...]
    inequalities: tuple[tuple[str, str], ...] = ()  # parameters that must differ; PDDL says so


@dataclass(frozen=True)
class TermDraft:
    """A metric with its weight; without arguments where none are written."""

    metric: str
    arguments: tuple[str, ...] | None
    weight: float


@dataclass(frozen=True)
class RewardDraft:
    """The terms of a dense reward."""

    terms: tuple[TermDraft, ...]


@dataclass(frozen=True)
class Parsed(Generic[T]):
    """A draft, and how many characters around it were cut off, white space apart."""

    draft: T
    cut: int


def parse_decomposition(text: str) -> Parsed[tuple[ActionDraft, ...]]:
    """The actions that a task is made of: JSON, or ``[Pick(?peg), Insert(?peg, ?hole)]``.

    Raises:
        MalformedAnswerError: Neither of them.
    """
    return _parse(text, _decomposition_from_json, _decomposition_from_text)


def parse_operator(text: str) -> Parsed[OperatorDraft]:
    """An operator: JSON, or the block of PAR, PRE, EFF- and EFF+.

    Raises:
        MalformedAnswerError: Neither of them.
    """
    return _parse(text, _operator_from_json, _operator_from_text)


def parse_rewards(text: str) -> Parsed[RewardDraft]:
    """A reward: JSON (terms, or metrics with weights), or ``0.2 * xy_dis(?peg) + ...``.

    Raises:
        MalformedAnswerError: Neither of them.
    """
    return _parse(text, _rewards_from_json, _rewards_from_text)


def parse_plan(text: str) -> Parsed[tuple[AtomDraft, ...]]:
    """A plan with objects' names: JSON, or ``[Pick(peg1), Insert(peg1, hole1)]``.

    Raises:
        MalformedAnswerError: Neither of them.
    """
    return _parse(text, _plan_from_json, _plan_from_text)


# -- where the answer is --------------------------------------------------------------------------


def _parse(
    text: str, from_json: Callable[[dict[str, Any]], T], from_text: Callable[[str], tuple[T, int]]
) -> Parsed[T]:
    """A draft from the one JSON object in a text; where there is none, from plain text."""
    answer = text.rpartition(THOUGHTS_END)[2]
    whole = _length(text)
    found = _json_object(answer)
    if found is not None:
        entry, begin, end = found
        return Parsed(from_json(entry), whole - _length(answer[begin:end]))
    if not answer.strip():
        _refuse("the answer is empty")
    draft, used = from_text(answer)
    return Parsed(draft, whole - used)


def _json_object(text: str) -> tuple[dict[str, Any], int, int] | None:
    """The only JSON object of a text, and where it stands."""
    match = _JSON_START.search(text)
    if match is None:
        return None
    decoder = json.JSONDecoder(object_pairs_hook=_without_repetition)
    try:
        entry, end = decoder.raw_decode(text, match.start())
    except json.JSONDecodeError as error:
        _refuse(f"the JSON object is not complete or not correct: {error}")
    except RecursionError:
        _refuse("the JSON object is nested too deeply")
    except ValueError as error:  # a number of thousands of digits
        _refuse(f"the JSON object cannot be read: {error}")
    if _JSON_START.search(text, end):
        _refuse("the answer has more than one JSON object")
    return entry, match.start(), end


def _without_repetition(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    entries = dict(pairs)
    if len(entries) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        _refuse(f"the JSON object has {shown(twice)} twice")
    return entries


def shown(text: object, length: int = MAX_NAME) -> str:
    """Something that a model wrote, for messages: in quotes, escaped, short."""
    written = repr(text if isinstance(text, str) else str(text))
    return written if len(written) <= length else f"{written[:length]}…"


def _refuse(words: str) -> NoReturn:
    raise MalformedAnswerError(words)


def _length(text: str) -> int:
    """Characters, white space apart."""
    return sum(map(len, text.split()))


# -- JSON -----------------------------------------------------------------------------------------


def _decomposition_from_json(entry: dict[str, Any]) -> tuple[ActionDraft, ...]:
    _expect_keys(entry, ("actions",), "the answer")
    drafts = []
    for action in _list(entry["actions"], "actions"):
        _expect_keys(action, ("name", "parameters"), "an action")
        drafts.append(ActionDraft(_name(action["name"]), _parameters(action["parameters"])))
    return tuple(drafts)


def _operator_from_json(entry: dict[str, Any]) -> OperatorDraft:
    _expect_keys(entry, OPERATOR_KEYS, "the operator")
    return OperatorDraft(
        _name(entry["name"]),
        _parameters(entry["parameters"]),
        _atoms(entry["preconditions"], "preconditions"),
        _atoms(entry["delete_effects"], "delete_effects"),
        _atoms(entry["add_effects"], "add_effects"),
    )


def _rewards_from_json(entry: dict[str, Any]) -> RewardDraft:
    if "terms" not in entry:
        if any(isinstance(value, dict | list) for value in entry.values()) or not entry:
            _refuse('the answer has no list "terms"')
        return RewardDraft(tuple(_named_term(key, entry[key]) for key in _few(entry, "terms")))
    _expect_keys(entry, ("terms",), "the answer")
    terms = []
    for term in _list(entry["terms"], "terms"):
        _expect_keys(term, ("metric", "arguments", "weight"), "a term")
        arguments = tuple(_word(word) for word in _list(term["arguments"], "arguments"))
        terms.append(TermDraft(_name(term["metric"]), arguments, _weight(term["weight"])))
    return RewardDraft(tuple(terms))


def _named_term(key: str, weight: Any) -> TermDraft:
    """A term of the paper's dictionary, the arguments in the key where there are any."""
    if "(" not in key:
        return TermDraft(_name(key), None, _weight(weight))
    atom = _atom(key)
    return TermDraft(atom.name, atom.arguments, _weight(weight))


def _plan_from_json(entry: dict[str, Any]) -> tuple[AtomDraft, ...]:
    _expect_keys(entry, ("plan",), "the answer")
    drafts = []
    for step in _list(entry["plan"], "plan"):
        _expect_keys(step, ("action", "objects"), "a step")
        objects = tuple(_word(word) for word in _list(step["objects"], "objects"))
        drafts.append(AtomDraft(_name(step["action"]), objects))
    return tuple(drafts)


def _parameters(value: Any) -> tuple[ParameterDraft, ...]:
    drafts = []
    for entry in _list(value, "parameters"):
        _expect_keys(entry, ("name", "type"), "a parameter")
        drafts.append(ParameterDraft(_word(entry["name"]), _word(entry["type"])))
    return tuple(drafts)


def _atoms(value: Any, where: str) -> tuple[AtomDraft, ...]:
    drafts = []
    for entry in _list(value, where):
        _expect_keys(entry, ("predicate", "arguments"), f"an atom of {where}")
        arguments = tuple(_word(word) for word in _list(entry["arguments"], "arguments"))
        drafts.append(AtomDraft(_name(entry["predicate"]), arguments))
    return tuple(drafts)


def _expect_keys(value: Any, keys: tuple[str, ...], what: str) -> None:
    if not isinstance(value, dict):
        _refuse(f"{what} is {shown(value)}, not a JSON object with {', '.join(keys)}")
    missing = [key for key in keys if key not in value]
    more = [key for key in value if key not in keys]
    if missing:
        _refuse(
            f"{what} has no {', '.join(missing)}; it has {shown(', '.join(value)) or 'nothing'}"
        )
    if more:
        _refuse(f"{what} has {shown(more[0])}; it has {', '.join(keys)} and nothing else")


def _list(value: Any, where: str) -> list[Any]:
    if not isinstance(value, list):
        _refuse(f"{where} is {shown(value)}, not a list")
    _few(value, where)
    return value


def _few(items: Any, where: str) -> Any:
    if len(items) > MAX_ITEMS:
        _refuse(f"{where} has {len(items)} items; {MAX_ITEMS} are the most")
    return items


def _word(value: Any) -> str:
    if not isinstance(value, str) or not value.strip():
        _refuse(f"{shown(value)} stands where a name or a variable should be")
    return value.strip()


def _name(value: Any) -> str:
    word = _word(value)
    if len(word) > MAX_NAME or not _NAME.fullmatch(word):
        if word.lower().startswith(("not ", "not(", "¬", "!", "~")):
            _refuse(
                f"{shown(word)} is a negation, which there is none of; use a predicate that says it"
            )
        _refuse(f"{shown(word)} is no name: letters, digits, '-' and '_' make one")
    return word


def _weight(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        _refuse(f"the weight {shown(value)} is no number")
    try:
        return float(value)
    except OverflowError:
        return float("inf")


# -- plain text -----------------------------------------------------------------------------------


def _decomposition_from_text(text: str) -> tuple[tuple[ActionDraft, ...], int]:
    atoms, used = _bracketed_list(text)
    parameters = (tuple(_parameter(word) for word in atom.arguments) for atom in atoms)
    drafts = (ActionDraft(a.name, p) for a, p in zip(atoms, parameters, strict=True))
    return tuple(drafts), used


def _plan_from_text(text: str) -> tuple[tuple[AtomDraft, ...], int]:
    return _bracketed_list(text)


def _bracketed_list(text: str) -> tuple[tuple[AtomDraft, ...], int]:
    """The only list of actions in brackets, and its length."""
    lists = [
        m.group() for m in _LIST.finditer(text) if "(" in m.group() or not m.group()[1:-1].strip()
    ]
    if len(lists) != 1:
        _refuse(
            f"the answer has {len(lists) or 'no'} lists of actions in brackets"
            + (" and no JSON object" if not lists else "; one is wanted")
        )
    return tuple(map(_atom, _items(lists[0][1:-1]))), _length(lists[0])


def _operator_from_text(text: str) -> tuple[OperatorDraft, int]:
    matches = list(islice(_LABEL.finditer(text), MAX_ITEMS))
    names = [_plain_label(match.group(1)) for match in matches]
    for label in LABELS:
        if names.count(label) != 1:
            count = names.count(label) or "no"
            _refuse(
                f"the answer has no JSON object, and {count} part {label}"
                if count == "no"
                else f"the answer has {count} parts {label}; one operator is wanted"
            )
    ends = [match.start() for match in matches[1:]] + [len(text)]
    parts, used = {}, 0
    for name, match, end in zip(names, matches, ends, strict=True):
        content = _section(text[match.end() : end])
        parts[name] = _items(content)
        used += _length(match.group()) + _length(content)
    return (
        OperatorDraft(
            None,
            tuple(map(_parameter, parts["PAR"])),
            tuple(map(_atom, parts["PRE"])),
            tuple(map(_atom, parts["EFF-"])),
            tuple(map(_atom, parts["EFF+"])),
        ),
        used,
    )


def _plain_label(label: str) -> str:
    """EFF- and EFF+, whichever of the many minus and plus signs was used."""
    if label.startswith("EFF"):
        return "EFF+" if label[-1] in "+⁺" else "EFF-"
    return label


def _section(text: str) -> str:
    """What belongs to a label: what is in braces, or the rest of the line."""
    content = text.strip()
    for opening, closing in ("{}", "[]"):
        if content.startswith(opening):
            end = content.find(closing)
            if end < 0:
                _refuse(f"a {opening!r} is never closed")
            return content[1:end]
    return content.partition("\n")[0].rstrip(" .;`*")


def _rewards_from_text(text: str) -> tuple[RewardDraft, int]:
    sums = [line for line in text.splitlines() if "*" in line and "(" in line]
    if len(sums) != 1:
        _refuse(
            "the answer has no JSON object"
            + (f", and {len(sums)} sums of weighted metrics; one is wanted" if sums else "")
        )
    terms = []
    for part in _few(sums[0].rpartition("=")[2].split("+"), "the sum"):
        weight, star, metric = part.partition("*")
        if not star:
            _refuse(f"{shown(part.strip())} is no weight times a metric")
        atom = _atom(metric.strip(" `*."))
        terms.append(TermDraft(atom.name, atom.arguments, _written_weight(weight)))
    return RewardDraft(tuple(terms)), _length(sums[0])


def _written_weight(text: str) -> float:
    try:
        return float(text.strip(" `"))
    except ValueError:
        _refuse(f"the weight {shown(text.strip())} is no number")


def _items(text: str) -> list[str]:
    """The items of a list, apart at commas, semicolons and line ends outside parentheses."""
    if text.strip().lower() in NOTHING:
        return []
    items, begin, depth = [], 0, 0
    for match in _SEPARATOR.finditer(text):
        sign = match.group()
        depth += (sign == "(") - (sign == ")")
        if not 0 <= depth <= 1:
            _refuse("parentheses do not match")
        if depth == 0 and sign not in "()":
            items.append(text[begin : match.start()].strip())
            begin = match.end()
            _few(items, "a list")
    if depth:
        _refuse("parentheses do not match")
    items.append(text[begin:].strip())
    return [item for item in items if item]


def _atom(text: str) -> AtomDraft:
    name, opened, rest = text.partition("(")
    if not opened:
        return AtomDraft(_name(name), ())
    if not rest.rstrip().endswith(")"):
        _refuse(f"{shown(text)} does not end with a parenthesis")
    inner = rest.rstrip()[:-1]
    if "(" in inner or ")" in inner:
        _refuse(f"{shown(text)} has parentheses within parentheses")
    words = inner.split(",") if inner.strip() else []
    return AtomDraft(_name(name), tuple(_word(word) for word in words))


def _parameter(text: str) -> ParameterDraft:
    for separator in (":", " - "):
        name, found, kind = text.partition(separator)
        if found:
            return ParameterDraft(_word(name), _name(kind))
    return ParameterDraft(_word(text))
