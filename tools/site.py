# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What MkDocs is told beyond ``mkdocs.yml``: pages that are made, links that leave the docs.

The README is the first page; changelog and contributing guide are pages as well. The reference of
the ROS interfaces is made from the ``.msg``, ``.srv`` and ``.action`` files, whose comments say
what everything means, and that of the Python API from the docstrings, one page per package.
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
COPIED = {
    "index.md": "README.md",
    "contributing.md": "CONTRIBUTING.md",
    "changelog.md": "CHANGELOG.md",
}
RESULTS = ROOT / "docs" / "results"
LINK = re.compile(r"\[(?P<text>[^\]]*)\]\((?P<target>[^)#:]+)(?P<anchor>#[^)]*)?\)")
QUOTATION = re.compile(r'(title="[\w/.]+): [\w., ]+"')  # see tools.quotations
SECTION = re.compile(r"^---\s*$", re.MULTILINE)
FIELD = re.compile(r"^(?P<type>\S+)\s+(?P<name>\w+)(=(?P<value>\S+))?\s*(#\s*(?P<comment>.*))?$")


def on_config(config: Any) -> Any:
    """Complete the navigation by the pages of which there is one per package or study."""
    for section in config.nav:
        for title, entries in section.items():
            if title == "Reference":
                entries.append({"Python API": [{name: page} for name, page in api_pages().items()]})
            elif title == "Results":
                entries += [f"results/{path.name}" for path in sorted(RESULTS.glob("*_*.md"))]
                entries.append("results/soak.md")
    return config


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that are made."""
    made = {page: copied(source) for page, source in COPIED.items()}
    made["interfaces.md"] = interface_reference()
    made |= {page: api_reference(name) for name, page in api_pages().items()}
    for page, content in made.items():
        files.append(File.generated(config, page, content=content))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, **_: Any) -> str:
    """Show what a link to a source file points to, as that is not part of the site.

    Quotations have the name of their file alone above them.
    """
    folder = (Path(config.docs_dir) / page.file.src_uri).parent
    up = "../" * page.file.src_uri.count("/")
    pages = {ROOT / source: page for page, source in COPIED.items()}

    def shown(match: re.Match[str]) -> str:
        target = (folder / match["target"]).resolve()
        if target in pages:
            return f"[{match['text']}]({up}{pages[target]}{match['anchor'] or ''})"
        if made := _made_for(target, match["text"].strip("`")):
            return f"[{match['text']}]({up}{made})"
        if target.is_relative_to(config.docs_dir) or not target.exists():
            return match[0]
        path = target.relative_to(ROOT).as_posix()
        named = path.endswith(match["text"].strip("`").rstrip("/"))
        return f"`{path}`" if named else f"{match['text']} (`{path}`)"

    return LINK.sub(shown, QUOTATION.sub(r'\1"', markdown))


def _made_for(source: Path, text: str) -> str | None:
    """Where the page that is made of a source says what a link's text names; None for others."""
    if source.is_relative_to(SCHEMAS):
        return "interfaces.md" + (f"#{source.stem.lower()}" if source.is_file() else "")
    if source == ROOT / "slap_ros":
        return api_pages()["slap_ros.core"]
    if not source.is_relative_to(ROOT / "slap_ros") or source.suffix != ".py":
        return None
    module = ".".join(source.relative_to(ROOT).with_suffix("").parts)
    page = api_pages().get(".".join(module.split(".")[:2]))
    if text == module:
        return page
    is_class = text.isidentifier() and text[0].isupper()
    return f"{page}#{module}.{text}" if page and is_class else None


def copied(source: str) -> str:
    """A page from the root of the project, its links seen from the docs."""
    text = (ROOT / source).read_text(encoding="utf-8")

    def moved(match: re.Match[str]) -> str:
        target, anchor = match["target"], match["anchor"] or ""
        inside = target.startswith("docs/")
        page = target.removeprefix("docs/") if inside else f"../{target}"
        return f"[{match['text']}]({page}{anchor})"

    return LINK.sub(moved, text)


def api_pages() -> dict[str, str]:
    """The page of each package and module right below ``slap_ros``."""
    names = sorted(
        path.stem
        for path in (ROOT / "slap_ros").iterdir()
        if (not path.name.startswith(("_", ".")) and (path / "__init__.py").is_file())
        or path.suffix == ".py"
    )
    return {f"slap_ros.{name}": f"api/{name}.md" for name in names if not name.startswith("_")}


def api_reference(package: str) -> str:
    """A package's page: what its docstring says, then module by module."""
    folder = ROOT / package.replace(".", "/")
    modules = [
        path.relative_to(ROOT).with_suffix("")
        for path in sorted(folder.rglob("*.py"))
        if not path.name.startswith("_")
    ]
    alone = not modules  # a module, not a package
    lines = [f"# {package}", "", f"::: {package}", "    options:", "      show_root_heading: false"]
    lines += [] if alone else ["      members: false"]
    for module in modules:
        lines += ["", f"::: {'.'.join(module.parts)}"]
    return "\n".join(lines) + "\n"


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
