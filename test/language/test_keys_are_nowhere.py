# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A key is in nothing that is printed or kept, whatever fails; nor is one that was copied badly."""

from __future__ import annotations

import json
import logging
import tempfile
import traceback
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from slap_ros.acquisition.training.embedding_encoder import EmbeddingEncoder
from slap_ros.cli.console import exits
from slap_ros.errors import LanguageUnavailableError, SlapError
from slap_ros.language.client import OpenAIClient
from slap_ros.language.text_embedder import ServerEmbedder
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.redaction import without_secrets
from support.model_answers import SETTINGS, good_script
from support.paper_problems import peg_in_hole
from support.scripted_server import Step, serving
from support.slap_command import slap

PEGS = peg_in_hole()
EXAMPLE = Path(__file__).parents[2] / "examples" / "peg_in_hole"
KEY = "sk-secret-0123456789abcdef"
ECHO = f"Incorrect API key provided: {KEY}. Your header was 'Bearer {KEY}'."
NOWHERE = "http://127.0.0.1:9/v1"
RETRY = {"tries": 2, "first_pause": 0.01, "longest_pause": 0.01}

# Keys that no header can hold, and the words that name why.
UNSENDABLE = {
    "typographic quotes": (f"“{KEY}”", "begins with U+201C (left double quotation mark)"),
    "a line end": (f"{KEY}\n", "ends with a line end"),
    "a carriage return": (f"{KEY}\r", "ends with a carriage return"),
    "a blank before": (f" {KEY}", "begins with a blank"),
    "a blank within": (f"{KEY} {KEY}", "has a blank"),
    "two lines": (f"{KEY}\n{KEY}", "has a line end"),
    "a hard blank": (f"{KEY}\u00a0", "ends with U+00A0 (no-break space)"),
    "an invisible sign": (f"\ufeff{KEY}", "begins with U+FEFF"),
    "a dash": (f"{KEY}—", "ends with U+2014 (em dash)"),
    "a byte": (f"{KEY}\udc93", "ends with the byte 0x93"),
    "an escape": (f"\x1b{KEY}", "begins with U+001B"),
    "blanks alone": (" " * 9, "begins with a blank"),
}
# What servers say that have the key and repeat it.
SAYING = {
    "refused": Step(status=401, error=ECHO),
    "forbidden": Step(status=403, error=ECHO),
    "elsewhere": Step(status=404, error=ECHO),
    "moved": Step(status=302, error=ECHO, headers={"location": f"/?key={KEY}"}),
    "never well": Step(status=500, error=ECHO),
    "busy": Step(status=429, error=ECHO, headers={"retry-after": KEY}),
    "bad request": Step(status=400, error=ECHO),
    "an answer": Step(ECHO),
    "a refusal": Step(None, refusal=ECHO),
    "a reason to stop": Step("", finish_reason=KEY),
    "an error in a 200": Step(raw=json.dumps({"error": ECHO}).encode()),
    "a code": Step(raw=json.dumps({"error": {"message": {"a": KEY}, "code": KEY}}).encode()),
    "a stream": Step(raw=f"data: {json.dumps({'error': ECHO})}\n\n".encode()),
    "a page": Step(raw=f"<title>{ECHO}</title>{ECHO}".encode()),
    "garbage": Step(raw=ECHO.encode()),
    "half an answer": Step(ECHO * 200, reset=True),
}


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder for everything that is kept, files of crashes among it."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    settings = {"model": "m", "answer_seconds": 5, "retry": RETRY}
    (tmp_path / "settings.json").write_text(json.dumps(settings))
    yield tmp_path


def everything(kept: Path, *more: str) -> str:
    files = [file.read_text(errors="replace") for file in kept.rglob("*") if file.is_file()]
    return "\n".join((*files, *more))


def proposed(kept: Path, url: str) -> str:
    """All that ``slap propose`` says and keeps about a server."""
    words = [
        "propose", EXAMPLE / "domain.pddl", EXAMPLE / "problem.pddl", "--proposer", "language",
        "--base-url", url, "--language-settings", kept / "settings.json", "--attempts", 4,
        "--cassette", f"record:{kept / 'cassette.jsonl'}", "--output", kept / "proposal",
    ]  # fmt: skip
    result = slap(*words)
    assert result.exit_code not in (0, 2)
    raised = "".join(traceback.format_exception(result.exception)) if result.exception else ""
    return everything(kept, result.stdout, result.stderr, raised)


