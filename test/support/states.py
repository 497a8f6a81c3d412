# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""States changed by hand."""

from slap_ros.relational import State


def changed(state: State, name: str, **features: float) -> State:
    """The state with other features of an object."""
    obj = state.layout.object(name)
    return state.replace({(obj, feature): value for feature, value in features.items()})
