# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Servers, proxies and networks as others have them: their words, and no try that cannot help."""

from __future__ import annotations

import json
import re
import sys
from dataclasses import replace
from typing import Any

import pytest

from slap_ros.errors import ErrorCode, InvalidParameterError, LanguageUnavailableError, SlapError
from slap_ros.language.client import OpenAIClient
from slap_ros.language.failures import address_advice
from slap_ros.language.route import is_on_this_host, proxy_of
from slap_ros.language.settings import LanguageSettings
from support.model_answers import LIMITS, SETTINGS, Outcome, good_script, operator_json, run
from support.paper_problems import peg_in_hole
from support.scripted_server import Step, serving

PEGS = peg_in_hole()
GOOD = operator_json(PEGS.operators[1])
REGION = "not available in your region"
ELSEWHERE = "https://models.example/v1"


def asked(step: Step, cut: str = "", **settings: Any) -> tuple[Outcome, int]:
    """What comes of a server that says this about one operator, and how often it was asked."""
    with serving(good_script(PEGS, Insert=[step])) as server:
        outcome = run(PEGS, server.url.removesuffix(cut), settings=replace(SETTINGS, **settings))
        return outcome, server.asked("operator Insert")


def written(data: Any) -> Step:
    return Step(raw=json.dumps(data).encode())


def streamed(*chunks: Any) -> Step:
    lines = (f"data: {json.dumps(chunk)}\n\n" for chunk in chunks)
    return Step(raw=("".join(lines) + "data: [DONE]\n\n").encode())


CHUNK = {"choices": [{"delta": {"content": "{}"}, "finish_reason": None}]}
UNHELPFUL = {
    "an error": (written({"error": "Unexpected endpoint"}), "Unexpected endpoint"),
    "with a code": (written({"error": {"message": REGION, "code": 403}}), f"error 403: .*{REGION}"),
    "as text": (written({"error": {"message": REGION, "code": "403"}}), f"error 403: .*{REGION}"),
    "in a list": (written([{"error": {"message": REGION}}]), REGION),
    "in a choice": (
        written({"choices": [{"message": {"content": ""}, "error": {"message": REGION}}]}),
        REGION,
    ),
    "beside choices": (
        written({"choices": [{"message": {"content": "{}"}}], "error": {"message": REGION}}),
        REGION,
    ),
    "a stream": (streamed(CHUNK, CHUNK), "a stream, though none was asked for"),
    "a stream with an error": (streamed(CHUNK, {"error": {"message": REGION}}), REGION),
    "a page": (Step(raw=b"\n<!DOCTYPE html><title>Sign in &amp; go</title>"), "'Sign in & go'"),
    "XML": (Step(raw=b'<?xml version="1.0"?><Error/>'), "a web page, without a title"),
    "too long": (Step(raw=b"x" * 16_000_001), "more than 16000000 bytes"),
    "no quota": (Step(status=429, error="quota", code="insufficient_quota"), "quota"),
}


@pytest.mark.parametrize("name", UNHELPFUL)
def test_what_no_repetition_can_help_is_told_at_once(name: str) -> None:
    step, words = UNHELPFUL[name]
    outcome, tries = asked(step)
    assert outcome.error is not None
    assert outcome.error.code == ErrorCode.LANGUAGE_REFUSED
    assert tries == 1
    assert_matches(words, outcome.error)


def assert_matches(words: str, error: SlapError | None) -> None:
    assert error is not None and re.search(words, str(error)), error


@pytest.mark.parametrize(
    "error", [{"code": 429}, {"code": "502"}, {"type": "overloaded_error"}, {"code": 400}]
)
def test_what_an_error_within_an_answer_calls_passing_is_asked_again(error: Any) -> None:
    """A bad request is asked in the next form, as with its status."""
    step = written({"error": {"message": "for now", **error}})
    with serving(good_script(PEGS, Insert=[step, Step(GOOD)])) as server:
        outcome = run(PEGS, server.url)
    assert outcome.proposal is not None, outcome.error
    assert server.asked("operator Insert") == 2


@pytest.mark.parametrize(
    "step",
    [
        written({"error": "Unexpected endpoint"}),
        Step(raw=b"<html>Welcome</html>"),
        Step(status=404, error="page not found"),
        Step(status=405, error="POST"),
        Step(status=301, headers={"location": "/v1"}),
    ],
)
def test_an_address_without_its_version_is_advised_to_have_one(step: Step) -> None:
    outcome, _ = asked(step, cut="/v1")
    assert_matches(r"; add /v1 to the base URL: http://127.0.0.1:\d+/v1$", outcome.error)
    outcome, _ = asked(step)
    assert "add /v1" not in str(outcome.error)


def test_advice_about_an_address_fits_it() -> None:
    assert "add /v1" not in str(asked(Step(status=404, error="no such model"), cut="/v1")[0].error)
    assert "add /v1" not in str(asked(Step(status=401), cut="/v1")[0].error)
    assert "leave /embeddings off" in address_advice("http://x/v1/embeddings/")
    assert address_advice("https://x/v1beta/openai/") == ""


# -- answers cut short -----------------------------------------------------------------------------


