# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A proposal from question to plan, as the example's cassette has it."""

from __future__ import annotations

import json
import textwrap
from pathlib import Path

from slap_ros.acquisition.proposals.attempt_log import AttemptLog, Entry
from slap_ros.acquisition.proposals.inquiry import Inquiry
from slap_ros.acquisition.proposals.language_proposer import LanguageProposer
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.drawing.layout import Area
from slap_ros.drawing.palette import BACKGROUND, BORDER, CARD, INK, MUTED
from slap_ros.drawing.svg import SvgPicture, SvgRectangle, SvgShape, SvgText
from slap_ros.language.budget import Budget, BudgetLimits
from slap_ros.language.cassette import Cassette, ReplayingClient, read_cassette, with_recorded
from slap_ros.language.settings import LanguageSettings
from slap_ros.relational.pddl import parse_domain, parse_problem
from tools.imports import ROOT

EXAMPLE = ROOT / "examples" / "peg_in_hole"
TITLE = "A proposal: question, answer, complaint, better answer, plan"
WIDTH_PX, MARGIN_PX, PADDING_PX, GAP_PX = 840.0, 16.0, 12.0, 22.0
SIZE_PX, LINE_PX, COLUMNS = 12.0, 17.0, 112  # of text; characters of a line
LEFT_OUT = "… types, predicates, eight rules …"  # of the question
NAMED_LINES = 3  # at its end: the goal, all skills, the skill
ASKED = "operator Insert"
TINTS = {"complaint": "#fdeeee", "plan": "#eef8ee"}


def make(path: Path) -> None:
    """Replay the example and draw what was said."""
    path.write_text(draw() + "\n", encoding="utf-8")


def draw() -> str:
    """The picture as SVG."""
    cassette = read_cassette(EXAMPLE / "scripted.jsonl")
    cards = tell(cassette, replay(cassette))
    shapes: list[SvgShape] = []
    top = MARGIN_PX
    for i, (heading, kind, lines) in enumerate(cards):
        height = 2 * PADDING_PX + LINE_PX * (len(lines) + 1)
        area = Area(MARGIN_PX, top, WIDTH_PX - 2 * MARGIN_PX, height)
        shapes += _card(area, heading, lines, TINTS.get(kind, CARD))
        top = area.bottom + GAP_PX
        if i + 1 < len(cards):
            shapes.append(_arrow(area.bottom))
    description = " ".join(f"{heading}: {' '.join(lines)}" for heading, _, lines in cards)
    height = top - GAP_PX + MARGIN_PX
    return SvgPicture(WIDTH_PX, height, TITLE, description, BACKGROUND, shapes).markup()


def replay(cassette: Cassette) -> list[Entry]:
    """The log of the example."""
    domain = parse_domain((EXAMPLE / "domain.pddl").read_text(encoding="utf-8"))
    task = parse_problem((EXAMPLE / "problem.pddl").read_text(encoding="utf-8"), domain)
    client = ReplayingClient(cassette)
    settings, log = with_recorded(LanguageSettings(), client), AttemptLog()
    inquiry = Inquiry(client, settings, Budget(BudgetLimits()), log)
    LanguageProposer(inquiry).operators(AcquisitionProblem.of_pddl(domain, task))
    return log.entries


def tell(cassette: Cassette, entries: list[Entry]) -> list[tuple[str, str, list[str]]]:
    """Headings, kinds and lines of the cards."""
    answers = [e for e in entries if e.get("subject") == ASKED]
    verdicts = [e for e in entries if e["event"] == "verification"]
    digests = {e.request.digest: e.request for e in cassette.exchanges}
    question = digests[answers[0]["request"]].messages[-1].content
    asked = question.splitlines()
    told = digests[answers[1]["request"]].messages[-1].content.splitlines()[1]
    return [
        ("Question", "question", [*_wrapped(asked[0]), LEFT_OUT, *asked[-NAMED_LINES:]]),
        ("Answer, as the paper prints it", "answer", _operator(answers[0]["answer"])),
        ("Complaint", "complaint", _wrapped(told.removeprefix("- "))),
        ("Better answer", "answer", _operator(answers[1]["answer"])),
        ("Plan", "plan", [", ".join(verdicts[-1]["plan"])]),
    ]


def _operator(answer: str) -> list[str]:
    data = json.loads(answer)

    def atoms(part: str) -> str:
        return ", ".join(f"{a['predicate']}({', '.join(a['arguments'])})" for a in data[part])

    return [
        f"PRE   {atoms('preconditions')}",
        f"EFF-  {atoms('delete_effects')}",
        f"EFF+  {atoms('add_effects')}",
    ]


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, COLUMNS)


def _card(area: Area, heading: str, lines: list[str], fill: str) -> list[SvgShape]:
    x, y = area.x + PADDING_PX, area.y + PADDING_PX + SIZE_PX
    shapes: list[SvgShape] = [SvgRectangle(area, fill, BORDER)]
    shapes.append(SvgText(x, y, heading, SIZE_PX, MUTED, bold=True))
    shapes += [SvgText(x, y + LINE_PX * (i + 1), t, SIZE_PX, INK) for i, t in enumerate(lines)]
    return shapes


def _arrow(y: float) -> SvgShape:
    """From one card to the next."""
    return SvgText(WIDTH_PX / 2, y + GAP_PX * 0.75, "↓", SIZE_PX + 2, MUTED, centred=True)
