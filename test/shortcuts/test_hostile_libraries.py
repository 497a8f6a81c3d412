# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shortcuts that are none: each is left out with a reason, and the rest of a library is used."""

import json
import shutil
import struct
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load, save

from slap_ros.domains import get_domain
from slap_ros.errors import InvalidLibraryError, InvalidParameterError
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.shortcuts.signature import Signature
from slap_ros.studies.slap.trainings import TrainingFolder

DATA = Path(__file__).parent / "data" / "obstacle2d"
DOMAIN = get_domain("obstacle2d")
# As safetensors has them, with bytes per element; numpy has no such types, or others are meant.
KINDS = {"BF16": 2, "F8_E5M2": 1, "F8_E4M3": 1, "F4": 0.5, "F16": 2, "F64": 8, "I32": 4, "BOOL": 1}
DEEP = "[" * 200_000


@pytest.fixture
def library(tmp_path):
    return shutil.copytree(DATA, tmp_path / "library")


def left_out(library):
    """The reason for which the only shortcut is not used."""
    loaded = load_library(library, DOMAIN)
    assert loaded.shortcuts == ()
    (reason,) = loaded.refused
    return str(reason)


def rewrite(library, change):
    """Change what a shortcut says of itself, and name its folder accordingly."""
    (file,) = library.glob("*/shortcut.json")
    about = json.loads(file.read_text())
    change(about)
    file.write_text(json.dumps(about))
    try:
        name = Signature.from_json(about["signature"]).name
    except (LookupError, TypeError, ValueError):
        return
    file.parent.rename(library / name)


def with_role(number):
    def change(about):
        about["signature"]["roles"] += ["block()"] * number

    return change


def with_value(path, value):
    def change(about):
        *way, last = path.split(".")
        for key in way:
            about = about[key]
        about[last] = value

    return change


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (with_role(1), "atoms are about"),
        (with_role(50), "atoms are about"),
        (lambda about: about["signature"].update(roles=[], add=[], delete=[]), "no atom"),
        (with_value("signature.add", [["On", [99]]]), "a role that is not"),
        (with_value("signature.add", [["On", [-1]]]), "a role that is not"),
        (with_value("signature.add", [["On"]]), "damaged"),
        (with_value("signature", []), "damaged"),
        (with_value("shortest", 0), "shortest"),
        (with_value("shortest", 10**400), "damaged"),
        (with_value("shortest", 1e308), "shortest"),
        (with_value("horizon", 0), "tried out"),
        (with_value("record", [1]), "damaged"),
        (with_value("activation", "sinh"), "activation"),
    ],
)
def test_a_shortcut_that_says_odd_things_of_itself(library, change, why):
    rewrite(library, change)
    assert why in left_out(library)


@pytest.mark.parametrize("kind", KINDS)
def test_a_tensor_of_another_kind(library, kind):
    (file,) = library.glob("*/policy.safetensors")
    tensors = load(file.read_bytes())
    header, data = {}, b""
    for name, tensor in tensors.items():
        size = int(np.ceil(tensor.size * KINDS[kind]))
        header[name] = {
            "dtype": kind,
            "shape": list(tensor.shape),
            "data_offsets": [len(data), len(data) + size],
        }
        data += bytes(size)
    text = json.dumps(header).encode()
    content = struct.pack("<Q", len(text)) + text + data
    file.write_bytes(content)
    rewrite(library, with_value("sha256", sha256(content).hexdigest()))
    assert "policy.safetensors" in left_out(library)


def test_one_tensor_of_another_kind(library):
    (file,) = library.glob("*/policy.safetensors")
    tensors = load(file.read_bytes())
    content = save(tensors | {"log_std": tensors["log_std"].astype(np.float64)})
    file.write_bytes(content)
    rewrite(library, with_value("sha256", sha256(content).hexdigest()))
    assert "log_std" in left_out(library)


@pytest.mark.parametrize("text", [DEEP, f'{{"signature": {DEEP}', '{"a":' * 200_000])
def test_json_nested_without_end(library, text):
    (file,) = library.glob("*/shortcut.json")
    file.write_text(text)
    assert "nested too deep" in left_out(library)
    (library / "library.json").write_text(text)
    with pytest.raises(InvalidLibraryError, match="nested too deep"):
        load_library(library, DOMAIN)


@pytest.mark.parametrize(
    "text", [DEEP, "[[]]", "[{}]", "{}", "[null]", '[{"candidates": 1}]', "1e999"]
)
def test_a_work_folder_with_odd_results(tmp_path, text):
    for name in ("settings", "explored"):
        (tmp_path / f"{name}.json").write_text(text)
    for read in (TrainingFolder(tmp_path).explored, TrainingFolder(tmp_path).exploration):
        try:
            assert read() == ()  # nothing explored, where that is what it says
        except InvalidParameterError as error:
            assert "damaged" in str(error)


@pytest.mark.parametrize(
    "decode",
    [lambda data: data[5], lambda data: data["a"], lambda data: data.a, lambda data: int(data[0])],
)
def test_a_result_that_cannot_be_decoded_is_damaged(tmp_path, decode):
    (tmp_path / "plans.json").write_text("[1e999]")
    with pytest.raises(InvalidParameterError, match="damaged"):
        WorkFolder(tmp_path).cached("plans", dict, decode)


def test_a_library_of_skills_is_refused():
    skills = Path(__file__).parents[2] / "models" / "skills" / "stow_hammer"
    with pytest.raises(InvalidLibraryError, match="a library of skills, not of shortcuts"):
        load_library(skills, get_domain("stow_hammer"))