@pytest.mark.parametrize("text", [None, "", "  \n"])
@pytest.mark.parametrize(
    ("sampling", "advice"),
    [
        ({"max_tokens": 100}, r"raise max_tokens \(100\)"),
        ({"max_completion_tokens": 7}, r"raise max_completion_tokens \(7\)"),
        ({}, "give more by max_tokens"),
    ],
)
def test_an_answer_that_is_all_thoughts_names_the_limit_to_raise(
    text: str | None, sampling: dict[str, Any], advice: str
) -> None:
    limits = replace(LIMITS, attempts=3)
    script = good_script(PEGS, Insert=[Step(text, finish_reason="length")])
    with serving(script) as server:
        outcome = run(
            PEGS, server.url, settings=replace(SETTINGS, sampling=sampling), limits=limits
        )
    assert outcome.error is not None
    assert_matches(f"cut at the limit of tokens before it began: .*{advice}", outcome.error)
    told = [m["content"] for r in server.requests for m in r["messages"]]
    assert not any("max_" in text for text in told)  # it is not the model's to change


# -- networks --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("https://127.0.0.1:{port}/v1", "SSL"),  # the server speaks plain HTTP
        ("http://no-such-host.invalid/v1", "no answer"),
    ],
)
def test_a_network_that_cannot_lead_there_is_no_fault_of_ours(url: str, words: str) -> None:
    with serving(good_script(PEGS)) as server:
        outcome = run(PEGS, url.format(port=server.url.split(":")[2].removesuffix("/v1")))
    assert isinstance(outcome.error, LanguageUnavailableError)
    assert words in str(outcome.error)


def test_what_a_library_never_said_it_raises_is_told_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """As when a variable of the environment makes it write a header that cannot be."""
    monkeypatch.setenv("OPENAI_ORG_ID", "“mine”")
    with serving(good_script(PEGS)) as server:
        outcome = run(PEGS, server.url)
    assert isinstance(outcome.error, LanguageUnavailableError)
    assert "UnicodeEncodeError" in str(outcome.error)
    assert server.requests == []


@pytest.mark.parametrize("number", [float("nan"), float("inf"), {1}])
def test_sampling_that_is_no_json_is_refused(number: Any) -> None:
    with pytest.raises(InvalidParameterError, match="sampling is no JSON"):
        LanguageSettings(sampling={"temperature": number})


# -- proxies ---------------------------------------------------------------------------------------

PROXIES = ("socks5://u:pass-word-1@127.0.0.1:9", "socks://127.0.0.1:9", "http://127.0.0.1:9", "x")


@pytest.mark.parametrize("proxy", PROXIES)
@pytest.mark.parametrize("variable", ["ALL_PROXY", "http_proxy"])
def test_a_server_on_this_host_is_asked_without_a_proxy(
    variable: str, proxy: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(variable, proxy)
    with serving(good_script(PEGS)) as server:
        assert run(PEGS, server.url).proposal is not None
        assert run(PEGS, server.url.replace("127.0.0.1", "localhost")).proposal is not None


@pytest.mark.parametrize(
    ("host", "here"),
    [
        ("LOCALHOST", True), ("app.localhost", True), ("127.8.8.8", True), ("::1", True),
        ("0.0.0.0", True), ("::ffff:127.0.0.1", True), ("10.0.0.1", False),
        ("localhost.example.com", False), ("2001:db8::1", False), ("", False),
    ],
)  # fmt: skip
def test_which_names_are_this_host(host: str, here: bool) -> None:
    assert is_on_this_host(host) is here


def client_of(url: str) -> OpenAIClient:
    return OpenAIClient(replace(SETTINGS, base_url=url), {})


@pytest.mark.parametrize(
    ("variable", "value", "advice"),
    [
        ("ALL_PROXY", "socks5://u:pass-word-1@proxy.example:9", "pip install socksio"),
        ("HTTPS_PROXY", "socks4://proxy.example:9", "an address with socks5:"),
        ("HTTPS_PROXY", "gopher://proxy.example", "Correct the address of the proxy"),
        ("https_proxy", "http://u:pass-word-1@proxy.example:port", "NO_PROXY=models.example"),
        ("https_proxy", "http://[::1", "Correct the address of the proxy"),
        ("SSL_CERT_FILE", "/no/such/file.pem", "SSL_CERT_FILE"),
    ],
)
def test_an_environment_that_cannot_be_used_is_named_before_anything_is_asked(
    variable: str, value: str, advice: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "socksio", None)
    monkeypatch.setenv(variable, value)
    with pytest.raises(LanguageUnavailableError) as caught:
        client_of(ELSEWHERE)
    assert advice in str(caught.value) and variable in str(caught.value)
    assert "pass-word-1" not in str(caught.value)


@pytest.mark.parametrize("excepted", ["models.example", ".example", "*", "a.b, example"])
def test_what_is_excepted_from_a_proxy_never_needs_it(
    excepted: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "socksio", None)
    monkeypatch.setenv("ALL_PROXY", "socks5://proxy.example:9")
    monkeypatch.setenv("NO_PROXY", excepted)
    client_of(ELSEWHERE).close()


def test_other_servers_are_asked_by_way_of_their_proxy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HTTPS_PROXY", "socks5://proxy.example:9")  # of another scheme
    with serving(good_script(PEGS)) as server:
        address = server.url.removesuffix("/v1").removeprefix("http://")
        monkeypatch.setenv("ALL_PROXY", address)
        assert proxy_of("http://models.example/v1") == f"http://{address}"
        assert run(PEGS, "http://models.example/v1").proposal is not None
    gone = run(PEGS, "http://models.example/v1")
    assert_matches("by way of the proxy in ALL_PROXY .*Connection refused", gone.error)
