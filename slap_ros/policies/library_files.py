# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What libraries of learned policies are made of: files that are checked and never executed.

A policy is a file of safetensors, what is known of it a JSON object, a library a folder of both.
"""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load, save

from slap_ros.errors import InvalidLibraryError, InvalidParameterError
from slap_ros.files import (
    exchange,
    parse_json,
    pretty_json,
    read_bytes,
    read_text,
    require_writable,
)
from slap_ros.policies.activation import ACTIVATIONS
from slap_ros.policies.mlp_policy import MlpPolicy, ObservationNormalisation, Weights

ABOUT = "library.json"
CANNOT_EXCHANGE = {errno.ENOSYS, errno.EINVAL, errno.ENOTSUP}  # as some file systems say
SKILL, SHORTCUT = "skill.json", "shortcut.json"  # files with facts about a member, by its kind
TANH = "tanh"  # between the layers of PPO's and of clones
KINDS = {SKILL: "skills", SHORTCUT: "shortcuts"}

Member = TypeVar("Member")


def replace_folder(path: Path, write: Callable[[Path], None]) -> None:
    """Write a folder in place of the one that may be there.

    It is written beside it, and then both change places: there always is a whole one. Where the
    file system cannot do that, there is none for a moment, and a process that is killed then leaves
    the old one beside it, as ``.NAME.PID.old``.

    Args:
        path: Path of the folder.
        write: Function that fills the folder whose path it is given, which is empty.
    """
    path = path.resolve()
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f".{path.name}.{os.getpid()}.draft")
    shutil.rmtree(draft, ignore_errors=True)
    try:
        draft.mkdir()
        write(draft)
        if path.exists():
            _exchange(draft, path)
        else:
            draft.rename(path)
    finally:  # after Ctrl-C too
        shutil.rmtree(draft, ignore_errors=True)


def _exchange(draft: Path, path: Path) -> None:
    """Let two folders change places, one after the other where the file system has no other way."""
    try:
        exchange(draft, path)
    except OSError as error:
        if error.errno not in CANNOT_EXCHANGE:
            raise
        old = draft.with_suffix(".old")
        try:
            path.rename(old)
            draft.rename(path)
        finally:
            if old.exists() and not path.exists():
                old.rename(path)
            shutil.rmtree(old, ignore_errors=True)


def require_replaceable(path: Path, member: str, about: str = ABOUT) -> None:
    """Refuse a place where a library would replace something else, before it is made.

    Args:
        path: Path of the folder that the library is to have.
        member: Kind of the library's members: :data:`SKILL` or :data:`SHORTCUT`; empty for none.
        about: Name of the file that every such library has.

    Raises:
        InvalidParameterError: There is a file, or a folder with something that is no such library.
    """
    if path.is_file() or (path.is_dir() and any(path.iterdir()) and not (path / about).is_file()):
        raise InvalidParameterError(
            f"{path} is no library, and would be replaced by one; give a new or an empty folder"
        )
    if others := [kind for kind in KINDS if kind != member and any(path.glob(f"*/{kind}"))]:
        raise InvalidParameterError(
            f"{path} is a library of {KINDS[others[0]]}, and would be replaced by one of "
            f"{KINDS.get(member, 'another kind')}; give another folder"
        )


def require_places(library: Path, work: Path, member: str, about: str = ABOUT) -> None:
    """Check the places of a library and of the training that makes it, before it begins.

    Args:
        library: Path of the folder that the library is to have.
        work: Path of the folder for checkpoints.
        member: Kind of the library's members: :data:`SKILL` or :data:`SHORTCUT`; empty for none.
        about: Name of the file that every such library has.

    Raises:
        InvalidParameterError: The library would replace something else, or the checkpoints.
        OSError: Nothing can be written in one of them.
    """
    for place in (library, work):
        require_writable(place)
    require_replaceable(library, member, about)
    if library.resolve() in (work.resolve(), *work.resolve().parents):
        raise InvalidParameterError(
            f"checkpoints in {work} would be lost when the library in {library} is saved; give "
            "folders of which none is in the other"
        )


def write_library(
    path: Path,
    about: Mapping[str, Any],
    members: Mapping[str, Member],
    save_member: Callable[[Path, Member], None],
) -> None:
    """Write a library as a folder, in place of the one that may be there.

    Args:
        path: Path of the folder.
        about: Facts about the library: format, domain, how it was made.
        members: Members of the library, by the names of their folders.
        save_member: Function that writes a member into its folder.
    """

    def write(folder: Path) -> None:
        for name, member in members.items():
            save_member(folder / name, member)
        write_object(folder / ABOUT, about)

    replace_folder(path, write)


def policy_tensors(policy: MlpPolicy) -> dict[str, Weights]:
    """The arrays of a policy, by name."""
    tensors = {
        "normalisation.mean": policy.normalisation.mean,
        "normalisation.deviation": policy.normalisation.deviation,
        "log_std": policy.log_std,
    }
    for i, (weights, bias) in enumerate(policy.layers):
        tensors[f"layer{i}.weights"] = np.ascontiguousarray(weights)
        tensors[f"layer{i}.bias"] = np.ascontiguousarray(bias)
    return tensors


def run_as(policy: MlpPolicy) -> dict[str, Any]:
    """How a policy is run, where that is not as PPO's are: older libraries do not say it."""
    if (policy.activation, policy.squashed) == (TANH, False):
        return {}
    return {"activation": policy.activation, "squashed": policy.squashed}


