# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who has a log instead of a terminal also sees how far something is."""

from __future__ import annotations

from io import StringIO

import pytest
from rich.console import Console
from rich.progress import BarColumn

from slap_ros.cli.bars import Bars
from slap_ros.cli.learning_bars import LearningBars


@pytest.fixture
def log() -> StringIO:
    return StringIO()


def bars(log: StringIO, log_period_s: float, terminal: bool = False) -> Bars:
    console = Console(file=log, force_terminal=terminal, width=120, markup=False)
    return Bars(on=console, log_period_s=log_period_s)


def test_a_log_gets_a_line_as_something_is_done(log: StringIO) -> None:
    with bars(log, log_period_s=0.0) as shown:
        counted = shown.add_task("learning", total=4)
        detailed = shown.add_task("  Pick [red]", total=200)
        shown.advance(counted)
        shown.update(detailed, completed=100, detail="success 0.50")
        shown.advance(counted)
    assert log.getvalue().split("\n")[:3] == [
        "learning: 25%, 1 of 4",
        "Pick [red]: 50%, success 0.50",
        "learning: 50%, 2 of 4",
    ]


def test_a_log_is_not_flooded(log: StringIO) -> None:
    with bars(log, log_period_s=3600.0) as shown:
        counted = shown.add_task("learning", total=100)
        for _ in range(100):
            shown.advance(counted)
    assert log.getvalue().strip() == ""


def test_a_terminal_gets_bars_alone(log: StringIO) -> None:
    with bars(log, log_period_s=0.0, terminal=True) as shown:
        shown.advance(shown.add_task("learning", total=4))
    assert "1 of 4" not in log.getvalue()


def test_an_interrupted_training_says_that_it_goes_on(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(KeyboardInterrupt), LearningBars(BarColumn()) as shown:
        shown.on_progress("exploring", 1, 2)
        raise KeyboardInterrupt
    assert "the same command goes on" in capsys.readouterr().err
