# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Interface files: what is understood, and what is refused with package, file and line."""

from __future__ import annotations

import textwrap

import pytest

from embedded_ros.types import InterfaceError
from embedded_ros.types.model import FieldType, Shape
from embedded_ros.types.parser import parse_action, parse_message, parse_service

SOURCE = "slap_msgs/msg/Thing.msg"


def test_everything_a_message_may_hold() -> None:
    message = parse_message(
        "pkg/msg/Thing",
        textwrap.dedent(
            """\
            # a comment
            uint8 KIND_A=1      # a constant
            string NAME = "a # b"
            byte LOW=0x0f

            std_msgs/Header header
            Other other
            other_msgs/msg/Third[] thirds
            float64 x -1.5e-3   # m
            string<=5 label 'it\\'s'
            int32[3] triple [1, 2, 3]
            string[<=2] names ["a, b", 'c']
            bool on true
            char letter 65
            """
        ),
        SOURCE,
    )
    fields = {field.name: field for field in message.fields}
    constants = {constant.name: constant.value for constant in message.constants}
    assert constants == {"KIND_A": 1, "NAME": "a # b", "LOW": b"\x0f"}
    assert fields["other"].type == FieldType("pkg/msg/Other")
    assert fields["thirds"].type == FieldType("other_msgs/msg/Third", 0, Shape.SEQUENCE)
    assert fields["x"].default == -1.5e-3
    assert (fields["label"].type.string_bound, fields["label"].default) == (5, "it's")
    assert fields["triple"].default == (1, 2, 3)
    assert fields["names"].type == FieldType("string", 0, Shape.SEQUENCE, 2)
    assert fields["names"].default == ("a, b", "c")
    assert (fields["on"].default, fields["letter"].default) == (True, 65)


def test_services_and_actions_have_parts() -> None:
    service = parse_service("pkg/srv/Do", "int8 a\n---\n# nothing\n", SOURCE)
    assert [f.name for f in service.request.fields] == ["a"]
    assert service.response.full_name == "pkg/srv/Do_Response"
    action = parse_action("pkg/action/Go", "---\nuint16 error_code\n---\nGoal goal\n", SOURCE)
    assert action.goal.fields == ()
    assert action.feedback.fields[0].type.base == "pkg/msg/Goal"


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("int32", "expected a type and a name"),
        ("int33 a", "type 'int33' is unknown"),
        ("int32 A", "not lower_snake_case"),
        ("int32 a__b", "not lower_snake_case"),
        ("int32 class", "Python keyword"),
        ("int32 a\nint8 a", "'a' is defined twice"),
        ("int8 a 128", "128 does not fit into int8"),
        ("uint8 A=-1", "does not fit"),
        ("bool a maybe", "'maybe' is not a bool"),
        ("float64 a x", "'x' is not a float64"),
        ("int32 a 1.5", "is not a int32"),
        ("int32[2] a [1]", "1 default values for 2 elements"),
        ("int32[] a 1", r"is a \[list\]"),
        ("int32[0] a", "at least 1 element"),
        ("int32[<=] a", "needs a bound"),
        ("int32<=3 a", "only strings have a bound"),
        ("string<=2 a abc", "longer than 2 bytes"),
        ("string a 'abc", "not closed"),
        ("Other other 3", "has no default value"),
        ("int32 a=3", "not UPPER_SNAKE_CASE"),
        ("Other A=3", "single primitive value"),
        ("int32[ a", "malformed"),
    ],
)
def test_mistakes_are_located(text: str, complaint: str) -> None:
    with pytest.raises(InterfaceError, match=complaint) as error:
        parse_message("slap_msgs/msg/Thing", f"# first line\n{text}\n", SOURCE)
    line = 1 + len(text.splitlines())
    assert f"{SOURCE}:{line}: slap_msgs/msg/Thing: " in str(error.value)


@pytest.mark.parametrize("text", ["int32 a", "int32 a\n---\n---\n"])
def test_the_number_of_parts_is_checked(text: str) -> None:
    with pytest.raises(InterfaceError, match=r"'---' separators, expected 1"):
        parse_service("pkg/srv/Do", text, SOURCE)
