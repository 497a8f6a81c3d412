# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The documentation builds to a site in which every link leads somewhere."""

import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from support.made_once import made_once

pytest.importorskip("material")
pytest.importorskip("mkdocstrings")
pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]  # the first builds the site
ROOT = Path(__file__).parents[1]
INTERFACES = sorted(
    path for kind in ("msg", "srv", "action") for path in (ROOT / "msg_schemas" / kind).iterdir()
)
LOADING = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src"}
HEAD_LINKS = {"canonical", "next", "prev"}  # said, not loaded


class Page(HTMLParser):
    """What a page refers to, what it loads, and what can be referred to in it."""

    def __init__(self, path):
        super().__init__()
        self.targets, self.anchors, self.loaded = set(), set(), set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.targets |= {given[name] for name in ("href", "src") if given.get(name)}
        self.anchors |= {given[name] for name in ("id", "name") if given.get(name)}
        if tag in LOADING and given.get("rel") not in HEAD_LINKS:
            self.loaded.add(given.get(LOADING[tag]) or "")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    return made_once(tmp_path_factory, "site", build)


def build(folder):
    # Without --quiet, which hides the warnings before --strict counts them.
    command = [sys.executable, "-m", "mkdocs", "build", "--strict"]
    told = subprocess.run(
        [*command, "--site-dir", str(folder)],
        cwd=ROOT,
        # How long signatures are broken into lines is nothing that tests look at.
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1", "SIGNATURE_LENGTH": "10000"},
        capture_output=True,
        text=True,
        timeout=250,
    )
    assert told.returncode == 0, told.stderr


@pytest.fixture(scope="module")
def pages(site):
    return {path: Page(path) for path in site.rglob("*.html")}


def test_every_link_leads_somewhere_and_every_picture_is_there(pages):
    assert len(pages) > 30
    dead = []
    for page, found in pages.items():
        for target in found.targets:
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


def test_every_page_is_in_the_navigation(site, pages):
    """The navigation of the first page has links to all others."""
    first = site / "index.html"
    linked = {(site / unquote(urlsplit(t).path)).resolve() for t in pages[first].targets}
    missing = {page.relative_to(site).as_posix() for page in set(pages) - linked}
    assert missing <= {"404.html"}


def test_nothing_is_fetched_from_elsewhere(site, pages):
    """It is read in labs without a network."""
    for path, page in pages.items():
        elsewhere = [target for target in page.loaded if re.match(r"(https?:)?//", target)]
        assert not elsewhere, (path, elsewhere)
        # The theme's script fetches the first from elsewhere wherever a page has it.
        assert not re.search(r'class="[^"]*\bmermaid\b', path.read_text(encoding="utf-8")), path
    for sheet in site.rglob("*.css"):
        loaded = re.findall(
            r"(?:url\(|@import)\s*[\"']?(https?:[^)\"']+|//[^)\"']+)", sheet.read_text()
        )
        assert not loaded, (sheet, loaded)


def test_the_reference_has_every_field_of_every_interface(site):
    text = (site / "interfaces.html").read_text(encoding="utf-8")
    for path in INTERFACES:
        assert f'id="{path.stem.lower()}"' in text
        for line in path.read_text(encoding="utf-8").splitlines():
            declared = re.match(r"^[\w/\[\]]+\s+(\w+(=\S+)?)", line)
            if declared is not None:
                assert declared[1].replace("=", " = ") in text, (path.name, line)


@pytest.mark.parametrize(
    ("page", "name"),
    [
        ("core", "slap_ros.core.domain.Domain"),
        ("planning", "slap_ros.planning.lazy_search.search_lazily"),
        ("errors", "slap_ros.errors.UnsolvableError"),
    ],
)
def test_the_reference_has_the_api(site, page, name):
    assert f'id="{name}"' in (site / "api" / f"{page}.html").read_text(encoding="utf-8")
