# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters: declared, typed, constrained, served, and given on the command line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    ParameterEvent,
    ParameterType,
    SetParametersResult,
)
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy._rclpy_pybind11 import UnknownROSArgsError
from rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterAlreadyDeclaredException,
    ParameterImmutableException,
    ParameterNotDeclaredException,
    ParameterUninitializedException,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from conftest import TIMEOUT_S, Process, complete, spin_until

Run = Callable[..., Process]


@pytest.mark.parametrize(
    ("value", "kind"),
    [
        (True, Parameter.Type.BOOL),
        (1, Parameter.Type.INTEGER),
        (1.5, Parameter.Type.DOUBLE),
        ("a", Parameter.Type.STRING),
        ([True], Parameter.Type.BOOL_ARRAY),
        ([1, 2], Parameter.Type.INTEGER_ARRAY),
        ([1.0], Parameter.Type.DOUBLE_ARRAY),
        (["a"], Parameter.Type.STRING_ARRAY),
        ([b"\1"], Parameter.Type.BYTE_ARRAY),
    ],
)
def test_types_follow_values(node: Node, value: object, kind: Parameter.Type) -> None:
    parameter = node.declare_parameter("p", value)
    assert (parameter.type_, parameter.value) == (kind, value)
    assert Parameter.from_parameter_msg(parameter.to_parameter_msg()) == parameter


def test_static_typing(node: Node) -> None:
    node.declare_parameter("rate", 10.0)
    (result,) = node.set_parameters([Parameter("rate", value=10)])
    assert not result.successful
    assert "'rate' to '10' of type 'INTEGER', expecting type 'DOUBLE'" in result.reason
    assert node.get_parameter("rate").value == 10.0
    node.declare_parameter("any", 1, ParameterDescriptor(dynamic_typing=True))
    assert node.set_parameters([Parameter("any", value="text")])[0].successful
    assert node.get_parameter("any").value == "text"


def test_declaring(node: Node) -> None:
    node.declare_parameters("arm", [("speed", 1.0), ("name", "a", ParameterDescriptor())])
    assert node.get_parameter("arm.speed").value == 1.0
    assert set(node.get_parameters_by_prefix("arm")) == {"speed", "name"}
    with pytest.raises(ParameterAlreadyDeclaredException, match=r"arm\.speed"):
        node.declare_parameter("arm.speed", 2.0)
    for use in (node.get_parameter, node.undeclare_parameter, node.describe_parameter):
        with pytest.raises(ParameterNotDeclaredException, match="nothing"):
            use("nothing")
    with pytest.raises(ParameterNotDeclaredException):
        node.set_parameters([Parameter("nothing", value=1)])
    assert node.get_parameter_or("nothing", Parameter("nothing", value=7)).value == 7
    node.undeclare_parameter("arm.name")
    assert not node.has_parameter("arm.name")
    node.declare_parameter("later", Parameter.Type.INTEGER)
    with pytest.raises(ParameterUninitializedException, match="later"):
        node.get_parameter("later")
    assert node.set_parameters([Parameter("later", value=3)])[0].successful
    assert node.get_parameter("later").value == 3


def test_descriptors_constrain(node: Node) -> None:
    node.declare_parameter("fixed", 1, ParameterDescriptor(read_only=True))
    assert "read-only" in node.set_parameters([Parameter("fixed", value=2)])[0].reason
    with pytest.raises(ParameterImmutableException):
        node.undeclare_parameter("fixed")
    steps = IntegerRange(from_value=0, to_value=10, step=2)
    node.declare_parameter("even", 4, ParameterDescriptor(integer_range=[steps]))
    for value, successful in ((10, True), (5, False), (12, False), (-2, False)):
        assert node.set_parameters([Parameter("even", value=value)])[0].successful is successful
    unit = FloatingPointRange(from_value=0.0, to_value=1.0)
    with pytest.raises(InvalidParameterValueException, match=r"not in the range \[0.0, 1.0\]"):
        node.declare_parameter("unit", 1.5, ParameterDescriptor(floating_point_range=[unit]))
    assert node.describe_parameter("even").type == ParameterType.PARAMETER_INTEGER


