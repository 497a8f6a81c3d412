# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading what somebody else may have written: regular files of a stated size, bounded nesting.

A name may stand for a pipe that nobody writes to, a device without end, a file that claims
terabytes. Whatever is read goes through here, so that reading ends, and in bounded memory. What is
written goes through here where another process may read or write it meanwhile.
"""

from __future__ import annotations

import ctypes
import errno
import fcntl
import json
import os
import shutil
import stat
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from slap_ros.errors import BusyError

if TYPE_CHECKING:
    import yaml

MAX_BYTES = 64 * 2**20  # of a file that is read at once, where its reader states no other limit
JSON_LINE = 1000  # characters, beside the indentation: what fits, as most trials do, is not broken
MAX_YAML_INTEGER = 100  # characters; Python prints no integer of more than 4,300 digits
MAX_YAML_DEPTH = 100  # collections within collections; document and stream count as well
MAX_YAML_NODES = 200_000  # with what is repeated by reference counted as often as it is repeated
# What PyYAML raises where a scalar is not of the kind that its tag says, beside its own errors.
SCALAR_ERRORS = (RecursionError, LookupError, TypeError, AttributeError)
AT_FDCWD, RENAME_EXCHANGE = -100, 2  # of Linux: <fcntl.h>, <linux/fs.h>
KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def user_cache(name: str) -> Path:
    """``slap_ros/NAME`` in the user's cache folder; it may not exist yet."""
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "slap_ros" / name


def open_regular(path: Path) -> BinaryIO:
    """Open a regular file for reading, without waiting.

    Raises:
        OSError: It cannot be opened, or is a folder, pipe, device or socket.
    """
    # Without O_NONBLOCK, opening a pipe waits until somebody writes to it.
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    kind = stat.S_IFMT(os.fstat(descriptor).st_mode)
    if kind != stat.S_IFREG:
        os.close(descriptor)
        found = KINDS.get(kind, "no regular file")
        raise OSError(errno.EINVAL, f"{found}, where a file is expected", str(path))
    return os.fdopen(descriptor, "rb")


def require_regular(path: Path) -> None:
    """Refuse what :func:`open_regular` refuses, for readers that open files themselves.

    Raises:
        OSError: As there.
    """
    open_regular(path).close()


def require_writable(path: Path) -> None:
    """Check that a file or folder of a name can be made or written, before there is what to write.

    Raises:
        OSError: Something is in its place that is neither file nor folder, or nothing can be
            written there.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise OSError(errno.EINVAL, "neither a file nor a folder", str(path))
    if path.is_file() and not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
    there = path if path.is_dir() else path.absolute().parent
    while not there.exists():
        there = there.parent
    try:
        with tempfile.TemporaryFile(dir=there):
            return  # where there is no right, root may pass every other test
    except OSError as error:
        # The name of the trial file is of no use to anybody.
        raise OSError(error.errno, os.strerror(error.errno or errno.EIO), str(path)) from error


def require_writable_folder(path: Path) -> None:
    """Check the same for a folder alone.

    Raises:
        OSError: As :func:`require_writable`, or there is a file in its place.
    """
    if path.is_file():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(path))
    require_writable(path)


def reason_of(error: Exception) -> str:
    """Why a file cannot be read or written, without its name, which errors of Python begin with."""
    return getattr(error, "strerror", None) or str(error)


def read_bytes(path: Path, limit: int = MAX_BYTES) -> bytes:
    """The content of a regular file.

    Args:
        path: Path of the file.
        limit: Largest size of the file, bytes.

    Returns:
        All of it.

    Raises:
        OSError: It cannot be read, is no regular file, or is larger.
    """
    with open_regular(path) as file:
        # What the file claims is looked at first, then what it has: it may grow meanwhile.
        claimed = os.fstat(file.fileno()).st_size
        content = file.read(limit + 1) if claimed <= limit else b""
    if max(claimed, len(content)) > limit:
        complaint = f"larger than {limit / 2**20:.0f} MiB, the most that is read of such a file"
        raise OSError(errno.EFBIG, complaint, str(path))
    return content


def read_text(path: Path, limit: int = MAX_BYTES) -> str:
    """The text of a regular file in UTF-8, its lines ended as Python has it.

    Args:
        path: Path of the file.
        limit: Largest size of the file, bytes.

    Returns:
        The text.

    Raises:
        OSError: See :func:`read_bytes`.
        UnicodeDecodeError: It is not UTF-8.
    """
    text = read_bytes(path, limit).decode("utf-8")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file, text in UTF-8: at every moment there is the old one, or the new one, whole.

    Args:
        path: Path of the file; missing folders are made.
        content: All that the file is to have.

    Raises:
        OSError: It cannot be written, and names the file; the old one is untouched.
    """
    draft = path.with_name(f".{path.name}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        draft.write_bytes(content.encode() if isinstance(content, str) else content)
        draft.replace(path)
    except OSError as error:  # a full disk names no file
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:  # after Ctrl-C too
        with suppress(OSError):
            draft.unlink(missing_ok=True)


@contextmanager
def draft_beside(path: Path) -> Iterator[Path]:
    """A name beside a new file or folder, which takes its place once it is whole.

    Args:
        path: Name of the new file or folder; missing parents are made.

    Yields:
        A free name in the same folder. What is made there is renamed to ``path``, or removed if
        making it fails.

    Raises:
        FileExistsError: There is something at ``path``; it is left alone.
        OSError: Nothing can be written there.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    _remove(draft)  # of a process of the same number that was killed
    try:
        yield draft
        if path.exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
        draft.rename(path)
    finally:  # after Ctrl-C too
        with suppress(OSError):
            _remove(draft)


def exchange(one: Path, other: Path) -> None:
    """Let what is at two paths change places, at once for whoever looks.

    Raises:
        OSError: The kernel or the file system cannot, or there is nothing at one of them.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    if not hasattr(libc, "renameat2"):
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS), str(one))
    names = os.fsencode(one.absolute()), os.fsencode(other.absolute())
    if libc.renameat2(AT_FDCWD, names[0], AT_FDCWD, names[1], RENAME_EXCHANGE) != 0:
        code = ctypes.get_errno()
        raise OSError(code, os.strerror(code), str(one), None, str(other))


