# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections import Counter
from dataclasses import asdict
from pathlib import Path

from slap_ros.bags import TopicCount, bag_info
from support.truthful_run import METADATA, Script


def test_it_counts_what_is_there(script: Script, honest_bag: Path) -> None:
    info = bag_info(honest_bag)
    counts = Counter((m.topic, m.type_name) for m in script.messages)
    assert info.topics == tuple(TopicCount(*key, counts[key]) for key in sorted(counts))
    assert info.message_count == len(script.messages)
    assert info.start_ns == script.messages[0].stamp_ns
    assert info.duration_s == (script.messages[-1].stamp_ns - info.start_ns) / 1e9
    assert info.size_bytes == (honest_bag / "honest_0.mcap").stat().st_size
    assert info.metadata == METADATA
    assert info.storage == "mcap"
    assert info.damage is None
    assert asdict(info)["path"] == str(honest_bag)
