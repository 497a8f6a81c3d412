# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What MkDocs is told beyond its configuration: pages that are made, links that leave the docs.

The README is the first page. The interface reference is made from the ``.msg``, ``.srv`` and
``.action`` files, whose comments say what everything means.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
SCHEMAS = ROOT / "msg_schemas"
KINDS = {"msg": "Messages", "srv": "Services", "action": "Actions"}
PARTS = {
    "msg": ("",),
    "srv": ("Request", "Response"),
    "action": ("Goal", "Result", "Feedback"),
}
LINK = re.compile(r"\]\((?P<target>[^)#:]+)(?P<anchor>#[^)]*)?\)")
SECTION = re.compile(r"^---\s*$", re.MULTILINE)
FIELD = re.compile(r"^(?P<type>\S+)\s+(?P<name>\w+)(=(?P<value>\S+))?\s*(#\s*(?P<comment>.*))?$")


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that are made."""
    files.append(File.generated(config, "index.md", content=first_page()))
    files.append(File.generated(config, "interfaces.md", content=interface_reference()))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, **_: Any) -> str:
    """Show what a link to a source file points to, as that is not part of the site."""
    folder = (Path(config.docs_dir) / page.file.src_uri).parent

    def shown(match: re.Match[str]) -> str:
        target = (folder / match["target"]).resolve()
        if target == ROOT / "README.md":
            return f"]({'../' * page.file.src_uri.count('/')}index.md{match['anchor'] or ''})"
        if target.is_relative_to(config.docs_dir) or not target.exists():
            return match[0]
        return f"] (`{target.relative_to(ROOT)}`)"

    return LINK.sub(shown, markdown)


def first_page() -> str:
    """The README, seen from the docs."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")

    def moved(match: re.Match[str]) -> str:
        target, anchor = match["target"], match["anchor"] or ""
        inside = target.startswith("docs/")
        return f"]({target.removeprefix('docs/') if inside else f'../{target}'}{anchor})"

    return LINK.sub(moved, text)


def interface_reference() -> str:
    """All interfaces of ``slap_msgs``."""
    lines = ["# ROS interfaces", "", "Package `slap_msgs`. Topics and services: see the", ""]
    lines[2] += " [quick start](index.md#on-ros-2)."
    for kind, title in KINDS.items():
        lines += ["", f"## {title}"]
        for path in sorted((SCHEMAS / kind).glob(f"*.{kind}")):
            lines += ["", f"### {path.stem}", "", *_described(path, kind)]
    return "\n".join(lines) + "\n"


def _described(path: Path, kind: str) -> Iterator[str]:
    text = path.read_text(encoding="utf-8")
    head, body = _head(text.splitlines())
    yield " ".join(head)
    sections = SECTION.split("\n".join(body))
    for part, section in zip(PARTS[kind], sections, strict=True):
        if part:
            yield from ("", f"**{part}**")
        yield from ("", *_table(section.splitlines()))


def _head(lines: list[str]) -> tuple[list[str], list[str]]:
    """What the file says of the whole, and what follows."""
    lines = [line for line in lines if not line.startswith("# SPDX")]
    first = next((i for i, line in enumerate(lines) if not line.startswith("#")), len(lines))
    return [line.lstrip("# ") for line in lines[:first]], lines[first:]


def _table(lines: list[str]) -> Iterator[str]:
    rows = []
    for line in lines:
        field = FIELD.match(line)
        if line.startswith("#"):
            rows.append(("", "", line.lstrip("# ")))
        elif field is not None:
            value = f" = {field['value']}" if field["value"] else ""
            rows.append((f"`{field['type']}`", f"`{field['name']}{value}`", field["comment"] or ""))
    if not rows:
        yield "Nothing."
        return
    yield from ("| type | name | meaning |", "|---|---|---|")
    for row in rows:
        yield "| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |"
