# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Deadlines that a busy machine can break: how long they are, and what is said of them."""

from dataclasses import replace

import pytest

from ensemble.cli.run_options import RunOptions
from ensemble.cli.run_task import _request
from ensemble.nodes import RunSettings
from ensemble.patience import MOST_GROWN, USUAL_IMPORT, grown_patience
from ensemble.run import RunRequest, run
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode, NotReadyError
from slap_ros.skills.domain_choice import DomainChoice

SLOWEST = 0.001  # steps per second: the next state is 1,000 s away, as on a machine that hangs


def impatient(factor, **settings):
    settings = RunSettings(
        DomainChoice("obstacle2d", "fair"),
        3,
        0,
        "lazy",
        None,
        shortcuts="none",
        patience=factor,
        **settings,
    )
    return RunRequest(settings, in_process=True)


def assert_advised(words):
    assert "the machine's load (" in words
    assert "processors)" in words
    assert "--patience" in words


def test_a_state_that_comes_too_late_is_put_down_to_load(network):
    metrics = run(impatient(0.2, pace=SLOWEST), lambda *_: None)
    assert metrics.error_code == ErrorCode.NO_STATE
    assert_advised(metrics.error_msg)


def test_nodes_that_come_up_too_late_are_put_down_to_load(network, install_domain):
    name = install_domain("late", "import time\ntime.sleep(5.0)\n")
    request = impatient(0.01)  # 0.3 s
    settings = replace(request.settings, domain=DomainChoice(name, "default"))
    processes = replace(request, settings=settings, in_process=False)
    with pytest.raises(NotReadyError) as raised:
        run(processes, lambda *_: None)
    assert_advised(str(raised.value))


@pytest.mark.parametrize(
    ("given", "import_s", "expected"),
    [
        (None, 0.0, 1.0),
        (None, 4.0 * USUAL_IMPORT, 4.0),
        (None, 3600.0, MOST_GROWN),
        (0.5, 4.0 * USUAL_IMPORT, 0.5),
        (20.0, 0.0, 20.0),
    ],
)
def test_deadlines_grow_with_the_time_that_the_start_takes(given, import_s, expected):
    domain = get_domain("obstacle2d")
    options = RunOptions("obstacle2d", patience=given)
    request = _request(options, domain, domain.task(0), import_s)
    assert request.settings.patience == expected
    assert request.import_s == import_s


def test_a_slower_start_never_makes_deadlines_shorter():
    factors = [grown_patience(0.1 * tenths) for tenths in range(100)]
    assert factors == sorted(factors)
    assert factors[0] == 1.0
