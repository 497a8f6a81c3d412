# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A person carries questions to a model and answers back: by files, or on a terminal."""

import io
import json
from pathlib import Path

import pytest

from slap_ros.errors import ErrorCode, InvalidParameterError, LanguageUnavailableError
from slap_ros.language.asking import MAX_LINE, AskingClient, FolderChannel, TerminalChannel
from slap_ros.language.cassette import read_cassette
from slap_ros.language.prompts import SYSTEM, conversation
from slap_ros.language.request import Request
from slap_ros.language.schema import decomposition_schema
from slap_ros.language.settings import LanguageSettings
from support.slap_command import slap

EXAMPLE = Path(__file__).parents[2] / "examples" / "peg_in_hole"
TASK = [str(EXAMPLE / "domain.pddl"), str(EXAMPLE / "problem.pddl")]
REPLIES = [one.reply.text for one in read_cassette(EXAMPLE / "scripted.jsonl").exchanges]
NAME = "A chat, seen in November"


def propose(folder, *options, model=f"ask:{NAME}"):
    arguments = ["propose", *TASK, "--proposer", "language", "--model", model]
    arguments += ["--base-url", f"folder:{folder}"] if folder else []
    result = slap(*arguments, *options)
    return result.exit_code, result.stdout, " ".join(result.stderr.split())


def answer_all(folder):
    folder.mkdir()
    for number, text in enumerate(REPLIES, start=1):
        around = f"Of course! Here it is:\n```json\n{text}\n```\n"  # as chats have it
        (folder / f"{number:03}-answer.md").write_text(around)


def test_answers_in_files_make_a_proposal_and_a_recording(tmp_path):
    folder, cassette = tmp_path / "chat", tmp_path / "asked.jsonl"
    answer_all(folder)
    code, told, said = propose(folder, "--json", "--cassette", f"record:{cassette}")
    assert code == 0, said
    proposal = json.loads(told)["proposal"]
    assert len(proposal["plan"]) == 4
    assert proposal["provenance"]["source"] == f"{NAME}, asked by hand"
    recorded = read_cassette(cassette)
    assert {one.reply.model for one in recorded.exchanges} == {NAME}
    again = propose(None, "--json", "--cassette", f"replay:{cassette}")
    assert json.loads(again[1])["proposal"]["plan"] == proposal["plan"]


def test_each_question_can_be_put_to_a_new_chat(tmp_path):
    folder = tmp_path / "chat"
    answer_all(folder)
    assert propose(folder)[0] == 0
    questions = [path.read_text() for path in sorted(folder.glob("*-question.md"))]
    assert len(questions) == len(REPLIES)
    assert all(text.startswith(SYSTEM) for text in questions)
    (repeated,) = (text for text in questions if "cannot be used" in text)
    rejected, complaint = "Your answer was:", "HandEmpty is deleted by Pick and never added again"
    assert repeated.index("Describe one skill") < repeated.index(rejected)
    assert repeated.index(rejected) < repeated.index(complaint)


def test_a_conversation_goes_on_where_it_was_left_and_not_elsewhere(tmp_path):
    client = AskingClient(LanguageSettings("ask"), FolderChannel(tmp_path, print))
    request = Request("ask", conversation("What?"), decomposition_schema([]))
    (tmp_path / "001-answer.md").write_text("this")
    assert client.complete(request, 0.0).text == "this"
    again = AskingClient(LanguageSettings("ask"), FolderChannel(tmp_path, print))
    assert again.complete(request, 0.0).text == "this"
    other = Request("ask", conversation("What else?"), decomposition_schema([]))
    third = AskingClient(LanguageSettings("ask"), FolderChannel(tmp_path, print))
    with pytest.raises(InvalidParameterError, match="another conversation's"):
        third.complete(other, 0.0)


def test_what_is_pasted_ends_with_a_dot(tmp_path):
    file = tmp_path / "answer.txt"
    file.write_text("from a file")
    typed = f"one\n\ntwo\n.\n@{tmp_path}/none\n@{file}\n{'x' * MAX_LINE}\n.\nshort\n.\n"
    told, copied = [], []
    channel = TerminalChannel(
        io.StringIO(typed), told.append, lambda text: bool(copied.append(text))
    )
    assert channel.answer(1, "first?") == "one\n\ntwo\n"
    assert channel.answer(2, "second?") == "from a file"
    assert "cannot read" in told[-1]
    assert channel.answer(3, "third?") == "short\n"
    assert "too long for a terminal" in told[-1]
    assert copied == ["first?", "second?", "third?"]
    with pytest.raises(LanguageUnavailableError, match="no answer was given"):
        channel.answer(4, "fourth?")


def test_without_a_terminal_and_without_files_it_is_refused():
    code, _, said = propose(None)
    assert code == ErrorCode.LANGUAGE_UNAVAILABLE
    assert "no terminal to paste answers into; give --base-url folder:PATH" in said


def test_a_folder_is_for_what_is_asked_by_hand(tmp_path):
    code, _, said = propose(tmp_path, model="some-model")
    assert code == ErrorCode.INVALID_PARAMETER
    assert "is for --model ask:NAME" in said
