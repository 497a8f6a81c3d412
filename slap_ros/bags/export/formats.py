# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The formats that episodes are exported to, and what is refused before any is written."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from slap_ros.bags.episode_arrays import EpisodeArrays
from slap_ros.bags.export.csv_file import write_csv
from slap_ros.bags.export.lerobot_dataset import write_lerobot
from slap_ros.bags.export.npz_file import write_npz
from slap_ros.bags.export.parquet_file import write_parquet
from slap_ros.errors import InvalidParameterError, StorageFullError
from slap_ros.files import draft_beside, require_writable


@dataclass(frozen=True)
class ExportFormat:
    """A format of other tools, and what writes it.

    Args:
        name: Name of the format.
        ending: Ending of its files; empty for a folder.
        write: Writes episodes to a name that is free.
        needs_pyarrow: Whether it takes pyarrow.
    """

    name: str
    ending: str
    write: Callable[[Path, Sequence[EpisodeArrays]], None]
    needs_pyarrow: bool = False


FORMATS: Mapping[str, ExportFormat] = {
    form.name: form
    for form in (
        ExportFormat("npz", ".npz", write_npz),
        ExportFormat("csv", ".csv", write_csv),
        ExportFormat("parquet", ".parquet", write_parquet, needs_pyarrow=True),
        ExportFormat("lerobot", "", write_lerobot, needs_pyarrow=True),
    )
}


def choose_format(name: str | None, output: Path) -> ExportFormat:
    """The format of a name, or else the one that an output's ending stands for.

    Args:
        name: Name of the format; None where none was given.
        output: File or folder to write.

    Raises:
        InvalidParameterError: There is no such format, or the output has the ending of another.
    """
    known = ", ".join(FORMATS)
    if name is None:
        for form in FORMATS.values():
            if form.ending and form.ending == output.suffix:
                return form
        raise InvalidParameterError(f"{output.name} does not tell a format; name one of {known}")
    if name not in FORMATS:
        raise InvalidParameterError(f"there is no format {name!r}; name one of {known}")
    form = FORMATS[name]
    if form.ending and output.suffix != form.ending:
        raise InvalidParameterError(
            f"a {name} export is a file that ends in {form.ending}, not {output.name!r}"
        )
    return form


def require_exportable(form: ExportFormat, output: Path) -> None:
    """Refuse a place, or a format, before anything is read.

    Raises:
        InvalidParameterError: There is something at the output, or pyarrow is not installed.
        OSError: Nothing can be written there.
    """
    if output.exists():
        raise InvalidParameterError(f"{output} exists; choose another name or remove it")
    if form.needs_pyarrow and find_spec("pyarrow") is None:
        raise InvalidParameterError(
            f"{form.name} needs pyarrow, which is not installed: pip install 'slap_ros[export]'"
        )
    require_writable(output)


def export_episodes(episodes: Sequence[EpisodeArrays], output: Path, form: ExportFormat) -> None:
    """Write episodes to a new file or folder, all of it or nothing.

    Args:
        episodes: At least one.
        output: File or folder, at which there is nothing yet.
        form: The format.

    Raises:
        InvalidParameterError: The format cannot hold these episodes.
        StorageFullError: It cannot be written; nothing is left behind.
    """
    try:
        with draft_beside(output) as draft:
            form.write(draft, episodes)
    except OSError as error:
        raise StorageFullError(f"cannot write {output}: {error.strerror or error}") from error