def save_policy(path: Path, policy: MlpPolicy) -> dict[str, Any]:
    """Write a policy's tensors.

    Returns:
        What else there is to know of it, for the file beside it: how it is run, and a checksum.
    """
    content = save(policy_tensors(policy))
    path.write_bytes(content)
    return {**run_as(policy), "sha256": sha256(content).hexdigest()}


def load_policy(path: Path, about: Mapping[str, Any], recorded_in: str) -> MlpPolicy:
    """Read a policy.

    Args:
        path: Path of the file with its tensors.
        about: Content of the file beside it, with what :func:`save_policy` returned.
        recorded_in: Name of that file, for messages.

    Returns:
        The policy, its tensors of 32-bit floats that are finite and fit together.

    Raises:
        InvalidLibraryError: It is damaged.
    """
    beside = path.with_name(recorded_in)
    if not isinstance(checksum := about.get("sha256"), str):
        raise InvalidLibraryError(f"{beside}: damaged: it has no checksum (sha256)")
    if (activation := about.get("activation", TANH)) not in tuple(ACTIVATIONS):
        raise InvalidLibraryError(f"{beside}: damaged: its activation is {activation!r}")
    policy = _read_tensors(path, checksum, recorded_in)
    return replace(policy, activation=activation, squashed=bool(about.get("squashed", False)))


def _read_tensors(path: Path, checksum: str, recorded_in: str) -> MlpPolicy:
    """The policy of a file with this checksum, run as PPO's are."""
    try:
        content = read_bytes(path)
        tensors = load(content)
    except (OSError, SafetensorError) as error:
        raise InvalidLibraryError(f"{path}: cannot be read: {error}") from error
    except (KeyError, TypeError, ValueError) as error:  # of formats that numpy does not have
        raise InvalidLibraryError(f"{path}: a tensor of a kind unknown here: {error}") from error
    if odd := sorted(name for name, tensor in tensors.items() if tensor.dtype != np.float32):
        raise InvalidLibraryError(f"{path}: {', '.join(odd)[:80]}: not of 32-bit floats")
    if sha256(content).hexdigest() != checksum:
        raise InvalidLibraryError(f"{path}: damaged: its checksum is not the one in {recorded_in}")
    try:
        count = sum(name.endswith(".weights") for name in tensors)
        policy = MlpPolicy(
            ObservationNormalisation(
                tensors["normalisation.mean"], tensors["normalisation.deviation"]
            ),
            tuple((tensors[f"layer{i}.weights"], tensors[f"layer{i}.bias"]) for i in range(count)),
            tensors["log_std"],
        )
    except KeyError as error:
        raise InvalidLibraryError(f"{path}: tensor {error} is missing") from error
    _check(path, policy)
    return policy