def _remove(path: Path) -> None:
    """Remove a file or a folder with all that is in it, if there is one."""
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def require_sole_use(descriptor: int, path: Path) -> None:
    """Lock an open file or folder for this process, until it closes it or ends, however it ends.

    Args:
        descriptor: File descriptor of the open file or folder.
        path: Path of the file or folder, for the error message.

    Raises:
        BusyError: Another process has locked it.
    """
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise BusyError(
            f"another process is at work on {path}: wait until it has ended, or stop it"
        ) from None


@contextmanager
def sole_use(folder: Path) -> Iterator[None]:
    """Be the only process that works in a folder; it is made where there is none.

    Raises:
        BusyError: Another one does.
        OSError: It can be neither made nor opened.
    """
    folder.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        require_sole_use(descriptor, folder)
        yield
    finally:
        os.close(descriptor)


def parse_json(text: str | bytes) -> Any:
    """The data of a JSON text.

    Raises:
        ValueError: It is none, or nested too deep.
    """
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("nested too deep") from None


def pretty_json(value: Any, indent: str = "") -> str:
    """JSON, indented: what is nested has a line of its own where it fits into one."""
    line = json.dumps(value, allow_nan=False, ensure_ascii=False)
    if not _has_nested(value) or len(line) <= JSON_LINE:
        return line
    deeper = indent + "  "
    if isinstance(value, Mapping):
        parts = [f"{json.dumps(key)}: {pretty_json(part, deeper)}" for key, part in value.items()]
        opening, closing = "{", "}"
    else:
        parts = [pretty_json(part, deeper) for part in value]
        opening, closing = "[", "]"
    lines = f",\n{deeper}".join(parts)
    return f"{opening}\n{deeper}{lines}\n{indent}{closing}"


def _has_nested(value: object) -> bool:
    parts = list(value.values()) if isinstance(value, Mapping) else value
    return isinstance(parts, list | tuple) and any(
        isinstance(part, Mapping | list | tuple) for part in parts
    )


def parse_yaml(text: str) -> Any:
    """The data of a YAML text of plain types.

    Raises:
        ValueError: It is none, is nested too deep, grows without bounds by references, or has a key
            twice.
    """
    import yaml  # few files are read as YAML, and all are read by this module

    # In C it takes a sixth of the time; not every PyYAML has that.
    loading = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        _require_shallow(yaml.parse(text, loading))
        loader = loading(text)
        try:
            node = loader.get_single_node()
            if node is None:
                return None
            known: dict[yaml.Node, int] = {}
            if _expanded_size(node, known) > MAX_YAML_NODES:
                raise ValueError(f"more than {MAX_YAML_NODES} values")
            if any(map(_is_long_integer, known)):
                raise ValueError(f"no YAML: an integer of more than {MAX_YAML_INTEGER} characters")
            _require_distinct_keys(known)
            return loader.construct_document(node)
        finally:
            loader.dispose()
    except (yaml.YAMLError, *SCALAR_ERRORS) as error:
        raise ValueError(f"no YAML: {' '.join(str(error).split())[:200]}") from error


def _require_shallow(events: Iterable[yaml.Event]) -> None:
    """Refuse what is nested deep, for which code in C would overflow the stack."""
    depth = 0
    for event in events:
        kind = type(event).__name__
        depth += kind.endswith("StartEvent") - kind.endswith("EndEvent")
        if depth > MAX_YAML_DEPTH:
            raise ValueError(f"no YAML: nested deeper than {MAX_YAML_DEPTH}")


def _require_distinct_keys(nodes: Iterable[yaml.Node]) -> None:
    """Refuse a key that a mapping has twice: PyYAML would silently keep the last."""
    for node in nodes:
        if isinstance(node.value, list) and node.value and isinstance(node.value[0], tuple):
            keys = Counter(key.value for key, _ in node.value if isinstance(key.value, str))
            if twice := [key for key, number in keys.items() if number > 1 and key != "<<"]:
                line = node.start_mark.line + 1
                raise ValueError(f"{twice[0]} is stated twice in the mapping at line {line}")


def _is_long_integer(node: yaml.Node) -> bool:
    return node.tag == "tag:yaml.org,2002:int" and len(node.value) > MAX_YAML_INTEGER


def _expanded_size(node: yaml.Node, known: dict[yaml.Node, int]) -> int:
    """The number of values below a node if each reference were written out."""
    if node not in known:
        known[node] = MAX_YAML_NODES + 1  # what a reference from within itself finds here
        below = node.value if isinstance(node.value, list) else ()  # a scalar has a text
        known[node] = 1 + sum(
            _expanded_size(child, known)
            for item in below
            for child in (item if isinstance(item, tuple) else (item,))
        )
    return known[node]
