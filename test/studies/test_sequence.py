# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The study of sequences: from libraries whose records are known, to the figures of the page."""

import json

import pytest

from slap_ros.studies.registry import STUDIES
from support.slap_command import slap

pytest.importorskip("matplotlib")
GOALS = ("task0", "task1", "task2")


def sequence(folder, steps, solved, scratch=False, **changes):
    """A library of groceries with the record of a sequence."""
    goals = [
        {
            "goal": goal,
            "steps": 2 * count,
            "steps_to_level": count,
            "reached": count != 700,
            "learned": {"Pick": 2 * count},
            "retrieved": {},
            "ended": "nothing fails",
            "tried": dict.fromkeys(GOALS[: len(success)], 0.9),
            "solved": dict(zip(GOALS, success, strict=False)),
        }
        for goal, count, success in zip(GOALS, steps, solved, strict=False)
    ]
    folder.mkdir()
    about = {
        "format": 1,
        "domain": "groceries",
        "sequence": {"scratch": scratch, "goals": goals},
        **changes,
    }
    (folder / "library.json").write_text(json.dumps(about))
    return folder


def study(*arguments):
    command = ["study", "sequence", "groceries", *arguments]
    return slap(*command)


def test_later_goals_are_compared_with_the_first_and_forgetting_shows(tmp_path):
    one = sequence(tmp_path / "0", (1000, 100, 300), ((1.0,), (0.5, 1.0), (0.75, 0.25, 1.0)))
    two = sequence(tmp_path / "1", (3000, 500, 700), ((1.0,), (1.0, 0.5), (1.0, 0.5, 1.0)))
    alone = sequence(tmp_path / "s", (900, 900, 900), ((1.0,), (0.0, 1.0), (0.0, 0.0, 1.0)), True)
    libraries = [word for folder in (one, two, alone) for word in ("--library", folder)]
    ran = study(*libraries, "--output", tmp_path / "out")
    assert ran.exit_code == 0, ran.output
    found = json.loads((tmp_path / "out" / "sequence_groceries.json").read_text())["found"]
    assert found["later_over_first"] == {"carried on": 0.2, "from scratch": 1.0}
    assert found["kept_over_before"] == {"carried on": pytest.approx(5 / 7), "from scratch": 0.0}
    assert STUDIES["sequence"].summary(found) == (
        "carried on: 0.20 of the first goal's steps for each later one, 0.71 of the success kept, "
        "never .8 of task2; from scratch: 1.00 of the first goal's steps for each later one"
    )
    page = (tmp_path / "out" / "sequence_groceries.md").read_text()
    # after the third goal: (.75 + .25) / 2 and .75 of what was (1 + 1) / 2 and (1 + .5) / 2
    assert (
        "| carried on | task2 | 2 | ≥ 500 ± 283 | 1000 ± 566 | 1.00 ± 0.00 | 0.62 ± 0.18 | "
        "0.88 ± 0.18 |" in page
    )
    assert "| from scratch | task2 | 1 | 900 | 1800 | 1.00 | 0.00 | 1.00 |" in page


def test_where_there_is_no_other_those_that_ship_are_read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ran = study("--output", tmp_path / "out")
    assert ran.exit_code == 0, ran.output
    made = json.loads((tmp_path / "out" / "sequence_groceries.json").read_text())
    assert made["command"] == "slap study sequence groceries"
    assert [len(goals) for goals in made["found"]["sequences"]["carried on"]] == [10, 10]


def test_a_sequence_that_has_not_come_to_its_end_counts_as_far_as_it_came(tmp_path):
    whole = sequence(tmp_path / "0", (1000, 200, 300), ((1.0,), (1.0, 1.0), (1.0, 1.0, 1.0)))
    begun = sequence(tmp_path / "s", (1000, 600), ((0.5,), (0.25, 0.5)), scratch=True)
    ran = study("--library", whole, "--library", begun, "--output", tmp_path / "out")
    assert ran.exit_code == 0, ran.output
    found = json.loads((tmp_path / "out" / "sequence_groceries.json").read_text())["found"]
    assert found["later_over_first"] == {"carried on": 0.25, "from scratch": 0.6}
    page = (tmp_path / "out" / "sequence_groceries.md").read_text()
    assert page.count("| from scratch | task") == 2
    assert "goals_of_each_sequence: carried on `3`, from scratch `2`" in page
    other = sequence(tmp_path / "o", (1000,), ((0.5,),))
    about = json.loads((other / "library.json").read_text().replace("task0", "task7"))
    (other / "library.json").write_text(json.dumps(about))
    refused = study("--library", whole, "--library", other, "--output", tmp_path / "none")
    assert "different goals" in " ".join(refused.stderr.split())


def test_what_earlier_goals_cost_again_is_counted_with_the_goal_after_which_they_were(tmp_path):
    folder = sequence(tmp_path / "0", (1000, 200), ((1.0,), (0.9, 1.0)))
    about = json.loads((folder / "library.json").read_text())
    about["sequence"]["relearn"] = True
    about["sequence"]["goals"][1]["again"] = {"task0": 50}
    (folder / "library.json").write_text(json.dumps(about))
    ran = study("--library", folder, "--output", tmp_path / "out")
    assert ran.exit_code == 0, ran.output
    page = (tmp_path / "out" / "sequence_groceries.md").read_text()
    assert "| carried on, relearned | task1 | 1 | 250 | 450 | 1.00 | 0.90 | 1.00 |" in page


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"domain": "bowls"}, "of domain 'bowls', not of 'groceries'"),
        ({"sequence": None}, "no sequence made it"),
        ({"sequence": {"scratch": False, "goals": []}}, "it has no goals"),
        ({"sequence": {"scratch": False, "goals": [{"goal": "task0"}]}}, "no sequence made it"),
    ],
)
def test_what_is_no_sequence_is_left_out_with_a_reason(tmp_path, changes, said):
    done = ((1.0,), (1.0, 1.0), (1.0, 1.0, 1.0))
    other = sequence(tmp_path / "other", (1, 1, 1), done, **changes)
    ran = study("--library", other, "--output", tmp_path / "out")
    assert ran.exit_code != 0
    text = " ".join(ran.stderr.split())
    assert said in text
    assert "slap acquire-sequence groceries" in text


def test_after_each_goal_all_goals_so_far_must_have_been_tried(tmp_path):
    untried = sequence(tmp_path / "one", (1, 1, 1), ((1.0,), (1.0, 1.0), (1.0,)))
    ran = study("--library", untried, "--output", tmp_path / "out")
    assert ran.exit_code != 0
    assert "not all goals were tried" in " ".join(ran.stderr.split())
