# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Code on the pages of the documentation, taken from the files in which it is run and tested.

A fenced block with a title such as ``title="slap_ros/core/task.py: Task, Domain.task"`` has these
definitions, in this order. ``python -m tools.quotations`` brings all blocks up to date.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from tools.imports import ROOT

BLOCK = re.compile(
    r'(?P<head>^```python title="(?P<file>[\w/.]+): (?P<names>[\w., ]+)"\n)'
    r"(?P<code>.*?)(?P<end>^```$)",
    re.MULTILINE | re.DOTALL,
)


def up_to_date(page: str) -> str:
    """A page with every quotation as its file has it.

    Raises:
        LookupError: A file has no definition of a name.
    """

    def quoted(match: re.Match[str]) -> str:
        code = quote(ROOT / match["file"], match["names"].split(", "))
        return f"{match['head']}{code}\n{match['end']}"

    return BLOCK.sub(quoted, page)


def quote(path: Path, names: Sequence[str]) -> str:
    """The definitions of some names, as a file has them.

    Args:
        path: Path of a Python file.
        names: Names of the file's functions, classes and constants; ``Class.method`` for a method
            alone.

    Returns:
        Their sources in this order; constants without blank lines between them.

    Raises:
        LookupError: There is no definition of a name.
    """
    text = path.read_text(encoding="utf-8")
    lines, nodes = text.split("\n"), dict(_definitions(ast.parse(text)))
    parts: list[str] = []
    for i, name in enumerate(names):
        if name not in nodes:
            raise LookupError(f"{path.relative_to(ROOT)} defines no {name!r}, which a page quotes")
        if i:
            plain = isinstance(nodes[name], ast.Assign) and isinstance(
                nodes[names[i - 1]], ast.Assign
            )
            parts.append("\n" if plain else "\n\n\n")
        parts.append("\n".join(_lines(nodes[name], lines)))
    return "".join(parts)


def _definitions(
    tree: ast.Module | ast.ClassDef, prefix: str = ""
) -> Iterator[tuple[str, ast.stmt]]:
    for node in tree.body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            yield prefix + node.name, node
        if isinstance(node, ast.ClassDef):
            yield from _definitions(node, f"{node.name}.")
        if isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            for name in (n for target in targets for n in ast.walk(target)):
                if isinstance(name, ast.Name):
                    yield prefix + name.id, node


def _lines(node: ast.stmt, lines: Sequence[str]) -> list[str]:
    decorators = getattr(node, "decorator_list", [])
    first = min([node.lineno, *(decorator.lineno for decorator in decorators)])
    indent = len(lines[first - 1]) - len(lines[first - 1].lstrip())
    return [line[indent:] for line in lines[first - 1 : node.end_lineno]]


def main() -> int:
    """Rewrite the pages whose quotations changed."""
    for page in sorted((ROOT / "docs").rglob("*.md")):
        text = page.read_text(encoding="utf-8")
        if (new := up_to_date(text)) != text:
            page.write_text(new, encoding="utf-8")
            sys.stdout.write(f"{page.relative_to(ROOT)}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
