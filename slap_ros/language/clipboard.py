# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The desktop's clipboard, by whichever program the desktop has for it."""

from __future__ import annotations

import shutil
import subprocess

PROGRAMS = (  # Wayland, X11 twice, macOS, Windows from within WSL
    ("wl-copy",),
    ("xclip", "-selection", "clipboard"),
    ("xsel", "--input", "--clipboard"),
    ("pbcopy",),
    ("clip.exe",),
)
PATIENCE = 2.0  # s; a program without a desktop may wait for one


def copy_to_clipboard(text: str) -> bool:
    """Put a text where it can be pasted from.

    Args:
        text: Text to copy.

    Returns:
        Whether a program said that it did.
    """
    return any(_copied(program, text) for program in PROGRAMS if shutil.which(program[0]))


def _copied(program: tuple[str, ...], text: str) -> bool:
    try:
        # They leave a process behind that hands the text out, so nothing of theirs is read.
        done = subprocess.run(
            program,
            input=text.encode(),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=PATIENCE,
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0
