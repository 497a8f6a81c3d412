# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Compiled code is loaded when it pays: after many rows, or where numba is loaded anyway."""

import sys

import pytest

from slap_ros.tiered_function import MANY_ROWS, TieredFunction


@pytest.fixture
def no_numba(monkeypatch):
    monkeypatch.delitem(sys.modules, "numba", raising=False)


def refused():
    raise ImportError


def test_few_rows_are_left_to_numpy(no_numba):
    function = TieredFunction("numpy", lambda: "compiled")
    assert [function.of(MANY_ROWS - 1) for _ in range(3)] == ["numpy", "compiled", "compiled"]


def test_where_numba_is_loaded_anyway_compiled_code_costs_nothing(monkeypatch):
    monkeypatch.setitem(sys.modules, "numba", pytest)
    assert TieredFunction("numpy", lambda: "compiled").of(1) == "compiled"


def test_without_numba_it_stays_with_numpy(no_numba):
    function = TieredFunction("numpy", refused)
    assert [function.of(MANY_ROWS) for _ in range(2)] == ["numpy", "numpy"]
