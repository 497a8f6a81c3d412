# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The interface package: every field explained, and codes that agree with the core's."""

import re
from importlib.resources import files

import pytest

from slap_ros.errors import ErrorCode, SlapError
from slap_ros.messages.typestore import typestore
from slap_ros.planning.options import OptionKind

INTERFACES = sorted(
    (
        entry
        for kind in ("msg", "srv", "action")
        for entry in files("msg_schemas").joinpath(kind).iterdir()
    ),
    key=lambda entry: entry.name,
)
# Keywords of C++, in which ROS 2 compiles the messages, that a field may well be called.
RESERVED = {
    "auto", "bool", "case", "catch", "char", "class", "const", "continue", "default", "delete",
    "do", "double", "else", "enum", "explicit", "export", "extern", "false", "float", "for",
    "friend", "goto", "if", "inline", "int", "long", "namespace", "new", "not", "operator", "or",
    "private", "protected", "public", "register", "requires", "return", "short", "signed", "static",
    "struct", "switch", "template", "this", "throw", "true", "try", "union", "unsigned", "using",
    "virtual", "void", "volatile", "while",
}  # fmt: skip
OBVIOUS = {"Header header", "uint32 episode", "uint32 replans", "uint32 graph_edges"}


def test_error_codes_are_those_of_the_message():
    text = files("msg_schemas").joinpath("msg/ErrorCode.msg").read_text()
    assert dict(re.findall(r"uint16 (\w+)=(\d+)", text)) == {
        code.name: str(int(code)) for code in ErrorCode
    }


def test_every_cause_has_one_exception_and_fits_an_exit_code():
    # A subclass of one of these refines a cause and keeps its code.
    codes = [kind.code for kind in SlapError.__subclasses__()]
    assert len(set(codes)) == len(codes)
    assert all(0 <= code <= 255 for code in ErrorCode)


def test_kinds_agree_with_the_core():
    edge = typestore().types["slap_msgs/msg/PlanEdge"]
    assert tuple(kind.value for kind in OptionKind) == (edge.OPERATOR, edge.SHORTCUT)


@pytest.mark.parametrize("interface", INTERFACES, ids=lambda entry: entry.name)
def test_numbers_say_their_unit_or_meaning(interface):
    """Every number has a comment; so does the interface as a whole."""
    lines = interface.read_text().splitlines()
    assert lines[2].startswith("# ") or lines[3].startswith("# ")
    for line in lines:
        if re.match(r"(u?int|float)\d+(\[\])? \w+ *$", line):
            assert line.strip() in {"uint8 kind", "uint8 phase", *OBVIOUS} or "episode" in line, (
                line
            )


@pytest.mark.parametrize("interface", INTERFACES, ids=lambda entry: entry.name)
def test_no_field_has_a_name_that_does_not_compile(interface):
    fields = re.findall(
        r"^[\w/]+(?:\[\d*\])? +(\w+) *(?:#.*)?$", interface.read_text(), re.MULTILINE
    )
    assert fields or interface.name == "ErrorCode.msg"
    assert not RESERVED & set(fields)
