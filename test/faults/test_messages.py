# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages that are lost, late, out of order or repeated: a run succeeds or says what failed."""

import pytest

from slap_ros.bags import evaluate_bag
from slap_ros.errors import ErrorCode
from support.bench import LIMIT
from support.faulty_links import laboratory


@pytest.mark.timeout(4 * LIMIT)
def test_a_faulty_link_ends_a_run_in_success_or_in_an_error(network, tmp_path, message_case):
    with laboratory(message_case, tmp_path / "bag") as bench:
        result = bench.solve()
        assert result.success != bool(result.error_code)
        assert ErrorCode(result.error_code) is not ErrorCode.UNKNOWN, result.error_msg
        # Whatever happened, once the link is whole again so is the ensemble.
        bench.relay.heal()
        episode = bench.reset(seed=message_case.seed + 1)
        again = bench.solve(episode)
        assert again.success, again.error_msg
        bench.close_bag()
    found = evaluate_bag(tmp_path / "bag")
    assert found.damage is None
    assert found.runs[-1].success
    assert found.mismatches == []
