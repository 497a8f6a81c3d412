# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is made of what a training process says."""

import pytest

from acquisition_node.trainer import Trainer

SAYS = 'echo \'{"event": "first"}\'; echo no event; echo \'["event"]\'; printf \'{"event": "cut\''


@pytest.fixture
def trainer(monkeypatch):
    trainer = Trainer("grow", ())
    monkeypatch.setattr(trainer, "_command", ["sh", "-c", SAYS])
    return trainer


def test_events_are_handed_over_and_nothing_else(trainer):
    events = []
    trainer.run(events.append)
    assert events == [{"event": "first"}]


def test_an_error_of_whoever_is_told_is_no_line_that_was_cut(trainer):
    def on_event(event):
        raise ValueError(event["event"])

    with pytest.raises(ValueError, match="first"):
        trainer.run(on_event)
