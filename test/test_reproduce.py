# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every published figure has a command that makes it again, under its own name."""

import shlex

import pytest

from tools.reproduce import PUBLISHED, differences, figures

BY_A_BENCHMARK = {"soak"}  # an hour of a whole ensemble; its page names the command


def test_every_figure_has_its_command():
    named = {figure.name for figure in figures()}
    assert named == {path.stem for path in PUBLISHED.glob("*.json")} - BY_A_BENCHMARK
    for figure in figures():
        program, group, study, domain, *_ = shlex.split(figure.command)
        assert (program, group) == ("slap", "study")
        assert figure.name == f"{study}_{domain}"


def test_other_numbers_are_found_and_times_are_not_compared():
    published = {"rows": [{"steps": 3, "planning_seconds": 0.1}], "seconds": 1.0}
    same = {"rows": [{"steps": 3, "planning_seconds": 9.9, "added": 1}], "seconds": 2.0}
    other = {"rows": [{"steps": 4, "planning_seconds": 0.1}], "seconds": 1.0}
    assert list(differences(published, same)) == []
    assert list(differences(published, other)) == ["found.rows[0].steps"]
    assert list(differences(published, {"rows": []})) == ["found.rows"]


def test_a_figure_that_is_not_there():
    with pytest.raises(LookupError, match="no figure table9_nowhere"):
        figures(["table9_nowhere"])
