# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings repeat runs to the byte and never call; keys are nowhere."""

from __future__ import annotations

import builtins
import json
import logging
import sys
import traceback
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from slap_ros.errors import (
    CassetteMissError,
    ErrorCode,
    InvalidCassetteError,
    InvalidParameterError,
    LanguageOffError,
    LanguageUnavailableError,
)
from slap_ros.language.budget import BudgetLimits
from slap_ros.language.cassette import open_client, read_cassette
from slap_ros.language.client import OpenAIClient
from slap_ros.language.settings import LanguageSettings, read_settings
from support.model_answers import LIMITS, SETTINGS, good_script, operator_json, run
from support.paper_problems import peg_in_hole, printed_insert
from support.scripted_server import Step, serving

PEGS = peg_in_hole()
GOOD = operator_json(PEGS.operators[1])
KEY = "sk-secret-0123456789abcdef"
NOWHERE = "http://127.0.0.1:9/v1"


@pytest.fixture
def cassette(tmp_path: Path) -> Path:
    """A recording with a complaint in it."""
    path = tmp_path / "pegs.jsonl"
    script = good_script(PEGS, Insert=[operator_json(printed_insert()), GOOD])
    with serving(script) as server:
        outcome = run(
            PEGS, server.url, f"record:{path}", log=tmp_path / "recorded.log", rewards=True
        )
    assert outcome.proposal is not None
    (tmp_path / "proposal.json").write_text(outcome.proposal.to_json())
    return path


def test_fifty_replays_give_the_same_bytes_without_the_package(
    cassette: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = builtins.__import__

    def refuse(name: str, *args: Any, **kwargs: Any) -> Any:
        assert name.partition(".")[0] not in ("openai", "httpx", "httpx2"), name
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", refuse)
    monkeypatch.setitem(sys.modules, "openai", None)
    recorded = (tmp_path / "proposal.json").read_text()
    log = tmp_path / "replayed.log"
    for _ in range(50):
        outcome = run(PEGS, NOWHERE, f"replay:{cassette}", log=log, rewards=True)
        assert outcome.proposal is not None, outcome.error
        assert outcome.proposal.to_json() == recorded
    assert log.read_bytes() == (tmp_path / "recorded.log").read_bytes()


def test_replay_takes_the_model_from_the_recording(cassette: Path) -> None:
    unnamed = replace(SETTINGS, model="")
    outcome = run(PEGS, NOWHERE, f"replay:{cassette}", settings=unnamed, rewards=True)
    assert outcome.proposal is not None
    assert outcome.proposal.provenance.model == "scripted"


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"model": "another"}, "the model: recorded 'scripted', asked 'another'"),
        ({"sampling": {"temperature": 1}}, "sampling: recorded {}, asked {'temperature': 1}"),
    ],
)
def test_a_miss_says_where_it_differs(
    cassette: Path, changes: Mapping[str, Any], where: str
) -> None:
    outcome = run(PEGS, NOWHERE, f"replay:{cassette}", replace(SETTINGS, **changes))
    assert isinstance(outcome.error, CassetteMissError)
    assert where in str(outcome.error)
    assert outcome.log.entries[-1]["error"] == ErrorCode.CASSETTE_MISS.name


def test_a_miss_in_the_question_shows_both_texts(cassette: Path) -> None:
    other = replace(PEGS, problem=PEGS.with_goal("test2"))
    outcome = run(other, NOWHERE, f"replay:{cassette}")
    assert isinstance(outcome.error, CassetteMissError)
    assert "the nearest is exchange 1, which differs in message 2 at character" in str(
        outcome.error
    )
    assert "asked" in str(outcome.error) and "In(peg1, hole2)" in str(outcome.error)


def test_a_request_that_was_recorded_once_is_answered_once(cassette: Path) -> None:
    client = open_client(f"replay:{cassette}", SETTINGS)
    exchange = read_cassette(cassette).exchanges[0]
    assert client.complete(exchange.request, 1.0) == exchange.reply
    with pytest.raises(CassetteMissError, match="recorded 1 times and is asked once more"):
        client.complete(exchange.request, 1.0)


def test_off_refuses_every_call() -> None:
    outcome = run(PEGS, NOWHERE, "off")
    assert isinstance(outcome.error, LanguageOffError)
    assert outcome.budget.attempts == 0


def test_a_recording_says_what_answered(cassette: Path) -> None:
    recording = read_cassette(cassette)
    assert recording.source.startswith("http://127.0.0.1")
    assert not recording.from_a_model  # the server says that it is scripted


def spoil(cassette: Path, number: int, old: str, new: str) -> None:
    lines = cassette.read_text().splitlines()
    assert old in lines[number]
    lines[number] = lines[number].replace(old, new, 1)
    cassette.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize(
    ("number", "old", "new", "words"),
    [
        (0, "slap_ros", "other", "is no recording"),
        (0, '"version": 1', '"version": 2', "version 2"),
        (1, "A robot with one gripper", "A robot", "not as it was recorded"),
        (1, '"reply"', '"answer"', "no exchange"),
        (1, '"prompt_tokens": 100', '"prompt_tokens": "many"', "prompt_tokens of the reply"),
        (1, '"degree": "json_schema"', '"degree": "telepathy"', "no exchange"),
        (2, "}", "", "not as it was recorded"),  # within the answer
        (2, '{"', '"', "no JSON"),
    ],
)
def test_damaged_recordings_are_refused(
    cassette: Path, number: int, old: str, new: str, words: str
) -> None:
    spoil(cassette, number, old, new)
    with pytest.raises(InvalidCassetteError, match=words):
        read_cassette(cassette)


