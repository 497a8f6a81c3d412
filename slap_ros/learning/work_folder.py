# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Results of steps on disk, so that the same command continues where it was interrupted."""

from __future__ import annotations

import json
from collections.abc import Callable
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
