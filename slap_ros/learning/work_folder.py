# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Results of steps on disk, so that the same command continues where it was interrupted."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from slap_ros.errors import InvalidParameterError
from slap_ros.files import parse_json, read_text, write_whole

SETTINGS = "settings"  # name of the file that says whose results a folder has
Result = TypeVar("Result")
# Errors that decoding raises where JSON is not what was written.
DECODING_ERRORS = (OSError, AttributeError, LookupError, TypeError, ValueError, OverflowError)


def damaged(path: Path | str, what: Exception | str, advice: str) -> InvalidParameterError:
    """The error for a file that is not as it was written.

    Args:
        path: Path of the file, maybe with the place in it.
        what: Description of what is wrong with the file, or the error that it caused.
        advice: Advice for the reader of the message, in words.
    """
    what = repr(what) if isinstance(what, Exception) else what
    return InvalidParameterError(f"{path}: damaged: {what}; {advice}")


@dataclass(frozen=True)
class WorkFolder:
    """The results of a training's steps, each in a file of its own."""

    path: Path

    def cached(
        self,
        name: str,
        compute: Callable[[], Any],
        decode: Callable[[Any], Result],
        advice: str = "remove it to have it made again",
    ) -> Result:
        """A result from the folder, or computed and put there.

        Args:
            name: Name of the result's file, without its ending; a folder may precede it.
            compute: Function that computes the result, as JSON.
            decode: Function that converts the JSON into the result.
            advice: Advice where the file is damaged.

        Returns:
            The result, decoded.

        Raises:
            InvalidParameterError: What is in the folder is damaged.
        """
        path = self.path / f"{name}.json"
        if not path.exists():
            data = compute()
            write_whole(path, json.dumps(data))
            return decode(data)
        try:
            return decode(parse_json(read_text(path)))
        except DECODING_ERRORS as error:
            raise damaged(path, error, advice) from error

    def require_same(self, settings: Mapping[str, Any]) -> None:
        """Refuse a folder with another training; an empty one becomes this one's.

        Args:
            settings: Settings that the results depend on, as JSON.

        Raises:
            InvalidParameterError: The folder has another training, or is damaged.
        """
        own = json.loads(json.dumps(settings))
        advice = "give another folder, or remove this one: nobody knows what is in it"
        if self.cached(SETTINGS, lambda: own, lambda theirs: theirs, advice) != own:
            raise InvalidParameterError(
                f"{self.path} has a training with other settings; give another folder, or remove "
                "this one"
            )
