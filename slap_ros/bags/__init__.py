# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""rosbag2 in and out, and what a bag alone can tell: metrics, replay, digest."""

from slap_ros.bags.digest import bag_digest
from slap_ros.bags.episode_arrays import EpisodeArrays, read_episodes
from slap_ros.bags.evaluate import AtomMismatch, BagEvaluation, evaluate_bag
from slap_ros.bags.info import BagInfo, TopicCount, bag_info
from slap_ros.bags.reader import Bag, BagMessage, read_bag
from slap_ros.bags.replay import Difference, ReplayResult, replay_bag
from slap_ros.bags.writer import BagWriter

__all__ = [
    "AtomMismatch",
    "Bag",
    "BagEvaluation",
    "BagInfo",
    "BagMessage",
    "BagWriter",
    "Difference",
    "EpisodeArrays",
    "ReplayResult",
    "TopicCount",
    "bag_digest",
    "bag_info",
    "evaluate_bag",
    "read_bag",
    "read_episodes",
    "replay_bag",
]
