# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Names that are paths, and files that would like to be code: text to us, nothing else."""

import ast
import os
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
import rclpy
import yaml
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rosbags.rosbag2 import StoragePlugin, Writer
from slap_msgs.msg import DomainInfo, Task

from ensemble.interfaces import DOMAIN, TASK
from ensemble.spinner import Spinner
from recorder_node.node import RecorderNode
from slap_ros.bags import bag_info, evaluate_bag
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError, SlapError, UnknownDomainError
from slap_ros.shortcuts.shortcut_library import load_library
from support.rosbags_writer import write_messages
from support.truthful_run import Script, record

ROOT = Path(__file__).parents[2]
LIBRARY = ROOT / "test" / "shortcuts" / "data" / "obstacle2d"
LIMIT = 120.0  # s, far more than anything here takes
NAMES = ("../../elsewhere", "/etc/passwd", "..", "a/b", "os", "slap_ros.domains", "$(id)", "é\n{}")


def everything_in(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


@pytest.mark.parametrize("name", NAMES)
def test_a_domain_is_registered_or_is_none(name):
    with pytest.raises(UnknownDomainError):
        get_domain(name)
    with pytest.raises(InvalidParameterError):
        get_domain("obstacle2d", name)
    with pytest.raises(InvalidParameterError):
        get_domain("obstacle2d", f"fair:obstacles={name}")


@pytest.mark.parametrize("name", NAMES)
def test_a_recorder_writes_where_it_was_told_whatever_messages_say(network, tmp_path, name):
    bag = tmp_path / "here" / "bag"
    rclpy.init()
    executor, source = SingleThreadedExecutor(), rclpy.create_node("source")
    recorder = RecorderNode(parameter_overrides=[Parameter("bag", value=str(bag))])
    try:
        for node in (source, recorder):
            executor.add_node(node)
        for topic in (DOMAIN, TASK):
            publisher = source.create_publisher(topic.type, topic.name, topic.qos)
            message = DomainInfo(name=name, preset=name) if topic is DOMAIN else Task(domain=name)
            publisher.publish(message)
        assert Spinner(executor).spin_until(lambda: list(bag.glob("*.mcap")), LIMIT)
    finally:
        recorder.destroy_node()
        source.destroy_node()
        executor.shutdown()
        rclpy.shutdown()
    expected = ["here", "here/bag", "here/bag/bag_0.mcap", "here/bag/metadata.yaml"]
    assert everything_in(tmp_path) == expected
    assert bag_info(bag).metadata["domain"] == name


def test_a_bag_is_the_files_of_its_folder_whatever_its_metadata_name(tmp_path):
    script = Script(seed=7)
    script.run()
    record(tmp_path / "bag", script.messages)
    told = evaluate_bag(tmp_path / "bag")
    file = tmp_path / "bag" / "metadata.yaml"
    content = yaml.safe_load(file.read_text())
    content["rosbag2_bagfile_information"]["relative_file_paths"] = ["../other.mcap", "/etc/passwd"]
    file.write_text(yaml.safe_dump(content))
    found = evaluate_bag(tmp_path / "bag")
    assert replace(found, damage=None) == told
    assert "other.mcap, passwd is missing" in found.damage  # looked for in the folder alone


@pytest.mark.parametrize("tag", ["!!python/object/apply:os.system", "!!python/name:os.system"])
def test_metadata_is_no_program(tmp_path, tag):
    script = Script(seed=7)
    script.run()
    record(tmp_path / "bag", script.messages)
    (tmp_path / "bag" / "metadata.yaml").write_text(f"{tag} [touch {tmp_path}/done]\n")
    assert evaluate_bag(tmp_path / "bag").damage is not None
    assert not (tmp_path / "done").exists()


@pytest.mark.parametrize(
    "definition",
    [
        "int32 x=__import__('os').mkdir('DONE')\nint32 y\n",
        "string x=\"'+__import__('os').mkdir('DONE')+'\"\nint32 y\n",
        "int32 y\nint32 __import__('os').mkdir('DONE')\n",
        "int32 x):\n  __import__('os').mkdir('DONE')\n",
        "int32[<=__import__('os').mkdir('DONE')] y\n",
    ],
)
def test_a_message_definition_is_no_program(tmp_path, script, definition, monkeypatch):
    """Deserialisers are generated from the definitions that a bag brings along."""
    monkeypatch.chdir(tmp_path)
    hostile = "geometry_msgs/msg/Odd"
    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/odd", hostile, msgdef=definition, rihs01="RIHS01_0")
        writer.write(connection, 1, bytes(64))
        write_messages(writer, script.messages)
    assert evaluate_bag(tmp_path / "bag").runs[0].success
    assert everything_in(tmp_path) == ["bag", "bag/bag.mcap", "bag/metadata.yaml"]


def test_a_shortcut_does_not_choose_its_folder(tmp_path):
    library = tmp_path / "library"
    shutil.copytree(LIBRARY, library)
    (file,) = library.glob("*/shortcut.json")
    file.write_text(file.read_text().replace('"Clear"', '"../../../Clear"'))
    loaded = load_library(library, get_domain("obstacle2d"))
    assert loaded.shortcuts == ()
    assert len(loaded.refused) == 1


class Program:
    """Runs when it is unpickled."""

    def __init__(self, trace):
        self.trace = trace

    def __reduce__(self):
        return os.mkdir, (str(self.trace),)


def test_a_checkpoint_is_no_program(tmp_path):
    torch = pytest.importorskip("torch")
    from slap_ros.shortcuts.ppo import read_checkpoint

    torch.save({"steps": Program(tmp_path / "done")}, tmp_path / "stage0.pt")
    with pytest.raises(SlapError, match="damaged"):
        read_checkpoint(tmp_path / "stage0.pt")
    assert not (tmp_path / "done").exists()


# -- what is not in the code ----------------------------------------------------------------------

OURS = ("slap_ros", "ensemble", "embedded_ros/src", "launch", "benchmarks", *(
    f"{name}_node" for name in ("sim", "perception", "planner", "recorder")
), "skill_server", "robot_bridge")  # fmt: skip
DESERIALISERS = {"pickle", "cPickle", "dill", "cloudpickle", "joblib", "shelve", "marshal"}
LOADERS = {"eval", "exec", "load", "load_all", "unsafe_load", "unsafe_load_all"}
LOADERS |= {"full_load", "full_load_all"}
# Codecs and constructors, generated from installed ``.msg`` files.
GENERATED = {"embedded_ros/types/cdr.py", "embedded_ros/types/interfaces.py"}


def test_nothing_deserialises_code():
    files = [file for folder in OURS for file in (ROOT / folder).rglob("*.py")]
    assert len(files) > 200
    found = [
        f"{file.relative_to(ROOT)}:{node.lineno}: {reason}"
        for file in files
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if (reason := objection(node)) is not None
        and not (reason == "exec" and str(file).endswith(tuple(GENERATED)))
    ]
    assert found == []


def objection(node):
    """Why a piece of code must not be there; None for nearly all."""
    if isinstance(node, ast.Import | ast.ImportFrom):
        names = {alias.name for alias in node.names} | {getattr(node, "module", None)}
        return next(iter(names & DESERIALISERS), None)
    if not isinstance(node, ast.Call):
        return None
    if getattr(node.func, "attr", getattr(node.func, "id", None)) not in LOADERS:
        return None
    called = ast.unparse(node.func)
    options = {option.arg: ast.unparse(option.value) for option in node.keywords}
    if called in ("eval", "exec") and not all(isinstance(arg, ast.Constant) for arg in node.args):
        return called
    if called == "torch.load" and options.get("weights_only") != "True":
        return called
    if called in ("np.load", "numpy.load") and options.get("allow_pickle", "False") != "False":
        return called
    if called in ("yaml.load", "yaml.load_all") and options.get("Loader") != "_Loader":
        return called  # _Loader is a SafeLoader
    return called if called.startswith(("yaml.unsafe", "yaml.full")) else None
