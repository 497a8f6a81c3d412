# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Object-centric environments of KinDER (the distribution ``kindergarden``) as worlds.

Nothing of KinDER is imported here: its environments are passed in. Of them are used
``type_features``, ``initial_constant_state``, ``action_space``, ``step``, and ``reset`` with
``options={"init_state": ...}``.

What KinDER calls a state is not Markov. Chipmunk, behind its ``Dynamic2D`` environments, starts
each step from the contact impulses of the one before, and its robot is given by one arm length and
one finger gap, while the engine has four bodies that drift apart a little. So
:class:`~slap_ros.core.rebuild_each_step.RebuildEachStep` is used: a step of a world is the first
step of a new environment.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from slap_ros.core.action_space import Action, ActionSpace, GripperAxis
from slap_ros.core.environment_returns import (
    described,
    errors_of,
    require_double,
    reset_observation,
    state_from,
    step_observation,
)
from slap_ros.core.rebuild_each_step import MakeSimulator
from slap_ros.errors import InvalidDomainError, InvalidStateError
from slap_ros.relational import Feature, Layout, Object, State, Type

# Units of features by KinDER's names, which are the same in all its types; others have none.
UNITS: Mapping[str, str] = MappingProxyType(
    {
        **dict.fromkeys(("x", "y", "width", "height", "radius", "length", "size"), "m"),
        **dict.fromkeys(("arm_joint", "arm_length", "base_radius", "finger_gap"), "m"),
        **dict.fromkeys(("finger_width", "finger_height"), "m"),
        **dict.fromkeys(("gripper_base_width", "gripper_base_height"), "m"),
        "theta": "rad",
        "mass": "kg",
    }
)
VELOCITY_UNITS = {"vx": "m/s", "vy": "m/s", "omega": "rad/s"}  # also as vx_base, ...


class KinderType(Protocol):
    """KinDER's type of object."""

    @property
    def name(self) -> str:
        """The type's name, such as ``dyn_rectangle``."""
        ...

    @property
    def parent(self) -> Any:
        """The type above this one, if any."""
        ...


class KinderState(Protocol):
    """KinDER's state: an array of features for each object."""

    @property
    def data(self) -> dict[Any, NDArray[Any]]:
        """Features by object."""
        ...

    def copy(self) -> Any:
        """The same state, with arrays of its own."""
        ...


class KinderEnvironment(Protocol):
    """As much of ``ObjectCentricKinDEREnv`` as is used."""

    @property
    def type_features(self) -> Mapping[Any, list[str]]:
        """The names of a type's features."""
        ...

    @property
    def initial_constant_state(self) -> Any:
        """Objects that never change and that no observation has, such as walls."""
        ...

    @property
    def action_space(self) -> Any:
        """The limits of each axis, as Gymnasium has them."""
        ...

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Sample a state by ``seed``, or continue from ``options["init_state"]``."""
        ...

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Act for one control period."""
        ...


