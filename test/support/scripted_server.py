# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A server with the OpenAI-compatible interface that answers by script.

A script says, for each subject that may be asked for (``decomposition``, ``operator Insert``,
``reward of Insert``), what is answered the first time, the second time and so on; the last answer
is given again for good. What the server got is kept in ``requests``. It says of itself that it is
scripted, so that what is recorded from it is never taken for a model's.
"""

from __future__ import annotations

import json
import re
import socket
import struct
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any


@dataclass(frozen=True)
class Step:
    """One reaction of the server."""

    text: str | None = ""
    refusal: str | None = None
    finish_reason: str = "stop"
    status: int = 200
    headers: Mapping[str, str] = field(default_factory=dict)
    error: str = "scripted"  # message, where the status is no success
    code: str | None = None  # of that error
    stall_s: float = 0.0  # before the answer
    trickle_s: float = 0.0  # between its bytes
    reset: bool = False  # the connection, in the middle of the answer
    raw: bytes | None = None  # instead of any envelope
    schema: bool = True  # whether it takes a JSON schema; 400 if not


Script = Mapping[str, Sequence[Step]]


class ScriptedServer:
    """Listens on a port of its own while it is open."""

    def __init__(self, script: Script) -> None:
        self.script = script
        self.requests: list[dict[str, Any]] = []
        self.headers: list[dict[str, str]] = []
        self._count: dict[str, int] = {}
        self._lock = threading.Lock()
        self._http = _Http(("127.0.0.1", 0), _Handler)
        self._http.scripted = self
        self._thread = threading.Thread(
            target=self._http.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True
        )
        self._thread.start()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self._http.server_address[1]}/v1"

    def close(self) -> None:
        self._http.shutdown()
        self._http.server_close()
        self._thread.join()

    def asked(self, subject: str) -> int:
        """How often a subject was asked for, errors included."""
        return self._count.get(subject, 0)

    def next_step(self, body: dict[str, Any], headers: dict[str, str]) -> Step:
        """What the script says to a request, which is kept."""
        subject = subject_of(body["messages"]) if "messages" in body else "embeddings"
        with self._lock:
            self.requests.append(body)
            self.headers.append(headers)
            number = self._count.get(subject, 0)
            self._count[subject] = number + 1
        steps = self.script[subject]
        return steps[min(number, len(steps) - 1)]


class _Http(ThreadingHTTPServer):
    """Knows whose it is, for its handlers."""

    daemon_threads = True
    scripted: ScriptedServer


class _Handler(BaseHTTPRequestHandler):
    """Reacts to a request as the script says."""

    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True  # else each answer waits 40 ms
    server: _Http

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002
        pass

    def do_POST(self) -> None:
        body = json.loads(self.rfile.read(int(self.headers["content-length"])))
        if not self.path.endswith(("/chat/completions", "/embeddings")):
            self._send(404, {}, b"{}")
            return
        step = self.server.scripted.next_step(body, dict(self.headers))
        time.sleep(step.stall_s)
        if not step.schema and body.get("response_format", {}).get("type") == "json_schema":
            step = Step(status=400, error="response_format json_schema is not supported")
        if step.status != 200:
            error = json.dumps({"error": {"message": step.error, "code": step.code}}).encode()
            self._send(step.status, step.headers, error)
            return
        data = step.raw if step.raw is not None else envelope(step, body)
        if step.reset:
            self._reset_after_half(data)
        else:
            self._send(200, step.headers, data, step.trickle_s)

    def _begin(self, status: int, headers: Mapping[str, str], length: int) -> None:
        self.send_response(status)
        for name, value in {"content-type": "application/json", **headers}.items():
            self.send_header(name, value)
        self.send_header("content-length", str(length))
        self.end_headers()

    def _reset_after_half(self, data: bytes) -> None:
        self._begin(200, {}, len(data))
        self.wfile.write(data[: len(data) // 2])
        self.wfile.flush()
        linger = struct.pack("ii", 1, 0)
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
        self.connection.close()
        self.close_connection = True

    def _send(
        self, status: int, headers: Mapping[str, str], data: bytes, trickle_s: float = 0.0
    ) -> None:
        try:
            self._begin(status, headers, len(data))
            for i in range(len(data) if trickle_s else 0):
                self.wfile.write(data[i : i + 1])
                self.wfile.flush()
                time.sleep(trickle_s)
            if not trickle_s:
                self.wfile.write(data)
        except (BrokenPipeError, ConnectionResetError):
            self.close_connection = True  # the client did not wait


def envelope(step: Step, body: dict[str, Any]) -> bytes:
    message = {"role": "assistant", "content": step.text, "refusal": step.refusal}
    return json.dumps(
        {
            "id": "scripted",
            "object": "chat.completion",
            "created": 0,
            "model": body["model"],
            "system_fingerprint": "scripted",
            "choices": [{"index": 0, "message": message, "finish_reason": step.finish_reason}],
            "usage": {"prompt_tokens": 100, "completion_tokens": 10, "total_tokens": 110},
        }
    ).encode()


def subject_of(messages: Sequence[Mapping[str, str]]) -> str:
    """What is asked for, from the first question of a conversation."""
    question = next(m["content"] for m in messages if m["role"] == "user")
    if question.startswith("Make a plan"):
        return "plan"
    skill = re.search(r"^The skill: (\w+)", question, re.MULTILINE)
    if skill is None:
        return "decomposition"
    kind = "reward of" if question.startswith("Compose") else "operator"
    return f"{kind} {skill.group(1)}"


@contextmanager
def serving(script: Script) -> Iterator[ScriptedServer]:
    """A server while the block lasts."""
    server = ScriptedServer(script)
    try:
        yield server
    finally:
        server.close()
