# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shortcut libraries on disk: a folder per shortcut, readable without torch, never a pickle.

::

    models/obstacle_tower/
      library.json               format, domain, preset, versions, the command that made it
      NothingOn_On-8fbd5384/
        shortcut.json            signature, shortest success, training record
        policy.safetensors       weights and normalisation

What is damaged is not used: a shortcut that cannot be read is refused with a reason, and the rest
of the library is used without it. A library of another domain or of a newer format is refused as
a whole.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load, save

from slap_ros.core import Domain
from slap_ros.errors import InvalidLibraryError
from slap_ros.files import parse_json, read_bytes, read_text
from slap_ros.shortcuts.mlp_policy import MlpPolicy, ObservationNormalisation, Weights
from slap_ros.shortcuts.observation_encoder import make_action_map, observation_size
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.signature import Signature

FORMAT = 1
MAX_SHORTEST = 1_000_000  # environment steps; attempts are a multiple of them long
LIBRARY, SHORTCUT, POLICY = "library.json", "shortcut.json", "policy.safetensors"

Record = Mapping[str, Any]


@dataclass(frozen=True)
class Library:
    """Shortcuts of a domain.

    Args:
        domain: Its name.
        shortcuts: Those that could be read, in order of their names.
        record: How the library was made.
        refused: Why the others were not read.
    """

    domain: str
    shortcuts: tuple[Shortcut, ...] = ()
    record: Record = field(default_factory=dict)
    refused: tuple[InvalidLibraryError, ...] = ()

    @property
    def digest(self) -> str:
        """What was learned, as 16 hexadecimal digits; empty where that is nothing."""
        if not self.shortcuts:
            return ""
        whole = sha256()
        for shortcut in self.shortcuts:
            whole.update(shortcut.name.encode() + save(_tensors(shortcut.policy)))
        return whole.hexdigest()[:16]


def save_library(path: Path, library: Library) -> None:
    """Write a library as a folder, in place of the one that may be there.

    It is written beside and then moved, so that there always is a whole one.
    """
    path = path.resolve()
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f".{path.name}.{os.getpid()}.draft")
    old = path.with_name(f".{path.name}.{os.getpid()}.old")
    shutil.rmtree(draft, ignore_errors=True)
    try:
        draft.mkdir()
        for shortcut in library.shortcuts:
            save_shortcut(draft / shortcut.name, shortcut)
        _write(draft / LIBRARY, {"format": FORMAT, "domain": library.domain, **library.record})
        if path.exists():
            path.rename(old)
        draft.rename(path)
    finally:  # after Ctrl-C too
        if old.exists() and not path.exists():
            old.rename(path)
        for left in (draft, old):
            shutil.rmtree(left, ignore_errors=True)


def load_library(path: Path, domain: Domain) -> Library:
    """Read a library.

    Raises:
        InvalidLibraryError: There is none, or it is damaged as a whole, newer than this version,
            or another domain's.
    """
    if not path.is_dir():
        raise InvalidLibraryError(
            f"{path}: no such folder; `slap train {domain.name}` makes a shortcut library"
        )
    about = _read(path / LIBRARY)
    if about.get("format") != FORMAT:
        raise InvalidLibraryError(
            f"{path}: format {about.get('format')!r}, this version of slap_ros reads {FORMAT}; "
            "train again or use the version of slap_ros that made it"
        )
    if about.get("domain") != domain.name:
        raise InvalidLibraryError(
            f"{path}: a library of domain {about.get('domain')!r}, not of {domain.name!r}"
        )
    shortcuts, refused = [], []
    for folder in sorted(entry for entry in path.iterdir() if entry.is_dir()):
        try:
            shortcut = load_shortcut(folder)
            _require_fit(shortcut, folder, domain)
            shortcuts.append(shortcut)
        except InvalidLibraryError as error:
            refused.append(error)
    record = {k: v for k, v in about.items() if k not in ("format", "domain")}
    return Library(domain.name, tuple(shortcuts), record, tuple(refused))


def _require_fit(shortcut: Shortcut, folder: Path, domain: Domain) -> None:
    """Refuse a policy whose observations or actions are not those of the domain."""
    features = observation_size(domain, shortcut.signature)
    size = shortcut.policy.normalisation.mean.size
    if features is not None and features != size:
        raise InvalidLibraryError(
            f"{folder}: the policy has {size} observed features, {domain.name} has {features}: "
            "learned with another version of slap_ros; train again"
        )
    actions = make_action_map(domain, shortcut.signature).size
    if shortcut.policy.log_std.size != actions:
        raise InvalidLibraryError(
            f"{folder}: the policy has {shortcut.policy.log_std.size} actions, shortcuts of this "
            f"kind in {domain.name} have {actions}"
        )


# -- one shortcut ---------------------------------------------------------------------------------


def save_shortcut(folder: Path, shortcut: Shortcut) -> None:
    """Write one shortcut into a folder, which is made where there is none."""
    folder.mkdir(parents=True, exist_ok=True)
    tensors = save(_tensors(shortcut.policy))
    _write(
        folder / SHORTCUT,
        {
            "signature": shortcut.signature.as_json(),
            "shortest": shortcut.shortest,
            "record": dict(shortcut.record),
            "sha256": sha256(tensors).hexdigest(),
        },
    )
    (folder / POLICY).write_bytes(tensors)


def load_shortcut(folder: Path) -> Shortcut:
    """Read one shortcut.

    Raises:
        InvalidLibraryError: It is damaged.
    """
    about = _read(folder / SHORTCUT)
    try:
        signature = Signature.from_json(about["signature"])
        shortest, record = int(about["shortest"]), dict(about["record"])
        checksum = str(about["sha256"])
        if not 1 <= shortest <= MAX_SHORTEST:
            raise ValueError(f"its shortest success has {shortest:.3g} steps")
    except (LookupError, TypeError, ValueError, OverflowError) as error:
        raise InvalidLibraryError(f"{folder / SHORTCUT}: damaged: {error!r}") from error
    if signature.name != folder.name:
        raise InvalidLibraryError(
            f"{folder}: the signature inside is that of {signature.name}; the folder was renamed "
            "or the file changed"
        )
    return Shortcut(signature, _load_policy(folder / POLICY, checksum), shortest, record)


def _tensors(policy: MlpPolicy) -> dict[str, Weights]:
    tensors = {
        "normalisation.mean": policy.normalisation.mean,
        "normalisation.deviation": policy.normalisation.deviation,
        "log_std": policy.log_std,
    }
    for i, (weights, bias) in enumerate(policy.layers):
        tensors[f"layer{i}.weights"] = np.ascontiguousarray(weights)
        tensors[f"layer{i}.bias"] = np.ascontiguousarray(bias)
    return tensors


def _load_policy(path: Path, checksum: str) -> MlpPolicy:
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
        raise InvalidLibraryError(f"{path}: damaged: its checksum is not the one in {SHORTCUT}")
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
    if not all(np.isfinite(tensor).all() for tensor in _tensors(policy).values()):
        raise InvalidLibraryError(f"{path}: not all numbers in it are finite")


# -- JSON -----------------------------------------------------------------------------------------


def _read(path: Path) -> dict[str, Any]:
    try:
        data = parse_json(read_text(path))
    except OSError as error:
        raise InvalidLibraryError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise InvalidLibraryError(f"{path}: damaged: {error}") from error
    if not isinstance(data, dict):
        raise InvalidLibraryError(f"{path}: damaged: a JSON object was expected")
    return data


def _write(path: Path, data: Mapping[str, Any]) -> None:
    path.write_text(json.dumps(data, indent=2, allow_nan=False) + "\n", encoding="utf-8")
