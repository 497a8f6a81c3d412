# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Answers of model servers spoilt at random: an answer, or an error of ours without the key."""

import json
import random
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("openai")
TESTS = Path(__file__).parents[1]
from slap_ros.errors import ErrorCode  # noqa: E402
from slap_ros.language.settings import RetryPolicy  # noqa: E402
from support.model_answers import LIMITS, SETTINGS, good_script, operator_json, run  # noqa: E402
from support.paper_problems import peg_in_hole  # noqa: E402
from support.scripted_server import Step, envelope, serving  # noqa: E402

pytestmark = pytest.mark.timeout(3600)  # for as many cases as somebody may ask for
KEY = "sk-secret-0123456789abcdef"
PEGS = peg_in_hole()
RETRY = RetryPolicy(tries=2, first_pause=0.001, longest_pause=0.001)
ENDS = {
    ErrorCode.LANGUAGE_REFUSED, ErrorCode.LANGUAGE_UNAVAILABLE, ErrorCode.PROPOSAL_REJECTED,
}  # fmt: skip
PIECES = (
    b"<html><title>x</title>", b"data: ", b"\n\n", b'{"error": "', b'{"error": {"code": 429}}',
    b"[", b"]", b"}", b"null", b'"', b"\x00", b"\xff", KEY.encode(), b'"choices": [{"error": 1}]',
)  # fmt: skip
STATUSES = (200, 200, 200, 204, 301, 400, 401, 404, 407, 418, 429, 500, 503, 599)


def spoilt(rng):
    """A reaction of a server that is not well."""
    said = operator_json(PEGS.operators[1]) if rng.random() < 0.5 else None
    reason = rng.choice(("stop", "length", KEY))
    body = envelope(Step(said, finish_reason=reason), {"model": "m"})
    for _ in range(rng.randint(0, 3)):
        at = rng.randint(0, len(body))
        cut = rng.randint(at, len(body)) if rng.random() < 0.5 else at
        body = body[:at] + rng.choice(PIECES) + body[cut:]
    status = rng.choice(STATUSES)
    return Step(status=status, raw=body, error=f"{KEY} <p>", headers={"retry-after": "0"})


def test_every_answer_ends_in_a_proposal_or_a_code(request, monkeypatch):
    monkeypatch.setenv("OPENAI_API_KEY", KEY)
    for name in ("ALL_PROXY", "HTTP_PROXY", "NO_PROXY"):
        monkeypatch.delenv(name, raising=False)
        monkeypatch.delenv(name.lower(), raising=False)
    settings, limits = replace(SETTINGS, retry=RETRY), replace(LIMITS, attempts=4)
    rng = random.Random(5)
    for _ in range(10 * (4 + request.config.getoption("--fault-cases"))):
        with serving(good_script(PEGS, Insert=[spoilt(rng), spoilt(rng)])) as server:
            outcome = run(PEGS, server.url, settings=settings, limits=limits)
        assert outcome.proposal is not None or outcome.error.code in ENDS, outcome.error
        told = f"{outcome.error} {json.dumps(outcome.log.entries)}"
        assert KEY not in told
