# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run as the ensemble would publish it, made by planning and executing in the core.

``python truthful_run.py FOLDER SEED CLOCK_NS`` records one.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from slap_ros.bags import BagWriter
from slap_ros.domains import get_domain
from slap_ros.messages import interfaces
from slap_ros.messages.events import PlanEventKind, SkillEventKind
from slap_ros.messages.typestore import typestore
from slap_ros.planning.abstract_graph import build_abstract_graph
from slap_ros.planning.lazy_search import search_lazily
from slap_ros.planning.model import Model
from slap_ros.planning.option_execution import OptionExecution, OptionResult
from slap_ros.planning.options import given_option

METADATA = {"seed": "7", "preset": "fair", "revision": "0123456789ab-dirty"}
TICK = 1_000_003  # ns between any two messages


def make(type_name: str, **values: Any) -> Any:
    """A message with these fields, the others 0 or empty."""
    return typestore().types[type_name](**values)


@dataclass(frozen=True)
class Published:
    """A message on its way into a bag."""

    topic: str
    type_name: str
    stamp_ns: int
    message: Any

    @property
    def cdr(self) -> bytes:
        return bytes(typestore().serialize_cdr(self.message, self.type_name))


@dataclass
class Truth:
    """What really happened, to be compared with what the bag tells."""

    plan_length: int = 0
    planning_ns: int = 0
    edges_rolled_out: int = 0
    bound: float = 0.0
    options: list[dict[str, Any]] = field(default_factory=list)


