# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""States: immutable, equal to the bit, refusing what is not a state."""

import gc
import pickle
import weakref

import numpy as np
import pytest

from slap_ros.errors import InvalidStateError, UnknownObjectError
from slap_ros.relational import Feature, Layout, State, Type
from slap_ros.relational.objects import Column

CUP = Type("cup", (Feature("x", "m"), Feature("full", "1")))


def test_a_state_cannot_be_changed():
    state = State.build({CUP("a"): {"x": 1.0, "full": 0.0}})
    with pytest.raises(ValueError, match="read-only"):
        state.data[0] = 2.0
    with pytest.raises(ValueError, match="read-only"):
        state[CUP("a")][0] = 2.0


def test_equality_is_to_the_bit():
    state = State.build({CUP("a"): {"x": 0.1 + 0.2, "full": 0.0}})
    near = state.replace({(CUP("a"), "x"): 0.3})
    same = state.replace({(CUP("a"), "x"): 0.1 + 0.2})
    assert state != near
    assert state == same
    assert hash(state) == hash(same)


def test_layouts_of_the_same_objects_are_one():
    layout = Layout.of((CUP("a"), CUP("b")))
    assert layout is Layout.of((CUP("a"), CUP("b")))
    assert layout is pickle.loads(pickle.dumps(layout))


def test_a_layout_forgets_the_columns_that_nobody_has_any_more():
    """Layouts outlive episodes, whose columns are asked for many thousand times."""
    a, b = CUP("a"), CUP("b")
    state = State.build({obj: {"x": 1.0, "full": 0.0} for obj in (a, b)})
    kept = Column((a, b))
    ask = (lambda c: state.stack(c, "x"), lambda c: state.gather(c, ("x", "full")))
    for look in ask:
        look(kept)
        gone = weakref.ref(temporary := Column((b,)))
        look(temporary)
        del temporary
        gc.collect()
        assert gone() is None
    assert state.layout.indices(kept, "x") is state.layout.indices(kept, "x")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_refused_by_name(value):
    with pytest.raises(InvalidStateError, match="features of b are not finite"):
        State.build({CUP("a"): {"x": 0.0, "full": 0.0}, CUP("b"): {"x": value, "full": 0.0}})


def test_wrong_features_sizes_and_names_are_refused():
    with pytest.raises(InvalidStateError, match="features"):
        State.build({CUP("a"): {"x": 0.0}})
    with pytest.raises(InvalidStateError, match="2 features"):
        State(Layout.of((CUP("a"),)), [1.0])
    with pytest.raises(InvalidStateError, match=r"\['a'\] occur twice"):
        Layout.of((CUP("a"), Type("mug")("a")))
    with pytest.raises(UnknownObjectError, match="unknown object 'z'"):
        Layout.of((CUP("a"),)).object("z")
