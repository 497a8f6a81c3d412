# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the cheapest plan of a made-up problem costs, by Dijkstra: the truth for lower bounds."""


def cheapest(start, goal, operators, outcomes):
    """The least cost from a mask of atoms to where a goal holds; None without a plan.

    ``outcomes`` gives the masks that an operator may lead to from one.
    """
    best, todo = {start: 0}, [start]
    while todo:
        state = min(todo, key=best.__getitem__)
        todo.remove(state)
        if state & goal == goal:
            return best[state]
        for one in operators:
            if state & one.preconditions == one.preconditions:
                for reached in outcomes(one, state):
                    cost = best[state] + one.least_steps
                    if cost < best.get(reached, cost + 1):
                        best[reached] = cost
                        todo.append(reached) if reached not in todo else None
    return None
