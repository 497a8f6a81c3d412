# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Any mesh as a solid: decomposed into convex pieces by CoACD, once.

X. Wei et al.: Approximate Convex Decomposition for 3D Meshes with Collision-Aware Concavity and
Tree Search, SIGGRAPH 2022.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np

from slap_ros.errors import InvalidMeshError, MeshUnavailableError
from slap_ros.files import read_bytes, read_text
from slap_ros.meshes.cache import cache_folder, store
from slap_ros.meshes.obj import from_obj, to_obj
from slap_ros.meshes.solid import Array, ConvexPiece, Solid

Y_IS_UP = (".glb", ".gltf")  # by their standard; of other files z is taken to be
TO_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
MAX_MESH_BYTES = 512 * 2**20
FORMAT = 1  # of cached files; with a new one, old files are no longer read


@dataclass(frozen=True)
class DecompositionSettings:
    """How closely convex pieces follow a mesh. Few are fast, and rest smoothly on surfaces."""

    threshold: float = 0.05  # 1, concavity that is tolerated, of a mesh of size 1
    pieces: int = 12  # at most
    vertices: int = 24  # of a piece, at most
    seed: int = 0  # of the search


DEFAULT_SETTINGS = DecompositionSettings()


def load_mesh(
    file: Path, size_m: float, settings: DecompositionSettings = DEFAULT_SETTINGS
) -> Solid:
    """A mesh, of whatever size in its file, as a solid of a given size that stands upright.

    The pieces are cached in the user's cache folder, by the content of the file and all that went
    into them; what is there is read without any library.

    Args:
        file: OBJ, GLB, STL, PLY or what else trimesh reads.
        size_m: Longest edge that the box around the solid is to have, m.
        settings: Settings that say how closely the pieces follow the mesh.

    Returns:
        The solid; its origin is its centre of mass.

    Raises:
        MeshUnavailableError: The file cannot be read, or a library for it is not installed.
        InvalidMeshError: There is no mesh in it, or it encloses no volume.
    """
    if not (math.isfinite(size_m) and size_m > 0.0):
        raise InvalidMeshError(f"the size of a mesh must be above 0 m, not {size_m}")
    try:
        content = read_bytes(file, MAX_MESH_BYTES)
    except OSError as error:
        raise MeshUnavailableError(f"{file} cannot be read: {error.strerror}") from error
    cached = cached_file(content, file.suffix.lower(), size_m, settings)
    if not cached.exists():
        store(cached, to_obj(_decomposed(file, size_m, settings)).encode())
    return Solid.of(from_obj(read_text(cached, MAX_MESH_BYTES)))


def cached_file(
    content: bytes, suffix: str, size_m: float, settings: DecompositionSettings = DEFAULT_SETTINGS
) -> Path:
    """Where the pieces of a mesh are cached.

    Args:
        content: Content of the mesh's file.
        suffix: Ending of the file's name, lower case, with its dot.
        size_m: Longest edge of the box around the mesh, m.
        settings: Settings that say how closely the pieces follow the mesh.

    Returns:
        A path that differs wherever any of these does.
    """
    key = repr((FORMAT, suffix, size_m, astuple(settings))).encode()
    digest = hashlib.blake2b(content, key=hashlib.blake2b(key).digest(), digest_size=16)
    return cache_folder() / f"{digest.hexdigest()}.obj"


def _decomposed(file: Path, size_m: float, settings: DecompositionSettings) -> list[ConvexPiece]:
    """The convex pieces of a file's mesh."""
    try:
        import coacd
        import trimesh
    except ImportError as error:
        raise MeshUnavailableError(
            f"to take {file.name} apart needs {error.name}; pip install 'slap_ros[meshes]'"
        ) from error
    try:
        mesh = trimesh.load(file, force="mesh")
    except (ValueError, TypeError, KeyError, IndexError, OSError) as error:  # as files are damaged
        raise InvalidMeshError(f"{file} cannot be read as a mesh: {error}") from error
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise InvalidMeshError(f"{file} has no faces, and so is no solid")
    vertices = np.asarray(mesh.vertices, dtype=np.float64)
    scaled = _placed(vertices, size_m, file.suffix.lower() in Y_IS_UP)
    coacd.set_log_level("error")
    found = coacd.run_coacd(
        coacd.Mesh(scaled, np.asarray(mesh.faces, dtype=np.int32)),
        threshold=settings.threshold,
        max_convex_hull=settings.pieces,
        decimate=True,
        max_ch_vertex=settings.vertices,
        seed=settings.seed,
    )
    return [
        ConvexPiece(tuple(map(tuple, points.tolist())), tuple(map(tuple, triangles.tolist())))
        for points, triangles in found
    ]


def _placed(vertices: Array, size_m: float, y_is_up: bool) -> Array:
    """Vertices in m, z up."""
    turned = vertices @ TO_Z_UP.T if y_is_up else vertices
    placed: Array = turned * (size_m / np.ptp(turned, axis=0).max())
    return placed
