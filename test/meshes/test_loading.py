# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Meshes from files and from Objaverse: taken apart, kept, and refused with reasons."""

import sys
from types import SimpleNamespace
from urllib.error import URLError

import pytest

from slap_ros.domains.cleanup_table.shapes import make
from slap_ros.errors import InvalidMeshError, MeshUnavailableError
from slap_ros.meshes.cache import cache_folder, store
from slap_ros.meshes.decomposition import DecompositionSettings, cached_file, load_mesh
from slap_ros.meshes.obj import to_obj
from slap_ros.meshes.objaverse import load_objaverse
from slap_ros.meshes.solid import Solid

ROUGH = DecompositionSettings(threshold=0.3, pieces=6)  # quick
IDENTIFIER = "0123456789abcdef0123456789abcdef"
PIECES = make.duck()
DUCK = Solid.of(PIECES)


@pytest.fixture(autouse=True)
def cache(monkeypatch, tmp_path):
    """An empty one."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def without_libraries(monkeypatch):
    for name in ("coacd", "trimesh", "objaverse"):
        monkeypatch.setitem(sys.modules, name, None)


def test_a_mesh_that_is_not_convex_comes_apart_and_is_kept(tmp_path, monkeypatch):
    pytest.importorskip("coacd")
    trimesh = pytest.importorskip("trimesh")
    file = tmp_path / "ring.glb"
    trimesh.creation.torus(3.0, 1.0, major_sections=12, minor_sections=8).export(file)
    solid = load_mesh(file, 0.08, ROUGH)
    assert len(solid.pieces) > 2
    x, y, z = (2 * half for half in solid.bounds.half)
    assert max(x, y, z) == pytest.approx(0.08, rel=0.03)
    assert y == pytest.approx(0.02, rel=0.1)  # y is up in the file, z here: it stands on its edge
    for name in ("coacd", "trimesh"):
        monkeypatch.setitem(sys.modules, name, None)
    assert load_mesh(file, 0.08, ROUGH) == solid
    with pytest.raises(MeshUnavailableError):
        load_mesh(file, 0.09, ROUGH)  # is another mesh


def test_what_is_kept_is_found_by_content_without_any_library(tmp_path, without_libraries):
    store(cached_file(b"a duck", ".obj", 0.08), to_obj(PIECES).encode())
    file = tmp_path / "any name.OBJ"
    file.write_bytes(b"a duck")
    assert load_mesh(file, size_m=0.08) == DUCK
    file.write_bytes(b"another duck")
    with pytest.raises(MeshUnavailableError, match=r"slap_ros\[meshes\]"):
        load_mesh(file, size_m=0.08)


def test_no_file_and_no_size_are_told_apart(tmp_path):
    with pytest.raises(MeshUnavailableError, match="No such file"):
        load_mesh(tmp_path / "none.glb", size_m=0.1)
    for size in (0.0, -1.0, float("nan")):
        with pytest.raises(InvalidMeshError, match="size"):
            load_mesh(tmp_path / "none.glb", size_m=size)


def test_a_damaged_file_is_refused(tmp_path):
    pytest.importorskip("coacd")
    damaged = tmp_path / "damaged.glb"
    damaged.write_bytes(b"glTF, or so it says")
    with pytest.raises(InvalidMeshError, match=r"damaged\.glb"):
        load_mesh(damaged, size_m=0.1)


def test_objaverse_objects_that_are_here_need_no_network(without_libraries):
    store(cache_folder() / "objaverse" / f"{IDENTIFIER}.glb", b"downloaded before")
    store(cached_file(b"downloaded before", ".glb", 0.07), to_obj(PIECES).encode())
    assert load_objaverse(IDENTIFIER, size_m=0.07) == DUCK


def test_objaverse_says_what_is_missing(monkeypatch, without_libraries):
    with pytest.raises(InvalidMeshError, match="hexadecimal"):
        load_objaverse("../../etc/passwd", size_m=0.07)
    with pytest.raises(MeshUnavailableError, match=r"slap_ros\[meshes\].*" + IDENTIFIER):
        load_objaverse(IDENTIFIER, size_m=0.07)

    def unreachable(uids):
        raise URLError("Name or service not known")

    def unknown(uids):
        raise KeyError(uids[0])

    for load, message in ((unreachable, "try again with a network"), (unknown, "has no object")):
        monkeypatch.setitem(sys.modules, "objaverse", SimpleNamespace(load_objects=load))
        with pytest.raises(MeshUnavailableError, match=message):
            load_objaverse(IDENTIFIER, size_m=0.07)
    assert not (cache_folder() / "objaverse").exists()