def _check(path: Path, policy: MlpPolicy) -> None:
    """Refuse tensors that do not fit together or are not finite."""
    size = policy.normalisation.mean.shape
    fits = bool(policy.layers) and policy.normalisation.deviation.shape == size
    for weights, bias in policy.layers:
        fits = fits and weights.ndim == 2 and weights.shape[1:] == size
        size = bias.shape
        fits = fits and weights.shape[:1] == size
    if not fits or policy.log_std.shape != size:
        raise InvalidLibraryError(f"{path}: the shapes of its tensors do not fit together")
    if not all(np.isfinite(tensor).all() for tensor in policy_tensors(policy).values()):
        raise InvalidLibraryError(f"{path}: not all numbers in it are finite")


def read_about(path: Path, member: str, version: int, maker: str, remedy: str) -> dict[str, Any]:
    """Read the facts about a library, which are in its :data:`ABOUT`.

    Args:
        path: Path of the library's folder.
        member: Kind of the library's members: :data:`SKILL` or :data:`SHORTCUT`.
        version: Version of the format that is read.
        maker: Command that makes such a library.
        remedy: Advice for a library of another format, in words.

    Returns:
        Format, domain and how it was made.

    Raises:
        InvalidLibraryError: There is none, or it is damaged, of the other kind, or of another
            format.
    """
    if not path.is_dir():
        raise InvalidLibraryError(f"{path}: no such folder; `{maker}` makes one")
    if not (path / ABOUT).exists():
        raise InvalidLibraryError(f"{path}: no library, as it has no {ABOUT}; `{maker}` makes one")
    about = read_object(path / ABOUT)
    found = {kind for kind in KINDS if any(path.glob(f"*/{kind}"))}
    if found and member not in found:
        raise InvalidLibraryError(
            f"{path}: a library of {KINDS[found.pop()]}, not of {KINDS[member]}; `{maker}` makes "
            "one of these"
        )
    if about.get("format") != version:
        raise InvalidLibraryError(
            f"{path}: format {about.get('format')!r}, this version of slap_ros reads {version}; "
            f"{remedy} or use the version of slap_ros that made it"
        )
    if not isinstance(about.get("domain"), str):
        raise InvalidLibraryError(f"{path / ABOUT}: damaged: it names no domain")
    return about


def record_of(about: Mapping[str, Any]) -> dict[str, Any]:
    """The record of how a library was made, without its format and domain."""
    return {key: value for key, value in about.items() if key not in ("format", "domain")}


def read_members(
    path: Path, load: Callable[[Path], Member]
) -> tuple[tuple[Member, ...], tuple[InvalidLibraryError, ...]]:
    """Read the members of a library, in order of their folders' names.

    Args:
        path: Path of the library's folder.
        load: Function that reads a member's folder; a member that it refuses with an
            ``InvalidLibraryError`` is left out.

    Returns:
        What could be read, and why the rest could not.
    """
    members, refused = [], []
    for folder in sorted(entry for entry in path.iterdir() if entry.is_dir()):
        try:
            members.append(load(folder))
        except InvalidLibraryError as error:
            refused.append(error)
    return tuple(members), tuple(refused)


def read_object(path: Path) -> dict[str, Any]:
    """The JSON object in a file.

    Raises:
        InvalidLibraryError: There is none.
    """
    try:
        data = parse_json(read_text(path))
    except OSError as error:
        raise InvalidLibraryError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise InvalidLibraryError(f"{path}: damaged: {error}") from error
    if not isinstance(data, dict):
        raise InvalidLibraryError(f"{path}: damaged: a JSON object was expected")
    return data


def write_object(path: Path, data: Mapping[str, Any]) -> None:
    """Write a JSON object; the same bytes for the same data."""
    path.write_text(object_text(data), encoding="utf-8")


def object_text(data: Mapping[str, Any]) -> str:
    """The text of a JSON object; the same for the same data."""
    return pretty_json(data) + "\n"