def test_a_recording_is_never_added_to_or_made_up(cassette: Path, tmp_path: Path) -> None:
    before = cassette.read_bytes()
    assert isinstance(run(PEGS, NOWHERE, f"record:{cassette}").error, InvalidCassetteError)
    assert cassette.read_bytes() == before
    missing = run(PEGS, NOWHERE, f"replay:{tmp_path / 'none.jsonl'}")
    assert isinstance(missing.error, InvalidCassetteError)
    assert isinstance(run(PEGS, NOWHERE, "play").error, InvalidParameterError)


# -- keys ------------------------------------------------------------------------------------------

ECHO = f"Incorrect API key provided: {KEY}. Your header was 'Bearer {KEY}'."
INDISCREET = [
    [Step(status=401, error=ECHO)],
    [Step(status=500, error=ECHO)],
    [Step(status=400, error=ECHO)],
    [Step(ECHO), Step(json.dumps({"name": KEY})), Step(GOOD)],
    [Step(text=None, refusal=ECHO), Step(GOOD)],
    [Step(raw=ECHO.encode()), Step(GOOD)],
]


@pytest.mark.parametrize("steps", INDISCREET, ids=range(len(INDISCREET)))
def test_the_key_is_nowhere(
    steps: list[Step],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", KEY)
    caplog.set_level(logging.DEBUG)
    path, log = tmp_path / "cassette.jsonl", tmp_path / "attempts.jsonl"
    with serving(good_script(PEGS, Insert=steps)) as server:
        outcome = run(PEGS, server.url, f"record:{path}", log=log)
    sent = {name.lower(): value for name, value in server.headers[0].items()}
    assert sent["authorization"] == f"Bearer {KEY}"  # it does go where it belongs
    texts = [file.read_text() for file in tmp_path.iterdir()]
    texts += [caplog.text, *capsys.readouterr(), json.dumps(outcome.log.entries)]
    if outcome.error is not None:
        texts += ["".join(traceback.format_exception(outcome.error)), repr(outcome.error)]
    else:
        assert outcome.proposal is not None
        texts.append(outcome.proposal.to_json())
    assert len(texts) > 5
    assert not any(KEY in text for text in texts)


@pytest.mark.parametrize(
    "url",
    [
        f"http://user:{KEY}@127.0.0.1/v1",
        f"https://127.0.0.1/v1?api_key={KEY}",
        f"https://127.0.0.1/v1#{KEY}",
        f"ftp://{KEY}",
        KEY,
        f"http://[{KEY}/v1",
    ],
)
def test_an_address_with_a_key_in_it_is_refused_without_repeating_it(url: str) -> None:
    with pytest.raises(InvalidParameterError) as caught:
        LanguageSettings(base_url=url)
    assert KEY not in str(caught.value)


# -- settings --------------------------------------------------------------------------------------


def test_the_command_line_wins_over_the_environment_and_this_over_the_file(tmp_path: Path) -> None:
    file = tmp_path / "settings.json"
    retry = {"tries": 2}
    file.write_text(
        json.dumps({"model": "a", "degree": "text", "sampling": {"seed": 1}, "retry": retry})
    )
    environment = {"SLAP_LANGUAGE_MODEL": "b", "SLAP_LANGUAGE_BASE_URL": NOWHERE}
    settings = read_settings(file, "c", None, environment)
    assert (settings.model, settings.base_url) == ("c", NOWHERE)
    assert settings.degree == "text" and settings.retry.tries == 2
    assert read_settings(file, None, None, {}).model == "a"


@pytest.mark.parametrize(
    "text",
    [
        "[]",
        "{",
        '{"api_key": "x"}',
        '{"degree": "poem"}',
        '{"retry": {"forever": true}}',
        '{"sampling": {"messages": []}}',
        '{"answer_seconds": 0}',
        '{"answer_seconds": "soon"}',
        '{"base_url": "localhost"}',
    ],
)
def test_bad_settings_are_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "settings.json"
    file.write_text(text)
    with pytest.raises(InvalidParameterError):
        read_settings(file, environment={})


@pytest.mark.parametrize("limits", [(0, 1, 1), (1, 0, 1), (1, 1, 0), (1, 1, float("nan"))])
def test_a_budget_of_nothing_is_refused(limits: tuple[int, int, float]) -> None:
    with pytest.raises(InvalidParameterError):
        BudgetLimits(*limits)
    assert LIMITS.attempts == 20


def test_without_model_key_or_package_it_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(LanguageUnavailableError, match="give --model"):
        OpenAIClient(LanguageSettings(), {})
    with pytest.raises(LanguageUnavailableError, match="set OPENAI_API_KEY"):
        OpenAIClient(LanguageSettings(model="m"), {})
    monkeypatch.setitem(sys.modules, "openai", None)
    with pytest.raises(LanguageUnavailableError, match=r"pip install -e '\.\[language\]'"):
        OpenAIClient(replace(SETTINGS, base_url=NOWHERE), {})