def test_callbacks(node: Node) -> None:
    node.declare_parameter("a", 1)
    node.declare_parameter("b", 1)
    seen: list[str] = []

    def refuse_negative(parameters: list[Parameter]) -> SetParametersResult:
        good = all(not isinstance(p.value, int) or p.value >= 0 for p in parameters)
        return SetParametersResult(successful=good, reason="" if good else "negative")

    node.add_on_set_parameters_callback(refuse_negative)
    node.add_post_set_parameters_callback(lambda ps: seen.extend(p.name for p in ps))
    both = [Parameter("a", value=5), Parameter("b", value=-1)]
    result = node.set_parameters_atomically(both)
    assert (result.successful, result.reason) == (False, "negative")
    assert node.get_parameter("a").value == 1  # none of them
    assert [r.successful for r in node.set_parameters(both)] == [True, False]
    assert seen == ["a"]
    node.remove_on_set_parameters_callback(refuse_negative)
    assert node.set_parameters([Parameter("b", value=-1)])[0].successful


def test_overrides(context: None) -> None:
    overrides = [Parameter("rate", value=5.0), Parameter("extra", value=1)]
    with Node("n", parameter_overrides=overrides) as node:
        assert node.declare_parameter("rate", 1.0).value == 5.0
        assert not node.has_parameter("extra")
        assert node.declare_parameter("ignored", 1).value == 1
    with Node(
        "n", parameter_overrides=overrides, automatically_declare_parameters_from_overrides=True
    ) as node:
        assert node.get_parameter("extra").value == 1
    with (
        Node("n", parameter_overrides=[Parameter("rate", value=5)]) as node,
        pytest.raises(InvalidParameterTypeException) as error,
    ):
        node.declare_parameter("rate", 1.0)
    assert str(error.value) == (
        "Trying to set parameter 'rate' to '5' of type 'INTEGER', expecting type 'DOUBLE'"
    )


def test_an_empty_override_takes_the_declared_type(context: None) -> None:
    with Node("n", cli_args=["--ros-args", "-p", "xs:=[]"]) as node:
        assert node.declare_parameter("xs", [1.0]).value == []
        assert node.set_parameters([Parameter("xs", value=[2.0])])[0].successful


def test_changes_are_announced(node: Node) -> None:
    events: list[ParameterEvent] = []
    node.create_subscription(ParameterEvent, "/parameter_events", events.append, 10)
    node.declare_parameter("p", 1)
    node.set_parameters([Parameter("p", value=2)])
    node.undeclare_parameter("p")
    assert spin_until(node, lambda: len(events) == 3)
    assert [p.value.integer_value for p in events[0].new_parameters] == [1]
    assert [p.value.integer_value for p in events[1].changed_parameters] == [2]
    assert [p.name for p in events[2].deleted_parameters] == ["p"]
    assert events[0].node == "/tester"


