# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Libraries of skills that ``slap/skills`` announces, as far as this node may open them.

Anybody on the network can send a path. So a message only points at a folder: the node's parameter
says below which folders it may lie, and the library that is found there says what it is.
"""

from __future__ import annotations

import os
from collections import OrderedDict
from pathlib import Path

from slap_msgs.msg import SkillLibrary

from slap_ros.errors import InvalidLibraryError
from slap_ros.learning.grown_libraries import GrownLibraries

KEPT = 32  # folders: those that were announced last


class AnnouncedLibraries:
    """Folders of libraries that were announced and may be opened."""

    def __init__(self, allowed: str) -> None:
        """Know of none yet.

        Args:
            allowed: Folders below which a library may lie, separated as in ``PATH``.
        """
        self._allowed = [Path(part).resolve() for part in allowed.split(os.pathsep) if part]
        self._digests: OrderedDict[tuple[str, Path], str] = OrderedDict()  # by domain and folder

    def add(self, message: SkillLibrary) -> bool:
        """Take note of a library.

        Args:
            message: Announces it.

        Returns:
            Whether anything new was said.

        Raises:
            InvalidLibraryError: It lies elsewhere than it may, or is no library of its domain.
        """
        folder = self._permitted(message.folder)
        key = message.domain, folder
        if self._digests.get(key) == message.digest:
            return False
        if key not in self._digests:
            _require_library(folder, message.domain)
        self._digests[key] = message.digest
        self._digests.move_to_end(key)
        if len(self._digests) > KEPT:
            self._digests.popitem(last=False)
        return True

    def folders(self, domain: str, digest: str = "") -> list[Path]:
        """Folders of a domain's libraries, the newest first.

        Args:
            domain: Name of the domain.
            digest: Digest of the library that is wanted: folders announced with it come first.
                The others follow, since an announcement may be wrong.
        """
        newest = [key for key in reversed(self._digests) if key[0] == domain]
        return [folder for _, folder in sorted(newest, key=lambda k: self._digests[k] != digest)]

    def shortcuts(self, domain: str, digest: str) -> Path | None:
        """The folder of what ``slap grow`` left beside the skills that were announced last.

        Args:
            domain: Name of the domain.
            digest: Digest of the skills.

        Returns:
            The folder; None where these skills were not announced, or nothing is beside them.
        """
        announced = (key for key in reversed(self._digests) if self._digests[key] == digest)
        folders = (
            GrownLibraries.with_skills(at).shortcuts for name, at in announced if name == domain
        )
        for beside in map(Path.resolve, folders):
            if self._may_open(beside) and beside.is_dir():
                return beside
        return None

    def _may_open(self, folder: Path) -> bool:
        return any(folder.is_relative_to(root) for root in self._allowed)

    def _permitted(self, name: str) -> Path:
        try:
            folder = Path(name).resolve()
        except (OSError, ValueError) as error:  # such as a zero byte
            raise InvalidLibraryError(f"{name!r} is no path: {error}") from error
        if not self._may_open(folder):
            below = os.pathsep.join(map(str, self._allowed)) or "none"
            raise InvalidLibraryError(
                f"{folder}: announced libraries are opened below {below} only; parameter libraries "
                "allows others"
            )
        return folder


def _require_library(folder: Path, domain: str) -> None:
    from slap_ros.skills.skill_library import read_library_record  # only where one is announced

    found = read_library_record(folder)["domain"]
    if found != domain:
        raise InvalidLibraryError(f"{folder}: skills of domain {found!r}, not of {domain!r}")
