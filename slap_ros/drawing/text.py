# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The room that text takes, estimated without the font.

A picture is viewed with other fonts than ours, so widths are estimated from one of the
widest in common use (DejaVu Sans, much like Verdana). Text then fits with any other.
"""

from __future__ import annotations

# Advance widths as fractions of the font size, by the characters that have about that width.
_CLASSES = (
    (0.34, "ijlI.,:;|!'`·"),
    (0.42, 'ft()[]{} -/\\"'),
    (0.52, "_rscvxyzJ?"),
    (0.65, "abdeghknopqu0123456789LFTEZPS$*~^<>"),
    (0.78, "ABCDGHKNOQRUVXY#&"),
    (0.85, "w+=\N{MINUS SIGN}"),
    (1.02, "mMW@%…→"),
)
_WIDTHS = {character: width for width, characters in _CLASSES for character in characters}
_WIDEST = 1.05  # anything else may be an ideograph
_BOLD = 1.1
ELLIPSIS = "…"


def width_px(text: str, size_px: float, bold: bool = False) -> float:
    """An upper estimate of the width of a line of text, px.

    Args:
        text: Line of text.
        size_px: Font size, px.
        bold: Whether it is set in bold, which is wider.
    """
    ems = sum(_WIDTHS.get(character, _WIDEST) for character in text)
    return ems * size_px * (_BOLD if bold else 1.0)


def shorten(text: str, size_px: float, limit_px: float, bold: bool = False) -> str:
    """The text, or its beginning and an ellipsis where it is wider than the limit.

    Args:
        text: Line of text.
        size_px: Font size, px.
        limit_px: Largest width of the line, px.
        bold: Whether it is set in bold.
    """
    if width_px(text, size_px, bold) <= limit_px:
        return text
    while text and width_px(text + ELLIPSIS, size_px, bold) > limit_px:
        text = text[:-1]
    return text + ELLIPSIS


def wrap(text: str, size_px: float, limit_px: float, bold: bool = False) -> list[str]:
    """Break text at spaces into lines; a word that is too long for a line is shortened.

    Args:
        text: Paragraph of text.
        size_px: Font size, px.
        limit_px: Largest width of a line, px.
        bold: Whether it is set in bold.

    Returns:
        The lines, from the top.
    """
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and width_px(longer, size_px, bold) <= limit_px:
            lines[-1] = longer
        else:
            lines.append(shorten(word, size_px, limit_px, bold))
    return lines
