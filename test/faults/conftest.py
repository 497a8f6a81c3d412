# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # for the helpers of these tests
sys.path.insert(0, str(Path(__file__).parent.parent / "bags"))  # and for theirs

import faulty_links

IN_CI = {"message_case": 16}


def pytest_generate_tests(metafunc):
    asked = metafunc.config.getoption("--fault-cases")
    if "message_case" in metafunc.fixturenames:
        # Spread over all links and faults, whatever their number.
        count = asked or IN_CI["message_case"]
        stride = 1 if asked else 5
        cases = [faulty_links.Case.sampled(stride * number) for number in range(count)]
        metafunc.parametrize("message_case", cases, ids=str)