class KinderBridge:
    """Translates between the states of one kind of KinDER environment and ours."""

    def __init__(
        self,
        make_environment: Callable[[], KinderEnvironment],
        subtypes: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        """Learn the objects and types from a first reset.

        Args:
            make_environment: Function that makes environments, which have the same objects for
                every seed.
            subtypes: KinDER tells some roles of one type apart by names alone: objects whose
                names begin with a key get a type of their own, named by the value, below KinDER's.

        Raises:
            InvalidDomainError: It is no object-centric environment of KinDER, or is wrapped.
        """
        self._make = make_environment
        environment = make_environment()
        self._exemplar = _sampled(environment, seed=0)
        with errors_of(environment, "type_features"):
            features = environment.type_features
        self._types: dict[str, Type] = {}
        objects = []
        for kinder_object in sorted(self._exemplar.data, key=lambda obj: str(obj.name)):
            of_kind = self._adopt(kinder_object.type, features)
            for prefix, name in subtypes.items():
                if kinder_object.name.startswith(prefix):
                    of_kind = self._types.setdefault(name, Type(name, of_kind.features, of_kind))
            objects.append(Object(kinder_object.name, of_kind))
        self.layout = Layout.of(tuple(objects))

    def _adopt(self, kind: KinderType, features: Mapping[Any, list[str]]) -> Type:
        """KinDER's type as ours, below KinDER's parent where it has all of that one's features."""
        if kind.name not in self._types:
            own = features[kind]
            inherits = kind.parent is not None and set(features[kind.parent]) <= set(own)
            parent = self._adopt(kind.parent, features) if inherits else None
            described = tuple(Feature(name, unit_of(name)) for name in own)
            self._types[kind.name] = Type(kind.name, described, parent)
        return self._types[kind.name]

    @property
    def types(self) -> tuple[Type, ...]:
        """The types of all objects, and those above them."""
        return tuple(self._types.values())

    def type(self, name: str) -> Type:
        """The type of that name.

        Raises:
            InvalidDomainError: There is none.
        """
        if name not in self._types:
            raise InvalidDomainError(
                f"the environment has no type {name!r}; it has {', '.join(self._types)}"
            )
        return self._types[name]

    def sample(self, seed: int) -> State:
        """An initial state from the environment's own sampler, settled as the environment does."""
        return self.state_of(_sampled(self._make(), seed))

    def state_of(self, observed: KinderState) -> State:
        """KinDER's state as ours.

        Raises:
            InvalidDomainError: It is no object-centric state, has other objects than the first one
                had, another number of features, or no numbers.
        """
        features = _object_centric(observed).data
        return state_from(self.layout, {str(obj.name): features[obj] for obj in features})

    def kinder_state(self, state: State) -> Any:
        """Our state as KinDER's.

        Raises:
            InvalidStateError: It has other objects.
        """
        if state.layout is not self.layout:
            raise InvalidStateError(
                f"the state has {', '.join(map(str, state.layout.objects))}; the environment has "
                f"{', '.join(map(str, self.layout.objects))}"
            )
        translated = self._exemplar.copy()
        for obj in translated.data:
            translated.data[obj] = np.array(state[self.layout.object(obj.name)])
        return translated

    def action_space(
        self, axes: Sequence[Feature], gripper: GripperAxis | None = None
    ) -> ActionSpace:
        """The environment's action space.

        Args:
            axes: Names and units of the axes, which KinDER states only in its descriptions.
            gripper: Axis of the gripper, one of ``axes``; None: the robot has none.

        Returns:
            It, with the environment's own limits.

        Raises:
            InvalidDomainError: The environment has another number of axes.
        """
        box = self._make().action_space
        if len(axes) != len(box.low):
            raise InvalidDomainError(f"{len(axes)} axes are named; there are {len(box.low)}")
        return ActionSpace(tuple(axes), tuple(box.low.tolist()), tuple(box.high.tolist()), gripper)

    @property
    def make_simulator(self) -> MakeSimulator:
        """Builds environments in a state, as ``RebuildEachStep`` wants them."""
        return lambda state: self.simulator(state)

    def simulator(self, state: State) -> KinderSimulator:
        """A new environment in a state."""
        return KinderSimulator(self, self._make(), state)


class KinderSimulator:
    """An environment that runs on from a state. Alone it is not Markov: see the module."""

    def __init__(self, bridge: KinderBridge, environment: KinderEnvironment, state: State) -> None:
        """Continue from ``state``.

        Args:
            bridge: Bridge that translates states.
            environment: Simulator to step; nothing else may use it.
            state: State to begin in.

        Raises:
            InvalidStateError: It has other objects.
            InvalidDomainError: The environment rounds states to float32, or raises.
        """
        self._bridge, self._environment = bridge, environment
        self._low, self._high = environment.action_space.low, environment.action_space.high
        # KinDER makes walls and table the first time that somebody asks for them; a reset to a
        # given state does not, and everything would fall for ever.
        _ = environment.initial_constant_state
        with errors_of(environment, "reset"):
            returned = environment.reset(options={"init_state": bridge.kinder_state(state)})
        # Not exactly the state: KinDER reads it back from its engine, as each step does.
        require_double(state, bridge.state_of(reset_observation(returned, environment)))

    def step(self, action: Action) -> State:
        """Act for one control period.

        Raises:
            InvalidDomainError: What the environment observes does not fit the objects, or it
                raises.
        """
        # What rounding leaves outside the limits, KinDER refuses by an assertion.
        with errors_of(self._environment, "step"):
            returned = self._environment.step(np.clip(action, self._low, self._high))
        return self._bridge.state_of(step_observation(returned, self._environment))


def _sampled(environment: KinderEnvironment, seed: int) -> KinderState:
    """The state that an environment samples."""
    with errors_of(environment, "reset"):
        returned = environment.reset(seed=seed)
    return _object_centric(reset_observation(returned, environment))


def _object_centric(observed: Any) -> KinderState:
    if isinstance(getattr(observed, "data", None), Mapping):
        state: KinderState = observed
        return state
    raise InvalidDomainError(
        f"the environment observes {described(observed)}; a state with features by object is "
        "wanted, as the classes of KinDER named ObjectCentric... have, without wrappers"
    )


def unit_of(feature: str) -> str:
    """The unit of a feature, by KinDER's name of it."""
    return UNITS.get(feature) or VELOCITY_UNITS.get(feature.split("_")[0], "1")
