# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whatever a name stands for: every reader ends, with an error that says why."""

import ast
import errno
import os
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from slap_ros.acquisition.proposals.operator_file import read_operators
from slap_ros.bags import bag_info
from slap_ros.bags.mcap_reader import read_mcap
from slap_ros.bags.rosbag2 import read_metadata
from slap_ros.bags.sqlite_reader import read_sqlite
from slap_ros.cli.plan import plan
from slap_ros.domains import get_domain
from slap_ros.errors import SlapError
from slap_ros.files import parse_json, parse_yaml, read_bytes, read_text
from slap_ros.language.cassette import read_cassette
from slap_ros.language.settings import read_settings
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.meshes.decomposition import load_mesh
from slap_ros.policies import library_files
from slap_ros.policies.library_files import ABOUT, replace_folder
from slap_ros.robot.scene_config import read_scene_config
from slap_ros.shortcuts.shipped import require_usable
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.studies.slap.trainings import TrainingFolder, read_curve

pytestmark = pytest.mark.timeout(60)  # what waits for a writer waits for good
ROOT = Path(__file__).parents[1]
TOWER = get_domain("obstacle_tower")


def pipe(path):
    os.mkfifo(path)


def folder(path):
    path.mkdir()


def endless(path):
    path.symlink_to("/dev/zero")


def silent(path):
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(path))


def large(path):
    """A terabyte that takes no room."""
    with path.open("wb") as file:
        file.truncate(2**40)


def checkpoint(path):
    pytest.importorskip("torch")
    from slap_ros.shortcuts.ppo import read_checkpoint

    read_checkpoint(path)


READERS = {
    "bag.mcap": bag_info,
    "run.mcap": lambda path: list(read_mcap(path)),
    "run.db3": lambda path: list(read_sqlite(path)),
    "metadata.yaml": lambda path: read_metadata(path.parent),
    "domain.pddl": lambda path: plan(str(path), path),
    "operators.txt": lambda path: read_operators(path, None),
    "scene.yaml": lambda path: read_scene_config(path, TOWER),
    ABOUT: lambda path: load_library(path.parent, TOWER),
    f"./{ABOUT}": lambda path: require_usable(str(path.parent)),
    "explored.json": lambda path: WorkFolder(path.parent).cached("explored", dict, dict),
    "settings.json": lambda path: TrainingFolder(path.parent).distribution(),
    "progress.jsonl": read_curve,
    "checkpoint0.pt": checkpoint,
    "language.json": lambda path: read_settings(path, None, None),
    "answers.jsonl": read_cassette,
    "duck.obj": lambda path: load_mesh(path, 0.1),
}


@pytest.mark.parametrize("make", [pipe, folder, endless, silent, large])
@pytest.mark.parametrize("name", READERS)
def test_what_is_no_file_is_refused_at_once(tmp_path, monkeypatch, name, make):
    monkeypatch.chdir(tmp_path)  # the name of a socket must be short
    path = tmp_path / Path(name).name
    make(Path(path.name))
    with pytest.raises((SlapError, OSError)) as caught:
        READERS[name](path)
    told = str(caught.value)
    assert path.name in told or "expected" in told or "damaged" in told


def bomb(merge):
    """Ten references to ten references to ...: 1 KB that stands for 10^30 values."""
    key = "<<" if merge else "x"
    lines = [f"a{i}: &a{i} {{{key}: [{', '.join([f'*a{i - 1}'] * 10)}]}}" for i in range(1, 30)]
    return "\n".join(["a0: &a0 {y: 1}", *lines])


@pytest.mark.parametrize(
    "text",
    [
        "[" * 200_000,
        "[" * 900 + "]" * 900,
        "{a: " * 200_000,
        "- " * 100_000,
        "? " * 200_000,
        bomb(merge=False),
        bomb(merge=True),
        "&a [*a]",
        "!!bool x",
        "!!int ''",
        "!!timestamp x",
        "9" * 5_000,
        "? [a]\n: b",
        "\x00",
        "!!python/name:os.system",
    ],
    ids=range(15),
)
def test_yaml_that_is_no_plain_data_is_refused(text):
    with pytest.raises(ValueError, match=r"YAML|values|limit"):
        parse_yaml(text)


