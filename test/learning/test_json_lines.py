# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Files of JSON lines: half a line of an interrupted run spoils neither reading nor writing."""

import json

import pytest

from slap_ros.errors import InvalidParameterError
from slap_ros.learning.json_lines import append_line, decoded_lines, whole_lines

FIRST, SECOND = {"a": [1e300, None], "b": "∅"}, {"a": []}
WHOLE = json.dumps(FIRST) + "\n"


@pytest.mark.parametrize("cut", range(1, len(WHOLE)))
@pytest.mark.parametrize("before", ["", WHOLE])
def test_a_line_is_added_after_the_whole_ones(tmp_path, before, cut):
    path = tmp_path / "lines.jsonl"
    path.write_text(before + WHOLE[:cut])
    expected = [FIRST] if before else []
    assert whole_lines(path) == expected
    append_line(path, SECOND)
    assert whole_lines(path) == [*expected, SECOND]
    assert path.read_text() == before + json.dumps(SECOND) + "\n"


def test_a_file_is_made_and_grows(tmp_path):
    path = tmp_path / "lines.jsonl"
    append_line(path, FIRST)
    append_line(path, SECOND)
    assert whole_lines(path) == [FIRST, SECOND]


def test_what_is_no_json_is_refused(tmp_path):
    path = tmp_path / "lines.jsonl"
    for text in ("{\n", "[" * 100_000 + "\n", "\n"):
        path.write_text(text)
        with pytest.raises(ValueError):
            whole_lines(path)


@pytest.mark.parametrize("line", ["{", "[]", '{"b": 1}', '{"a": "x"}'])
def test_a_line_that_says_something_else_is_named(tmp_path, line):
    path = tmp_path / "lines.jsonl"
    path.write_text('{"a": 1}\n{"a": 2}\n{"a')
    assert decoded_lines(path, lambda data: int(data["a"]), "remove it") == [1, 2]
    path.write_text(f'{{"a": 1}}\n{line}\n{{"a": 2}}\n')
    with pytest.raises(InvalidParameterError, match=r"lines\.jsonl, line 2: damaged: .*remove it"):
        decoded_lines(path, lambda data: int(data["a"]), "remove it")


def test_a_file_that_is_not_there_is_refused_with_advice(tmp_path):
    with pytest.raises(InvalidParameterError, match=r"none\.jsonl: damaged: .*remove it"):
        decoded_lines(tmp_path / "none.jsonl", str, "remove it")