def test_the_six_services(node: Node, run: Run) -> None:
    run("parametrized").wait_for_line("ready")

    def call(kind: type, name: str, request: object) -> object:
        client = node.create_client(kind, f"/parametrized/{name}")
        assert client.wait_for_service(TIMEOUT_S)
        return complete(node, client.call_async(request))

    listed = call(ListParameters, "list_parameters", ListParameters.Request())
    assert {"rate", "names", "count", "use_sim_time"} <= set(listed.result.names)
    types = call(
        GetParameterTypes,
        "get_parameter_types",
        GetParameterTypes.Request(names=["rate", "names", "no"]),
    )
    assert list(types.types) == [
        ParameterType.PARAMETER_DOUBLE,
        ParameterType.PARAMETER_STRING_ARRAY,
        ParameterType.PARAMETER_NOT_SET,
    ]
    described = call(
        DescribeParameters, "describe_parameters", DescribeParameters.Request(names=["rate"])
    )
    assert described.descriptors[0].name == "rate"
    good = Parameter("rate", value=20.0).to_parameter_msg()
    bad = Parameter("count", value="x").to_parameter_msg()
    unknown = Parameter("nothing", value=1).to_parameter_msg()
    results = call(
        SetParameters, "set_parameters", SetParameters.Request(parameters=[good, bad, unknown])
    ).results
    assert [r.successful for r in results] == [True, False, False]
    assert "expecting type 'INTEGER'" in results[1].reason
    good = Parameter("rate", value=30.0).to_parameter_msg()
    atomically = call(
        SetParametersAtomically,
        "set_parameters_atomically",
        SetParametersAtomically.Request(parameters=[good, bad]),
    )
    assert not atomically.result.successful
    got = call(GetParameters, "get_parameters", GetParameters.Request(names=["rate", "names"]))
    assert got.values[0].double_value == 20.0
    assert got.values[1].string_array_value == ["a", "b"]


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (
            "-p rate:=2.5 -p count:=7",
            "/parametrized {'rate': 2.5, 'names': ['a', 'b'], 'count': 7}",
        ),
        ("-p names:=[x,y]", "'names': ['x', 'y']"),
        ("-p rate:=1e3", "'rate': 1000.0"),
        ("-p parametrized:count:=8", "'count': 8"),
        ("-p other:count:=8", "'count': 3"),
        ("-r __node:=renamed -r __ns:=/slap", "/slap/renamed {"),
        ("-r parametrized:__node:=renamed -p renamed:count:=9", "/renamed {"),
        ("-p count:=1 -p count:=2", "'count': 2"),
        ("--params-file FILE", "{'rate': 3.5, 'names': ['f'], 'count': 11}"),
        ("--params-file FILE -p count:=12", "'count': 12"),
        ("-p count:=12 --params-file FILE", "'count': 11"),
        ("--params-file FILE -r __ns:=/deep", "'count': 13"),
        ("--log-level parametrized:=DEBUG --disable-rosout-logs --", "/parametrized {"),
    ],
)
def test_command_lines(run: Run, tmp_path: Path, arguments: str, expected: str) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text(
        "/**:\n  ros__parameters:\n    rate: 3.5\n    names: [wrong]\n"
        "parametrized:\n  ros__parameters: {names: [f], count: 11}\n"
        "/deep/parametrized:\n  ros__parameters: {count: 13}\n"
    )
    command = arguments.replace("FILE", str(file)).split()
    process = run("parametrized", "--ros-args", *command)
    process.wait_for_line(expected)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ("-p rate:=5", "'rate' to '5' of type 'INTEGER', expecting type 'DOUBLE'"),
        ("--no-such", "Found unknown ROS arguments: '--no-such'"),
        ("-p", "lacks its value"),
        ("-p rate=5", "is not of the form [node:]name:=value"),
        ("-r a", "is not of the form [node:]from:=to"),
        ("--params-file /no/such", "'/no/such' cannot be read"),
        ("--log-level LOUD", "'LOUD' is not one of DEBUG"),
        ("-r __node:=a/b", "Invalid node name"),
    ],
)
def test_wrong_command_lines_fail_with_one_clear_message(
    run: Run, arguments: str, complaint: str
) -> None:
    code, _, err = run("parametrized", "--ros-args", *arguments.split()).finish()
    assert code != 0
    assert complaint in err


def test_remapping(context: None) -> None:
    from std_msgs.msg import String
    from std_srvs.srv import Trigger

    arguments = "--ros-args -r state:=/robot/state -r ~/goal:=goals -r n:ask:=tell -r o:x:=y"
    with Node("n", namespace="slap", cli_args=arguments.split()) as node:
        names = {
            name: node.create_publisher(String, name, 1).topic_name
            for name in ("state", "~/goal", "~/other", "/absolute", "x", "{node}/t")
        }
        assert names == {
            "state": "/robot/state",
            "~/goal": "/slap/goals",
            "~/other": "/slap/n/other",
            "/absolute": "/absolute",
            "x": "/slap/x",
            "{node}/t": "/slap/n/t",
        }
        assert node.create_client(Trigger, "ask").srv_name == "/slap/tell"
        assert node.resolve_topic_name("state", only_expand=True) == "/slap/state"


def test_unknown_arguments_are_an_error(context: None) -> None:
    from rclpy.utilities import remove_ros_args

    arguments = ["prog", "a", "--ros-args", "-p", "x:=1", "--", "b"]
    assert remove_ros_args(arguments) == ["prog", "a", "b"]
    with pytest.raises(UnknownROSArgsError):
        Node("n", cli_args=["--ros-args", "x"])
