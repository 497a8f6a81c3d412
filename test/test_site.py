# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The documentation builds to a site in which every link leads somewhere."""

import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

pytest.importorskip("mkdocs")
ROOT = Path(__file__).parents[1]
INTERFACES = sorted(
    path for kind in ("msg", "srv", "action") for path in (ROOT / "msg_schemas" / kind).iterdir()
)


class Links(HTMLParser):
    """Targets and anchors of a page."""

    def __init__(self, page):
        super().__init__()
        self.targets, self.anchors = set(), set()
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.targets |= {given[name] for name in ("href", "src") if given.get(name)}
        self.anchors |= {given[name] for name in ("id", "name") if given.get(name)}


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet"]
    told = subprocess.run(
        [*command, "--site-dir", str(folder)], cwd=ROOT, capture_output=True, text=True, timeout=200
    )
    assert told.returncode == 0, told.stderr
    return folder


def test_every_link_leads_somewhere(site):
    pages = {page: Links(page) for page in site.rglob("*.html")}
    assert len(pages) > 10
    dead = []
    for page, links in pages.items():
        for target in links.targets:
            parts = urlsplit(target)
            if parts.scheme or target.startswith("//") or page.name == "404.html":
                continue
            file = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            there = file.is_file() and (
                not parts.fragment
                or file.suffix != ".html"
                or parts.fragment in pages[file].anchors
            )
            dead += [] if there else [(page.name, target)]
    assert not dead


def test_nothing_is_fetched_from_elsewhere(site):
    """It is read in labs without a network."""
    for page in site.rglob("*.html"):
        loaded = re.findall(
            r'<(?:script|link|img)[^>]+(?:src|href)="(https?:[^"]+)"', page.read_text()
        )
        assert not loaded, (page, loaded)


def test_the_reference_has_every_field_of_every_interface(site):
    text = (site / "interfaces.html").read_text(encoding="utf-8")
    for path in INTERFACES:
        assert f'id="{path.stem.lower()}"' in text
        for line in path.read_text(encoding="utf-8").splitlines():
            declared = re.match(r"^[\w/\[\]]+\s+(\w+(=\S+)?)", line)
            if declared is not None:
                assert declared[1].replace("=", " = ") in text, (path.name, line)
