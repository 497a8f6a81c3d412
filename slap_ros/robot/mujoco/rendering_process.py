# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A camera in a process of its own: without a GPU, a picture takes a core for a while.

Physics and controllers go on meanwhile, as they do on a robot.
"""

from __future__ import annotations

import signal
from contextlib import ExitStack
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slap_ros.learning.linked_process import linked_process, receive, send
from slap_ros.robot.mujoco.camera import MujocoCamera
from slap_ros.vision.image_encoding import compressed
from slap_ros.vision.image_noise import ImageNoise

Picture = NDArray[np.uint8]


class Shot(NamedTuple):
    """A picture as a camera gives it."""

    picture: Picture  # red, green and blue: height × width × 3
    jpeg: bytes  # the same as JPEG; empty where nobody wants it


class RenderingProcess:
    """Takes one picture after the other.

    Args:
        model: Compiled ``mujoco.MjModel`` with a camera.
        noise: Noise of the pictures.
        seed: Seed of the noise.

    Raises:
        InvalidParameterError: There is no OpenGL; says what to install.
    """

    def __init__(self, model: Any, noise: ImageNoise, seed: int) -> None:
        self.busy = False  # whether a picture is being taken, or waits to be received
        with ExitStack() as ending:
            self._link = ending.enter_context(linked_process(_serve, model, noise, seed))
            receive(self._link)  # that it has begun, or why not
            self._ending = ending.pop_all()

    def take(self, positions: NDArray[np.float64], with_jpeg: bool) -> None:
        """Begin to take a picture, while none is being taken.

        Args:
            positions: ``qpos`` of the model.
            with_jpeg: Whether somebody wants it as JPEG as well.
        """
        self.busy = True
        send(self._link, (positions, with_jpeg))

    @property
    def ready(self) -> bool:
        """Whether the picture that was being taken can be received."""
        return self.busy and self._link.poll()

    def receive(self) -> Shot | None:
        """The picture that was taken, once it is ready; None where the camera lost it.

        Raises:
            ChildProcessError: The process ended.
        """
        self.busy = False
        shot: Shot | None = receive(self._link)
        return shot

    def close(self) -> None:
        """End the process."""
        self._ending.close()


def _serve(link: Connection, model: Any, noise: ImageNoise, seed: int) -> None:
    """What the process does, until the other end is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal's Ctrl-C is for the node
    rng, camera = np.random.default_rng(seed), MujocoCamera(model)
    link.send(None)
    try:
        while True:
            positions, with_jpeg = link.recv()
            picture = noise.taken(camera.picture(positions), rng)
            if picture is None:
                link.send(None)
            else:
                link.send(Shot(picture, compressed(picture) if with_jpeg else b""))
    finally:
        camera.close()
