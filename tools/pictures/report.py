# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Makes ``docs/images/report.png``: the report on one task, solved with a shortcut and without.

python -m tools.pictures.report [CHROMIUM]

It needs a Chromium, of which ``CHROMIUM`` is the program, and Pillow.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from tools.imports import ROOT

OUTPUT = ROOT / "docs" / "images" / "report.png"
TASK = ("obstacle_tower", "--seed", "1")
RUNS = {"pure": ("--shortcuts", "none"), "slap": ()}
SIZE_PX = (840, 1322)  # of the picture
WINDOW_PX = (1000, 1574)  # of the browser, drawn at twice the size
STEP = 21  # at which the motion is shown
COLOURS = 256
POLICY = re.compile(r"<meta[^>]*Content-Security-Policy[^>]*>")  # it refuses other scripts
SHOW_STEP = f"""<script>
const slider = document.querySelector("[data-step]");
slider.value = {STEP};
slider.dispatchEvent(new Event("input"));
</script></body>"""


def make(path: Path, chromium: str) -> None:
    """Run the task twice, write the report, and take a picture of its upper part.

    Args:
        path: Path of the picture.
        chromium: Program of the browser, Chromium or its headless shell.
    """
    with TemporaryDirectory() as name:
        folder = Path(name)
        bags = [str(folder / run) for run in RUNS]
        for bag, options in zip(bags, RUNS.values(), strict=True):
            slap("run", *TASK, *options, "--record", bag, "--in-process")
        page, shot = folder / "report.html", folder / "report.png"
        slap("report", *bags, "--output", str(page))
        text = page.read_text(encoding="utf-8")
        text = POLICY.sub("", text).replace("</body>", SHOW_STEP)
        page.write_text(text, encoding="utf-8")
        photograph(chromium, page, shot)
        large = Image.open(shot).convert("RGB")
        small = large.resize(SIZE_PX, Image.Resampling.LANCZOS)
        small.quantize(COLOURS).save(path, optimize=True)


def slap(*arguments: str) -> None:
    """Run the command line of this environment."""
    command = [str(Path(sys.executable).parent / "slap"), *arguments]
    subprocess.run(command, check=True, capture_output=True)


def photograph(chromium: str, page: Path, picture: Path) -> None:
    """Have a browser draw a page to a file."""
    width, height = WINDOW_PX
    command = [
        chromium,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--hide-scrollbars",
        f"--user-data-dir={picture.parent / 'profile'}",
        f"--window-size={width},{height}",
        "--force-device-scale-factor=2",
        "--virtual-time-budget=3000",  # ms
        f"--screenshot={picture}",
        page.as_uri(),
    ]
    subprocess.run(command, check=True, capture_output=True)


if __name__ == "__main__":
    make(OUTPUT, *(sys.argv[1:] or ["chromium"]))
