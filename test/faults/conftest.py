# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0


from support import faulty_links, flood, process_faults
from support.marks import slow

SAMPLED = {
    "message_case": faulty_links.Case.sampled,
    "process_case": process_faults.Case.sampled,
    "restart_case": process_faults.Case.sampled_restart,
}
# Few, as each takes seconds, and unlike one another. ``--fault-cases N`` injects the first N.
QUICK = {"message_case": (0, 5, 10, 15), "process_case": (0,), "restart_case": ()}
SLOW = {"message_case": range(20, 80, 5), "process_case": (1, 2, 15), "restart_case": (2, 3)}


FLOODS = ("state of a later step", "unknown domain")  # `make faults` has every kind


def pytest_generate_tests(metafunc):
    asked = metafunc.config.getoption("--fault-cases")
    for name, sampled in SAMPLED.items():
        if name in metafunc.fixturenames:
            quick, others = (range(asked), ()) if asked else (QUICK[name], SLOW[name])
            cases = [*map(sampled, quick), *slow(*map(sampled, others))]
            metafunc.parametrize(name, cases, ids=str)
    if "flood_kind" in metafunc.fixturenames:
        metafunc.parametrize("flood_kind", tuple(flood.KINDS) if asked else FLOODS)
