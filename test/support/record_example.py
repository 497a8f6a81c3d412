# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Record the example's cassette again: ``cd test && python -m support.record_example``.

No model answers but a script, and the cassette says so. It shows what a recording is and what a
complaint does; it is no result.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parent

from slap_ros.acquisition.proposals.problem import AcquisitionProblem  # noqa: E402
from slap_ros.relational.pddl import parse_domain, parse_problem  # noqa: E402
from support.model_answers import LIMITS, SETTINGS, good_script, operator_json, run  # noqa: E402
from support.paper_problems import peg_in_hole, printed_insert  # noqa: E402
from support.scripted_server import serving  # noqa: E402

EXAMPLE = HERE.parent.parent / "examples" / "peg_in_hole"
CASSETTE = EXAMPLE / "scripted.jsonl"


@dataclass(frozen=True)
class Stated:
    """The example's problem, as :func:`run` takes it."""

    problem: AcquisitionProblem


def stated() -> Stated:
    domain = parse_domain((EXAMPLE / "domain.pddl").read_text(encoding="utf-8"))
    problem = parse_problem((EXAMPLE / "problem.pddl").read_text(encoding="utf-8"), domain)
    return Stated(AcquisitionProblem.of_pddl(domain, problem))


def main() -> None:
    """Write the cassette."""
    pegs = peg_in_hole()
    insert = [operator_json(printed_insert()), operator_json(pegs.operators[1])]
    CASSETTE.unlink(missing_ok=True)
    with serving(good_script(pegs, Insert=insert)) as server:
        outcome = run(stated(), server.url, f"record:{CASSETTE}", SETTINGS, LIMITS)  # type: ignore[arg-type]
    assert outcome.error is None, outcome.error


if __name__ == "__main__":
    main()
