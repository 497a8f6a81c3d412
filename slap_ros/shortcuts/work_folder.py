# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a training keeps on disk, so that the same command continues where it was interrupted.

::

    runs/models/obstacle2d-training/
      settings.json              what the training is of
      explored.json, plans.json  results of its steps
      Clear_On-e41568a9/         a shortcut being learned
        starts.json
        progress.jsonl, tensorboard/, checkpoint0.pt
        finished                 exists once the shortcut is learned
        Clear_On-e41568a9/       the shortcut, as in a library
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from slap_ros.errors import InvalidParameterError
from slap_ros.files import parse_json, read_text, write_whole

Result = TypeVar("Result")
# What decoding raises where JSON is not what was written.
DECODING_ERRORS = (OSError, AttributeError, LookupError, TypeError, ValueError, OverflowError)


@dataclass(frozen=True)
class WorkFolder:
    """The results of a training's steps, each in a file of its own."""

    path: Path

    def cached(
        self, name: str, compute: Callable[[], Any], decode: Callable[[Any], Result]
    ) -> Result:
        """A result from the folder, or computed and put there.

        Args:
            name: Of the file, without its ending; may name a folder in front.
            compute: Makes the result as JSON.
            decode: Makes of the JSON what is returned.

        Returns:
            The result, decoded.

        Raises:
            InvalidParameterError: What is in the folder is damaged.
        """
        path = self.path / f"{name}.json"
        if not path.exists():
            data = compute()
            path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(path, json.dumps(data))
            return decode(data)
        try:
            return decode(parse_json(read_text(path)))
        except DECODING_ERRORS as error:
            raise InvalidParameterError(
                f"{path}: damaged: {error!r}; remove it to have it made again"
            ) from error


@dataclass(frozen=True)
class ShortcutWorkFolder:
    """The part of a work folder in which one shortcut is learned; made where there is none."""

    path: Path

    def __post_init__(self) -> None:
        self.path.mkdir(parents=True, exist_ok=True)

    @property
    def shortcut(self) -> Path:
        """What was learned, as in a library, where a folder is named after the signature."""
        return self.path / self.path.name

    def checkpoint(self, stage: int) -> Path:
        """The file with the state of PPO in a stage, which is counted from 0."""
        return self.path / f"checkpoint{stage}.pt"

    @property
    def finished(self) -> Path:
        """Exists once the shortcut is learned."""
        return self.path / "finished"

    @property
    def progress(self) -> Path:
        """A JSON object per line, one for each rollout."""
        return self.path / "progress.jsonl"

    def append(self, progress: Mapping[str, Any]) -> None:
        """Add a line to the progress; NaN, where there is no number yet, as null."""
        plain = {k: None if v != v else v for k, v in progress.items()}
        with self.progress.open("a", encoding="utf-8") as file:
            file.write(json.dumps(plain) + "\n")
