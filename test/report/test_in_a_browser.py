# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reports in a real Chromium: for screen readers, keyboards, phones, and without scripts."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.webelement import WebElement
from selenium.webdriver.support.wait import WebDriverWait

from slap_ros.report import read_report, render, write_page
from support.browser import Browser, chromium

pytestmark = pytest.mark.slow  # a real browser
NAMES = ["compared", "tower", "hostile"]
# The paths of what is drawn, live or at the end, in the order in which it is painted.
LIVE = "[...document.querySelectorAll('svg[data-view] path')].map(p => p.getAttribute('d'))"
ENDING = "[...document.querySelectorAll('.ending svg path')].map(p => p.getAttribute('d'))"


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with chromium(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.fixture(scope="module")
def pages(bags: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("pages")
    contents = {"compared": ("pure", "learned"), "tower": ("tower",), "hostile": ("hostile",)}
    for name, runs in contents.items():
        write_page(folder / f"{name}.html", render([read_report(bags[run]) for run in runs]))
    return {name: folder / f"{name}.html" for name in contents}


def slider(browser: Browser) -> WebElement:
    return browser.driver.find_element(By.CSS_SELECTOR, "[data-step]")


@pytest.mark.parametrize(
    ("name", "width", "scheme"),
    [
        ("compared", 1280, "light"),
        ("compared", 320, "dark"),
        ("tower", 320, "light"),
        ("hostile", 1280, "dark"),
    ],
)
def test_nothing_stands_in_the_way_of_anyone(
    browser: Browser, pages: dict[str, Path], name: str, width: int, scheme: str
) -> None:
    browser.open(pages[name], width, scheme)
    browser.ask("document.querySelectorAll('details').forEach(d => d.open = true)")
    assert browser.violations() == []
    assert browser.complaints() == []


@pytest.mark.parametrize("width", [320, 768])
@pytest.mark.parametrize("name", NAMES)
def test_nobody_has_to_scroll_sideways(
    browser: Browser, pages: dict[str, Path], name: str, width: int
) -> None:
    browser.open(pages[name], width)
    browser.ask("document.querySelectorAll('details').forEach(d => d.open = true)")
    assert browser.ask("document.documentElement.scrollWidth") <= width
    cut = browser.ask(
        "[...document.querySelectorAll('main *:not(svg *)')]"
        ".filter(e => e.getBoundingClientRect().right > innerWidth + 1).map(e => e.outerHTML)"
    )
    assert cut == []


@pytest.mark.parametrize("name", NAMES)
def test_the_keyboard_moves_through_the_run(
    browser: Browser, pages: dict[str, Path], name: str
) -> None:
    browser.open(pages[name])
    handle = slider(browser)
    last = int(handle.get_attribute("max"))
    at_first = browser.ask(LIVE)
    handle.send_keys(Keys.ARROW_RIGHT, Keys.ARROW_RIGHT, Keys.ARROW_RIGHT)
    assert handle.get_attribute("value") == "3"
    assert handle.get_attribute("aria-valuetext") == f"step 3 of {last}"
    assert browser.ask(LIVE) != at_first
    handle.send_keys(Keys.END)
    assert browser.ask(LIVE) == browser.ask(ENDING) != at_first
    handle.send_keys(Keys.HOME)
    assert browser.ask(LIVE) == at_first
    assert browser.complaints() == []


def test_play_and_pause_by_keyboard(browser: Browser, pages: dict[str, Path]) -> None:
    browser.open(pages["tower"])
    button = browser.driver.find_element(By.CSS_SELECTOR, "[data-play]")
    button.send_keys(Keys.SPACE)
    assert button.text == "Pause"
    button.send_keys(Keys.SPACE)
    assert button.text == "Play"
    button.send_keys(Keys.ENTER)
    end = slider(browser).get_attribute("max")
    WebDriverWait(browser.driver, 30).until(
        lambda _: slider(browser).get_attribute("value") == end and button.text == "Play"
    )
    assert browser.ask(LIVE) == browser.ask(ENDING)
    assert browser.complaints() == []


def test_without_scripts_the_first_and_the_last_step_are_shown(
    browser: Browser, pages: dict[str, Path]
) -> None:
    browser.open(pages["compared"], scripts=False)
    find = browser.driver.find_elements
    assert not any(e.is_displayed() for e in find(By.CSS_SELECTOR, ".player, .cursor"))
    shown = [e for e in find(By.CSS_SELECTOR, ".view svg") if e.is_displayed()]
    labels = [e.get_attribute("aria-label") for e in shown]
    moments = [label.split(", ")[-1] for label in labels]
    assert moments == ["first step", "last step"] * 2  # of each of two runs


def test_no_name_runs_a_script(browser: Browser, pages: dict[str, Path]) -> None:
    browser.open(pages["hostile"])
    slider(browser).send_keys(Keys.END)
    assert browser.ask("typeof window.pwned") == "undefined"
    assert browser.ask("document.querySelectorAll('script').length") == 3
    assert browser.ask("performance.getEntriesByType('resource').length") == 0
    browser.ask(
        "document.body.append(Object.assign(document.createElement('script'), "
        "{textContent: 'window.pwned = 1'}))"
    )
    assert browser.ask("typeof window.pwned") == "undefined"  # the policy forbids it
    assert any("Content Security Policy" in words for words in browser.complaints())
