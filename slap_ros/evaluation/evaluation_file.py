# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An evaluation on disk: every trial, and what it was made from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.experiment import Trial
from slap_ros.evaluation.summary import Summary
from slap_ros.files import parse_json, pretty_json, read_text, write_whole
from slap_ros.versions import versions

FORMAT = "slap_ros evaluation"
VERSION = 1


def write_evaluation(
    path: Path,
    origin: Mapping[str, Any],
    results: Sequence[tuple[Summary, Sequence[Trial]]],
) -> None:
    """Write every trial of an evaluation, in place of an earlier file of the same evaluation.

    Args:
        path: Path of the file, which is JSON.
        origin: Facts about how the evaluation was made: command, settings, library, as JSON.
        results: Summary and trials of each approach, pure planning first.

    Raises:
        OSError: It cannot be written; what was there before is untouched.
    """
    data = {
        "format": FORMAT,
        "version": VERSION,
        **origin,
        "versions": dict(versions()),
        "approaches": [
            {**summary.as_row(), "trials": [trial.as_json() for trial in trials]}
            for summary, trials in results
        ],
    }
    write_whole(path, pretty_json(data) + "\n")


def require_replaceable(path: Path, command: str) -> None:
    """Check that a file may be replaced by an evaluation: there is none, or that of a command.

    Args:
        path: Path of the file.
        command: Command that makes the new evaluation.

    Raises:
        InvalidParameterError: It is another evaluation, or something else.
    """
    if not path.exists():
        return
    try:
        found = parse_json(read_text(path))
    except (OSError, ValueError) as error:
        raise InvalidParameterError(
            f"{path} exists and is no evaluation ({error}); name another file, or remove it"
        ) from error
    if not isinstance(found, dict) or found.get("format") != FORMAT:
        raise InvalidParameterError(
            f"{path} exists and is no evaluation; name another file, or remove it"
        )
    if found.get("command") != command:
        raise InvalidParameterError(
            f"{path} has the data of `{found.get('command')}`; name another file, or remove it"
        )
