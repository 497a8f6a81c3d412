# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node in a process of its own gets each parameter as it was given."""

import pytest
import yaml

from ensemble.launcher import _as_yaml

TEXTS = ["x #y", "2024", "true", "1e3", "12:30", "[a]", "~", "null", "", " a ", '"', "a: b", "ä\t"]


@pytest.mark.parametrize("text", TEXTS)
def test_texts_stay_texts(text):
    assert yaml.safe_load(_as_yaml(text)) == text


@pytest.mark.parametrize("number", [3, -1, 0.25, 1e-12])
def test_numbers_stay_numbers_of_their_kind(number):
    found = yaml.safe_load(_as_yaml(number))
    assert (found, type(found)) == (number, type(number))
