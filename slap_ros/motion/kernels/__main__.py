# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Compile motion planning ahead of its first use: ``python -m slap_ros.motion.kernels``.

Two processes do, from both ends, until they meet: half the time on two processors.
"""

import subprocess
import sys

from slap_ros.compilation import is_compiled
from slap_ros.motion.kernels.compiled_backend import CompiledBackend, compiled_backend

FROM_THE_END = "from-the-end"


def main() -> None:
    """Compile all, or begin with what the other process ends with."""
    if sys.argv[1:] == [FROM_THE_END]:
        for call in reversed(CompiledBackend().calls()):
            call()
    elif not is_compiled():
        with subprocess.Popen([sys.executable, "-m", "slap_ros.motion.kernels", FROM_THE_END]):
            compiled_backend()


if __name__ == "__main__":
    main()
