# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Studies here do their jobs in the process of the test."""

import pytest

from support.study_helpers import in_this_process


@pytest.fixture(autouse=True)
def _in_this_process(monkeypatch):
    in_this_process(monkeypatch)