@pytest.mark.parametrize("name", SAYING)
def test_a_key_that_a_server_repeats_is_nowhere(
    name: str, kept: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", KEY)
    caplog.set_level(logging.DEBUG)
    with serving(good_script(PEGS, Insert=[SAYING[name]])) as server:
        told = proposed(kept, server.url) + caplog.text
    sent = {value for h in server.headers for n, value in h.items() if n.lower() == "authorization"}
    assert sent == {f"Bearer {KEY}"}  # it does go where it belongs
    assert (kept / "cassette.jsonl").exists()
    assert KEY not in told


@pytest.mark.parametrize("name", UNSENDABLE)
def test_a_key_that_no_header_can_hold_is_named_before_anything_is_sent(
    name: str, kept: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    key, words = UNSENDABLE[name]
    monkeypatch.setenv("OPENAI_API_KEY", key)
    caplog.set_level(logging.DEBUG)
    with serving(good_script(PEGS)) as server:
        told = proposed(kept, server.url) + caplog.text
    assert f"the key in OPENAI_API_KEY {words}" in " ".join(told.split())
    assert server.requests == []
    assert KEY not in told
    assert not list(kept.glob("*.log"))  # it is no fault of ours


@pytest.mark.parametrize("name", UNSENDABLE)
def test_the_client_of_embeddings_names_such_a_key_as_well(
    name: str, kept: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    key, words = UNSENDABLE[name]
    monkeypatch.setenv("OPENAI_API_KEY", key)
    with pytest.raises(LanguageUnavailableError) as caught:
        EmbeddingEncoder(ServerEmbedder(replace(SETTINGS, base_url=NOWHERE)), WorkFolder(kept))
    told = "".join(traceback.format_exception(caught.value))
    assert words in told and KEY not in told


@pytest.mark.parametrize("name", SAYING)
def test_what_a_server_of_embeddings_repeats_is_nowhere(
    name: str, kept: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """It has no embeddings; what it says instead is what another one says of a chat."""
    monkeypatch.setenv("OPENAI_API_KEY", KEY)
    caplog.set_level(logging.DEBUG)
    operator = PEGS.operators[0]
    with serving({"embeddings": [SAYING[name]]}) as server:
        encoder = EmbeddingEncoder(
            ServerEmbedder(replace(SETTINGS, base_url=server.url)), WorkFolder(kept)
        )
        with pytest.raises(SlapError) as caught:
            encoder.encode(operator)
    assert server.asked("embeddings") > 0
    raised = "".join(traceback.format_exception(caught.value))
    assert KEY not in everything(kept, caplog.text, raised, repr(caught.value))


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"model": f"m-{KEY}"}, "name of the model"),
        ({"base_url": f"https://models.example/{KEY}/v1"}, "base URL"),
        ({"sampling": {"user": KEY}}, "sampling"),
    ],
)
def test_a_key_among_what_is_recorded_is_refused(change: dict[str, Any], where: str) -> None:
    settings = replace(SETTINGS, base_url=NOWHERE)
    with pytest.raises(LanguageUnavailableError, match=f"stands in the {where}") as caught:
        OpenAIClient(replace(settings, **change), {"OPENAI_API_KEY": KEY})
    assert KEY not in str(caught.value)


def test_a_placeholder_may_be_the_name_of_a_server() -> None:
    settings = replace(SETTINGS, base_url=NOWHERE, model="lm-studio/tiny")
    OpenAIClient(settings, {"OPENAI_API_KEY": "lm-studio"}).close()


# -- what nobody foresaw ---------------------------------------------------------------------------


def header_of(key: str) -> bytes:
    return f"Bearer “{key}”".encode("ascii")


RAISING: dict[str, Callable[[str], object]] = {
    "a header": header_of,
    "a text": lambda key: int(f"Bearer {key}"),
    "an argument": lambda key: {}[key],  # type: ignore[index]
    "a repetition": lambda key: [].index({"headers": repr(key)}),  # type: ignore[arg-type]
    "a file": lambda key: Path("/nowhere", key).read_text(),
    "no file": lambda key: (_ for _ in ()).throw(OSError(f"{key!a} is lost")),
    "an error of ours": lambda key: (_ for _ in ()).throw(SlapError(json.dumps(key))),
}


@pytest.mark.parametrize(
    "key", [KEY, f"“{KEY}”", f"{KEY}\n{KEY}\udc93"], ids=["good", "quoted", "odd"]
)
@pytest.mark.parametrize("name", RAISING)
def test_no_error_shows_a_key_on_the_screen_or_in_its_file(
    name: str, key: str, kept: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", key)
    command = typer.Typer(pretty_exceptions_enable=False)

    def raise_it() -> None:
        RAISING[name](key)

    command.command()(exits(raise_it))
    result = CliRunner().invoke(command)
    assert result.exit_code not in (0, 2)
    assert KEY not in everything(kept, result.stdout, result.stderr)


@pytest.mark.parametrize(
    ("text", "freed"),
    [
        ("a token-0123456789 b", "a [key] b"),
        ("a token%2D0123456789 b", "a token%2D0123456789 b"),
        ("http://me:pass-word-1@proxy", "http://me:[key]@proxy"),
        ("Authorization: Bearer x.y.z'", "Authorization: Bearer [key]'"),
        ("/home/me/keys", "/home/me/keys"),
        ("short", "short"),
    ],
)
def test_secrets_are_known_by_where_they_are_kept(text: str, freed: str) -> None:
    environment = {
        "HF_TOKEN": "token-0123456789", "https_proxy": "http://me:pass-word-1@proxy:80",
        "KEYS_FOLDER": "/home/me/keys", "MY_SECRET": "short", "NO_PROXY": "example.com",
    }  # fmt: skip
    assert without_secrets(text, environment) == freed
