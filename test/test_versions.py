# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The revision in results: of the source, whatever a study has written beside it."""

import subprocess

import pytest

from slap_ros.versions import revision_of, versions


@pytest.fixture
def tree(tmp_path):
    (tmp_path / "docs").mkdir()
    for name in ("source.py", "docs/page.md"):
        (tmp_path / name).write_text("as committed")
    git(tmp_path, "init", "--quiet")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "--quiet", "--message", "all")
    return tmp_path


def git(tree, *arguments):
    who = ["-c", "user.name=nobody", "-c", "user.email=nobody@example.org"]
    subprocess.run(["git", "-C", str(tree), *who, *arguments], check=True)


def test_a_result_that_was_written_does_not_change_the_revision(tree):
    clean = revision_of(tree)
    assert len(clean) == 12
    (tree / "docs" / "page.md").write_text("another figure")
    (tree / "library").write_text("not tracked")
    assert revision_of(tree) == clean


def test_a_source_that_was_changed_does(tree):
    clean = revision_of(tree)
    (tree / "source.py").write_text("changed")
    assert revision_of(tree) == f"{clean}-dirty"


def test_results_name_the_engine_of_the_simulated_robot():
    mujoco = pytest.importorskip("mujoco")
    assert versions()["mujoco"] == mujoco.__version__


def test_an_installed_copy_has_none(tmp_path):
    assert revision_of(tmp_path) == "unknown"
    (tmp_path / ".git").write_text("gitdir: nowhere")
    assert revision_of(tmp_path) == "unknown"
