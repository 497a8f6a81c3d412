# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Orders within the ranks of a layered graph that leave few edges crossing."""

from __future__ import annotations

from bisect import bisect_right, insort
from collections.abc import Sequence
from itertools import pairwise

Ranks = list[list[int]]  # items of each rank, top to bottom
Neighbours = Sequence[Sequence[int]]  # of each item, in one adjacent rank

SWEEPS = 24  # over all ranks, alternately left to right and back
MAX_EXCHANGES = 8  # passes over all neighbours in a rank


def order(ranks: Ranks, before: Neighbours, after: Neighbours) -> Ranks:
    """Reorder the items of each rank by barycentre sweeps, then by exchanging neighbours.

    Args:
        ranks: Items of each rank in an initial order, which breaks ties.
        before: Neighbours of each item in the rank to its left.
        after: Neighbours of each item in the rank to its right.

    Returns:
        The items of each rank in the order found, from the top.
    """
    current = best = [list(rank) for rank in ranks]
    fewest = count_crossings(best, after)
    for sweep in range(SWEEPS):
        if fewest == 0:
            return best
        current = _sweep(current, before, after, sweep % 2 == 0)
        crossings = count_crossings(current, after)
        if crossings < fewest:
            best, fewest = current, crossings
    return _exchange(best, before, after)


def count_crossings(ranks: Ranks, after: Neighbours) -> int:
    """Pairs of edges that cross, over all pairs of adjacent ranks."""
    crossings = 0
    for left, right in pairwise(ranks):
        place = {item: i for i, item in enumerate(right)}
        seen: list[int] = []  # places of edge ends so far, sorted
        for item in left:
            ends = [place[other] for other in after[item]]
            crossings += sum(len(seen) - bisect_right(seen, end) for end in ends)
            for end in ends:
                insort(seen, end)
    return crossings


def _sweep(ranks: Ranks, before: Neighbours, after: Neighbours, rightwards: bool) -> Ranks:
    """Sort each rank by where its neighbours in the rank just passed are."""
    result: Ranks = []
    for rank in ranks if rightwards else reversed(ranks):
        if result:
            fixed = {item: i for i, item in enumerate(result[-1])}
            rank = _by_barycentre(rank, before if rightwards else after, fixed)
        result.append(rank)
    return result if rightwards else result[::-1]


def _by_barycentre(rank: list[int], neighbours: Neighbours, fixed: dict[int, int]) -> list[int]:
    """Sort items by the mean place of their neighbours; items without any stay in their places."""
    mean = {
        item: sum(fixed[n] for n in neighbours[item]) / len(neighbours[item])
        for item in rank
        if neighbours[item]
    }
    moving = iter(sorted(mean, key=mean.__getitem__))
    return [next(moving) if item in mean else item for item in rank]


def _exchange(ranks: Ranks, before: Neighbours, after: Neighbours) -> Ranks:
    """Swap neighbours in a rank for as long as that removes crossings."""
    ranks = [list(rank) for rank in ranks]
    place = {item: i for rank in ranks for i, item in enumerate(rank)}
    for _ in range(MAX_EXCHANGES):
        improved = False
        for rank in ranks:
            for i in range(len(rank) - 1):
                upper, lower = rank[i], rank[i + 1]
                as_is = swapped = 0
                for neighbours in (before, after):
                    as_is += _pairs(neighbours[upper], neighbours[lower], place)
                    swapped += _pairs(neighbours[lower], neighbours[upper], place)
                if swapped < as_is:
                    rank[i], rank[i + 1] = lower, upper
                    place[upper], place[lower] = i + 1, i
                    improved = True
        if not improved:
            break
    return ranks


def _pairs(upper: Sequence[int], lower: Sequence[int], place: dict[int, int]) -> int:
    """Crossings between the edges of two items, one above the other."""
    return sum(place[u] > place[v] for u in upper for v in lower)