def test_yaml_may_repeat_itself():
    """As ``metadata.yaml`` of bags from slap_ros 0.1.0 does."""
    assert parse_yaml("a: &x {b: 1}\nc: *x\nd: {<<: *x, e: 2}") == {
        "a": {"b": 1},
        "c": {"b": 1},
        "d": {"b": 1, "e": 2},
    }
    assert parse_yaml("") is None


@pytest.mark.parametrize("text", ["[" * 200_000, '{"a":' * 200_000, "9" * 5_000, "", "nul"])
def test_json_that_is_none_is_a_value_error(text):
    with pytest.raises(ValueError):
        parse_json(text)


def test_a_file_may_be_as_large_as_its_reader_says(tmp_path):
    (tmp_path / "a").write_bytes(b"x\r\n")
    assert read_bytes(tmp_path / "a", 3) == b"x\r\n"
    assert read_text(tmp_path / "a", 3) == "x\n"
    with pytest.raises(OSError, match="larger than"):
        read_bytes(tmp_path / "a", 2)


# Files of the package itself, of installed distributions, of the kernel, of git; and files that are
# written.
OWN = {
    "doctor/machine.py",
    "domains/cleanup_table/shapes/__init__.py",
    "domains/registry.py",
    "files.py",
    "messages/typestore.py",
    "compilation.py",
    "report/page.py",
}


FULL = """
import resource, signal, sys
from pathlib import Path
from slap_ros.files import write_whole

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (8, 8))
try:
    write_whole(Path(sys.argv[1]), "more than there is room for")
except OSError as error:
    print(error.filename)
"""


def test_what_there_is_no_room_for_is_named_and_leaves_what_was_there(tmp_path):
    path = tmp_path / "kept.json"
    path.write_text("old")
    run = subprocess.run(
        [sys.executable, "-c", FULL, path], capture_output=True, text=True, timeout=60
    )
    assert run.stdout == f"{path}\n", run.stderr
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def with_content(content):
    return lambda draft: (draft / ABOUT).write_text(content)


def test_a_folder_that_is_replaced_is_there_at_every_moment(tmp_path):
    folder, missed, done = tmp_path / "library", [], threading.Event()
    replace_folder(folder, with_content("0"))

    def look():
        while not done.is_set():
            try:
                (folder / ABOUT).read_text()
            except FileNotFoundError as error:
                missed.append(error)

    looker = threading.Thread(target=look)
    looker.start()
    for i in range(300):
        replace_folder(folder, with_content(f"{i}"))
    done.set()
    looker.join()
    assert not missed
    assert (folder / ABOUT).read_text() == "299"
    assert list(tmp_path.iterdir()) == [folder]


@pytest.mark.parametrize("code", [errno.EINVAL, errno.EIO])
def test_a_folder_is_replaced_where_nothing_can_change_places(tmp_path, monkeypatch, code):
    def cannot(one, other):
        raise OSError(code, os.strerror(code), str(one))

    folder = tmp_path / "library"
    replace_folder(folder, with_content("old"))
    monkeypatch.setattr(library_files, "exchange", cannot)
    if code == errno.EIO:
        with pytest.raises(OSError, match=os.strerror(code)):
            replace_folder(folder, with_content("new"))
    else:
        replace_folder(folder, with_content("new"))
    assert (folder / ABOUT).read_text() == ("old" if code == errno.EIO else "new")
    assert list(tmp_path.iterdir()) == [folder]


def test_nobody_opens_files_in_other_ways():
    found = [
        f"{name}:{node.lineno}: {ast.unparse(node)[:60]}"
        for file in (ROOT / "slap_ros").rglob("*.py")
        if (name := str(file.relative_to(ROOT / "slap_ros"))) not in OWN
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and opens(node)
    ]
    assert found == []


def opens(call):
    """Whether a call reads a file, or JSON or YAML that may be from one."""
    called = ast.unparse(call.func)
    if called.endswith((".read_text", ".read_bytes")) or called == "open":
        return True
    if called.endswith(".open") and called != "os.open" and call.args:
        mode = call.args[0]
        return isinstance(mode, ast.Constant) and str(mode.value)[0] not in "awx"
    return called in ("yaml.safe_load", "json.load")