class Script:
    """Publishes in the order in which the nodes would."""

    def __init__(self, seed: int, clock_ns: int = 1_700_000_000_000_000_000) -> None:
        self.domain = get_domain("obstacle2d", "fair")
        self.seed = seed
        self.messages: list[Published] = []
        self.truth = Truth()
        self.clock_ns = clock_ns
        self.episode = 1

    def header(self) -> Any:
        sec, nanosec = divmod(self.clock_ns, 10**9)
        stamp = make("builtin_interfaces/msg/Time", sec=sec, nanosec=nanosec)
        return make("std_msgs/msg/Header", stamp=stamp, frame_id="world")

    def publish(self, topic: str, type_name: str, **values: Any) -> None:
        self.clock_ns += TICK
        message = make(type_name, header=self.header(), **values)
        self.messages.append(Published(topic, type_name, self.clock_ns, message))

    def atoms_of(self, atoms: Iterable[Any]) -> list[Any]:
        return [
            make(
                "slap_msgs/msg/GroundAtom",
                predicate=atom.predicate.name,
                objects=[obj.name for obj in atom.objects],
            )
            for atom in atoms
        ]

    def state_fields(self, state: Any, step: int) -> dict[str, Any]:
        objects = [
            make(
                "slap_msgs/msg/ObjectState",
                name=obj.name,
                type=obj.type.name,
                features=state[obj].copy(),
            )
            for obj in state.objects
        ]
        return {"episode": self.episode, "step": step, "objects": objects}

    def publish_domain(self) -> None:
        domain = self.domain
        types = [
            make(
                "slap_msgs/msg/TypeInfo",
                name=t.name,
                parent="",
                feature_names=[f.name for f in t.features],
                feature_units=[f.unit for f in t.features],
            )
            for t in domain.types
        ]
        version = make("diagnostic_msgs/msg/KeyValue", key="started", value=str(self.clock_ns))
        self.publish(
            "/slap/domain",
            interfaces.DOMAIN_INFO,
            name=domain.name,
            preset=domain.preset,
            types=types,
            predicates=[],
            operators_pddl="",
            action_names=[],
            action_units=[],
            control_period=domain.execution.control_period_s,
            configuration=[],
            versions=[version],
        )

    def publish_state(self, state: Any, step: int) -> None:
        self.publish("/slap/state", interfaces.STATE, **self.state_fields(state, step))
        header = self.messages[-1].message.header
        self.publish(
            "/slap/atoms",
            interfaces.ATOMS,
            episode=self.episode,
            step=step,
            atoms=self.atoms_of(self.space.decode(self.space.abstract(state))),
            exact=True,
            seen=[],
            missing=[],
        )
        self.messages[-1].message.header = header

    def publish_command(self, action: Any, step: int) -> None:
        deltas, gripper = self.domain.action_space.split(action)
        self.publish(
            "/slap/command",
            interfaces.COMMAND,
            episode=self.episode,
            step=step,
            deltas=deltas,
            gripper=gripper,
        )

    def plan_event(self, kind: PlanEventKind, step: int, edge: int = 0, rolled: int = 0) -> None:
        self.publish(
            "/slap/plan_events",
            interfaces.PLAN_EVENT,
            episode=self.episode,
            step=step,
            kind=int(kind),
            plan_number=0,
            edge=edge,
            edges_rolled_out=rolled,
            error_code=0,
            error_msg="",
        )

    def skill_event(self, kind: SkillEventKind, step: int, option: Any) -> None:
        self.publish(
            "/slap/skill_events",
            interfaces.SKILL_EVENT,
            episode=self.episode,
            step=step,
            kind=int(kind),
            skill=option.skill.name,
            objects=[obj.name for obj in option.objects],
            error_code=0,
            error_msg="",
        )

    def publish_diagnostics(self) -> None:
        self.publish("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", status=[])

    def run(self, index: int = 0) -> None:
        """One whole episode, solved."""
        domain = self.domain
        task = domain.task(self.seed, index)
        self.publish_domain()
        self.space = domain.atom_space(task.initial_state)
        self.publish(
            "/slap/task",
            interfaces.TASK,
            episode=self.episode,
            domain=domain.name,
            seed=self.seed,
            index=index,
            initial_state=make(
                interfaces.STATE, header=self.header(), **self.state_fields(task.initial_state, 0)
            ),
            goal=self.atoms_of(task.goal),
            step_limit=task.step_limit,
        )
        state, step = task.initial_state, 0
        self.publish_state(state, step)
        plan = self._plan(state, task.goal)
        world = domain.make_world(state)
        for number, edge in enumerate(plan.edges):
            self.plan_event(PlanEventKind.EDGE_STARTED, step, number)
            self.skill_event(SkillEventKind.STARTED, step, edge.option)
            execution = OptionExecution(
                edge.option, edge.target, self.space, domain.action_space, state
            )
            started = step
            while not isinstance(
                action := execution.advance(state, self.space.abstract(state)), OptionResult
            ):
                state = self._step(world, action, step)
                step += 1
            assert action.reached
            self.skill_event(SkillEventKind.REACHED, step, edge.option)
            self.plan_event(PlanEventKind.EDGE_REACHED, step, number)
            self.publish_diagnostics()
            self.truth.options.append(
                {
                    "name": edge.option.skill.name,
                    "kind": "operator",
                    "objects": [obj.name for obj in edge.option.objects],
                    "steps": step - started,
                    "outcome": "reached",
                }
            )
        self.plan_event(PlanEventKind.SOLVED, step)
        self.truth.plan_length = step

    def _plan(self, state: Any, goal: Any) -> Any:
        self.plan_event(PlanEventKind.PLANNING_STARTED, 0)
        started = self.clock_ns
        model = Model.of(self.domain, state)
        operators = tuple(
            (ground, given_option(self.domain, ground.operator.name, ground.objects))
            for ground in self.domain.ground(self.space)
        )
        graph = build_abstract_graph(self.space.abstract(state), self.space.mask(goal), operators)
        outcome = search_lazily(graph, state, model)
        plan = outcome.plan
        assert plan is not None, outcome.reason
        self.clock_ns += 123_456_789
        self.plan_event(PlanEventKind.PLANNED, 0, rolled=model.executed)
        self.truth.planning_ns = self.clock_ns - started
        self.truth.bound = plan.predicted_steps / (outcome.at_least or 1)
        self._publish_plan(plan, goal)
        self.truth.edges_rolled_out = model.executed
        return plan

    def _publish_plan(self, plan: Any, goal: Any) -> None:
        edges = [
            make(
                "slap_msgs/msg/PlanEdge",
                kind=edge.option.kind.value,
                name=edge.option.skill.name,
                attempt=edge.option.attempt,
                objects=[obj.name for obj in edge.option.objects],
                expected_atoms=self.atoms_of(self.space.decode(edge.target.required)),
                others_may_appear=False,
                forbidden_atoms=[],
                predicted_steps=edge.predicted_steps,
            )
            for edge in plan.edges
        ]
        self.publish(
            "/slap/plan",
            interfaces.PLAN,
            episode=self.episode,
            number=0,
            goal=self.atoms_of(goal),
            edges=edges,
            predicted_steps=plan.predicted_steps,
            bound=self.truth.bound,
            planner="lazy",
            library="0123456789abcdef",
            samples=16,
        )

    def _step(self, world: Any, action: Any, step: int) -> Any:
        """One step in lock-step, with commands around it that the simulator refuses."""
        if step % 3 == 0:
            self.publish_command(action * 0.0 + 7.0, step)  # out of range
        self.publish_command(action, step)
        state = world.step(action)
        if step % 4 == 0:
            self.publish_command(action * 0.5, step)  # stale: the step was taken already
        self.publish_state(state, step + 1)
        return state


def record(path: Path, messages: Iterable[Published]) -> None:
    """Write messages into a new bag."""
    with BagWriter(path, METADATA) as writer:
        for item in messages:
            writer.write(item.topic, item.type_name, item.stamp_ns, item.cdr)


def without(messages: Iterable[Published], *topics: str) -> list[Published]:
    """All but these topics."""
    return [item for item in messages if item.topic not in topics]


def under(namespace: str, messages: Iterable[Published]) -> list[Published]:
    """The same in a namespace."""
    return [replace(item, topic=f"/{namespace}{item.topic}") for item in messages]


if __name__ == "__main__":
    script = Script(int(sys.argv[2]), int(sys.argv[3]))
    script.run()
    record(Path(sys.argv[1]), script.messages)
