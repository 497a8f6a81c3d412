# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Any domain that displays bodies can be rendered: what is near hides what is far."""

import math
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image

from slap_ros.api.video import require_renderable
from slap_ros.cli.render import render
from slap_ros.core import Display, PictureSize, VisibleBody
from slap_ros.domains import get_domain
from slap_ros.drawing.body_pictures import SIZE, canvas_of, draw_bodies, viewpoint, visible
from slap_ros.drawing.projection import OBLIQUE, SIDE, TOP, box_triangles
from slap_ros.errors import InvalidParameterError

RED, BLUE, GLASS = (0.9, 0.1, 0.1, 1.0), (0.1, 0.1, 0.9, 1.0), (0.1, 0.9, 0.1, 0.5)
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
FLAT = get_domain("obstacle2d")
STATE = FLAT.task(0).initial_state


def box(place, size=0.2, colour=RED, **more):
    return VisibleBody("box", place, UPRIGHT, (size,) * 3, colour, **more)


def picture(*bodies, view=SIDE):
    return draw_bodies(bodies, view, canvas_of([bodies], view, SIZE), SIZE)


def at_centre(*bodies):
    return picture(*bodies)[SIZE.height // 2, SIZE.width // 2].astype(int)


def is_red(pixel):
    return pixel[0] > 2 * pixel[2]


def test_what_is_nearer_hides_what_is_behind_it_in_any_order():
    near, far = box((0, -1, 0), 0.2, RED), box((0, 1, 0), 0.6, BLUE)
    for bodies in ((near, far), (far, near)):
        assert is_red(at_centre(*bodies))
    near, far = replace(near, position=(0, 1, 0)), replace(far, position=(0, -1, 0))
    for bodies in ((near, far), (far, near)):
        assert not is_red(at_centre(*bodies))


def test_bodies_that_pass_through_each_other_are_cut_where_they_do():
    """Painting whole bodies or faces from back to front could not show this."""
    upright = VisibleBody("a", (0, 0, 0), UPRIGHT, (0.2, 0.2, 1.0), RED)
    across = VisibleBody("b", (0, 0, 0), UPRIGHT, (1.0, 0.19, 0.2), BLUE)
    seen = picture(upright, across, view=OBLIQUE).reshape(-1, 3).astype(int)
    red, blue = seen[:, 0] - seen[:, 2] > 40, seen[:, 2] - seen[:, 0] > 40
    assert min(red.sum(), blue.sum()) > 5000
    assert is_red(at_centre(upright, across))


def test_through_glass_both_colours_are_seen():
    red, green, blue = at_centre(box((0, 1, 0)), box((0, -1, 0), 0.3, GLASS))
    assert red > 60
    assert green > 60
    assert blue < red


def test_edges_are_smooth():
    turned = (0.0, math.sin(0.2), 0.0, math.cos(0.2))
    seen = picture(replace(box((0, 0, 0)), quaternion=turned)).reshape(-1, 3)
    assert len(np.unique(seen, axis=0)) > 10  # a picture of hard edges would have three colours


def test_a_mesh_is_drawn_as_the_box_of_the_same_triangles():
    solid = box((0.1, 0.2, 0.3), 0.2)
    local = replace(solid, position=(0.0, 0.0, 0.0))
    triangles = tuple(tuple(corner) for one in box_triangles(local) for corner in one)
    mesh = replace(solid, triangles=triangles)
    canvas = canvas_of([[solid]], OBLIQUE, SIZE)
    one, other = (draw_bodies([body], OBLIQUE, canvas, SIZE).astype(int) for body in (solid, mesh))
    assert (np.abs(one - other).max(axis=2) > 8).mean() < 0.02  # outlines between its faces


@pytest.mark.parametrize(
    ("places", "view"),
    [
        ([(0, 0.5, 0), (1, 0.5, 1)], SIDE),
        ([(0, 0, 0.5), (1, 1, 0.5)], TOP),
        ([(0, 0, 0), (1, 1, 1)], OBLIQUE),
        ([], OBLIQUE),
    ],
)
def test_flat_worlds_are_looked_at_squarely(places, view):
    assert viewpoint([[box(place) for place in places]]) is view


def test_whatever_moves_is_in_every_picture_and_a_wide_floor_does_not_shrink_it():
    floor = VisibleBody("floor", (0, 0, -1), UPRIGHT, (100.0, 100.0, 0.1), BLUE)
    scenes = [[floor, box((x, 0, 0.0))] for x in (0.0, 0.3, 2.0)]
    canvas = canvas_of(scenes, SIDE, SIZE)
    assert canvas.left < -0.1
    assert canvas.left + canvas.width > 2.1
    assert canvas.width < 4.0
    for bodies in scenes:
        assert any(map(is_red, draw_bodies(bodies, SIDE, canvas, SIZE).reshape(-1, 3).astype(int)))


def test_bodies_that_cannot_be_are_left_out():
    odd = [
        box((math.nan, 0, 0)),
        box((1e300, 0, 0)),
        box((0, 0, 0), math.inf),
        replace(box((0, 0, 0)), quaternion=(0.0,) * 4),
        replace(box((0, 0, 0)), colour=(math.nan,) * 4),
    ]
    display = Display(bodies=lambda _: odd, arm=lambda _: [box((0, 0, 0))])
    assert visible(display, STATE) == [box((0, 0, 0))]
    flat = box((0, 0, 0), 0.0)
    assert picture(flat).shape == (SIZE.height, SIZE.width, 3)


def test_a_domain_without_bodies_is_refused_before_anything_runs(tmp_path):
    with pytest.raises(InvalidParameterError, match=r"displays no bodies \(Display.bodies\)"):
        require_renderable(replace(FLAT, display=Display()), STATE, tmp_path / "a.gif")


@pytest.mark.parametrize("size", [SIZE, (320, 480)])
def test_a_run_is_rendered_frame_by_frame(tmp_path, size):
    world = FLAT.make_world(STATE)
    states = [STATE, *(world.step(np.array([0.1, -0.1, 0.0])) for _ in range(4))]
    require_renderable(FLAT, STATE, tmp_path / "run.gif")
    render(FLAT, states, tmp_path / "run.gif", PictureSize(*size))
    with Image.open(tmp_path / "run.gif") as shown:
        assert (shown.n_frames, shown.size) == (5, size)
        assert shown.info["duration"] == 100  # ms, the control period
        pixels = []
        for frame in range(5):
            shown.seek(frame)
            pixels.append(np.asarray(shown.convert("RGB")).astype(int))
    assert all((one != other).any() for one, other in pairwise(pixels))


def test_no_simulator_is_needed():
    code = (
        "import sys; sys.modules['pybullet'] = None\n"
        "from slap_ros.domains import get_domain\n"
        "from slap_ros.drawing.body_pictures import *\n"
        "domain = get_domain('obstacle2d')\n"
        "scene = visible(domain.display, domain.task(0).initial_state)\n"
        "view = viewpoint([scene])\n"
        "print(draw_bodies(scene, view, canvas_of([scene], view, SIZE), SIZE).shape)\n"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=200)
    assert run.stdout.strip() == str((SIZE.height, SIZE.width, 3)), run.stderr
