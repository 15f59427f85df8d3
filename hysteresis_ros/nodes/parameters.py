# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Parameters of a node, each written down once: default, unit, range, description and checks.

A node lists its parameters as `Spec`s and reads them from a `Parameters`. A value of the wrong
type, out of range or at odds with the others is refused with the reason, at start as a
`ParameterError`, later as the answer to ``ros2 param set``. A read-only parameter is given at
start (file, launch argument or ``-p``); ``ros2 param set`` on one is answered with a refusal.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, TYPE_CHECKING

import yaml
from rcl_interfaces.msg import (
    FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult)
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException

from hysteresis_ros.errors import HysteresisError, ParameterError
from hysteresis_ros.share import share_path

if TYPE_CHECKING:
    from rclpy.node import Node
    from rclpy.parameter import Parameter


@dataclasses.dataclass(frozen=True)
class Spec:
    """
    One parameter of a node.

    Parameters
    ----------
    name : str
        Name as users write it.
    default : bool, int, float or str
        Value when nobody gives one; its type is the parameter's type.
    description : str
        What it means, one sentence.
    unit : str
        SI unit, empty for none.
    low, high : int or float, optional
        Smallest and largest value that is taken; both or neither.
    read_only : bool
        True if it can be given only at start.
    """

    name: str
    default: object
    description: str
    unit: str = ''
    low: float | None = None
    high: float | None = None
    read_only: bool = False

    def descriptor(self) -> ParameterDescriptor:
        """Return what ``ros2 param describe`` shows."""
        descriptor = ParameterDescriptor(
            name=self.name, description=self._sentence(), read_only=self.read_only)
        if self.low is not None and self.high is not None:
            if isinstance(self.default, float):
                descriptor.floating_point_range = [
                    FloatingPointRange(from_value=float(self.low), to_value=float(self.high))]
            else:
                descriptor.integer_range = [
                    IntegerRange(from_value=int(self.low), to_value=int(self.high))]
        if self.read_only:
            descriptor.additional_constraints = 'given at start only'
        return descriptor

    def expected(self) -> str:
        """Return in words what values are taken."""
        kind = {bool: 'true or false', int: 'a whole number', float: 'a number with a decimal '
                'point', str: 'text'}[type(self.default)]
        if self.low is None or self.high is None:
            return kind
        return f'{kind} from {self.low:g} to {self.high:g} {self.unit}'.rstrip()

    def _sentence(self) -> str:
        return f'{self.description} [{self.unit}]' if self.unit else self.description


GEOMETRY = (
    Spec('clamp_distance', 0.017, 'Distance x from the elbow to the clamp along the forearm', 'm',
         0.001, 1.0),
    Spec('clamp_height', 0.006, 'Height a of the clamp above the forearm', 'm', 0.0, 1.0),
    Spec('anchor_height', 0.2655, 'Height y of the upper end of the muscles above the elbow', 'm',
         0.01, 2.0),
    Spec('forearm_length', 0.30, 'Length l of the forearm, at whose end the payload hangs', 'm',
         0.01, 2.0),
    Spec('resting_length', 0.27, 'Resting length z0 of a muscle', 'm', 0.01, 2.0),
    Spec('payload_mass', 0.100, 'Mass of the payload', 'kg', 0.0, 10.0),
    Spec('forearm_mass', 0.040, 'Mass of the forearm', 'kg', 0.0, 10.0),
    Spec('muscle_count', 3, 'Number of equal muscles that share the load', '', 1, 100),
    Spec('gravity', 9.81, 'Acceleration of gravity', 'm/s^2', 0.1, 30.0),
)

NAMES = (
    Spec('muscle_name', 'muscle', 'Name of the muscle in muscle_reference', read_only=True),
    Spec('joint_name', 'elbow', 'Name of the joint in joint_states', read_only=True),
    Spec('hardware_id', 'sma_bicep', 'Name of this arm in diagnostics', read_only=True),
)

MODEL = (
    Spec('model_file', '', 'Model file that `hysteresis identify` or `extend` wrote; empty for the '
         'model that comes with the package', read_only=True),
)

ANGLE_LIMITS = (
    Spec('minimum_angle', 0.0, 'Smallest target angle that is passed on; the linkage has its own',
         'rad', 0.0, 3.1416),
    Spec('maximum_angle', 3.1416, 'Largest target angle that is passed on; the linkage has its own',
         'rad', 0.0, 3.1416),
)

TARGETS = (
    Spec('target_dead_band', 0.001, 'Turns of the target angle up to this are not followed, where '
         'friction or backlash of the model is undone: noise would swing the setpoint by all that '
         'is undone', 'rad', 0.0, 0.1),
)

VOLTAGE_LIMITS = (
    Spec('minimum_voltage', 0.0, 'Smallest voltage that is ever commanded', 'V', 0.0, 48.0),
    Spec('maximum_voltage', 6.0, 'Largest voltage that is ever commanded', 'V', 0.0, 48.0),
)


def check_limits(values: Mapping, quantity: str) -> None:
    """
    Refuse limits that leave nothing between them.

    Parameters
    ----------
    values : mapping
        Values by parameter name.
    quantity : str
        ``'voltage'`` for ``minimum_voltage`` and ``maximum_voltage``, and so on.

    Raises
    ------
    ParameterError
        If the minimum is not below the maximum.
    """
    low, high = values[f'minimum_{quantity}'], values[f'maximum_{quantity}']
    if low >= high:
        raise ParameterError(
            f'minimum_{quantity} {low:g} has to be below maximum_{quantity} {high:g}')


class Parameters(Mapping[str, Any]):
    """
    The declared parameters of one node, as a mapping from name to present value.

    Parameters
    ----------
    node : rclpy.node.Node
        The node that they are declared on.
    specs : iterable of Spec
        Every parameter of the node.
    check : callable, optional
        Called with the complete mapping as it would become; raises `ParameterError` (or another
        `HysteresisError`) with the reason to refuse it. Called at start, too.
    changed : callable, optional
        Called with this object after values were changed at run time.

    Raises
    ------
    ParameterError
        If a value given at start is refused.
    """

    def __init__(self, node: Node, specs: Iterable[Spec],
                 check: Callable[[Mapping], object] | None = None,
                 changed: Callable[[Parameters], None] | None = None) -> None:
        self._specs = {spec.name: spec for spec in specs}
        self._check = check or (lambda values: None)
        self._changed = changed or (lambda values: None)
        self._values: dict[str, Any] = {}
        for spec in self._specs.values():
            self._values[spec.name] = _declare(node, spec)
        self._refuse(self._values)
        self._warn_of_unknown_names(node)
        node.add_on_set_parameters_callback(self._on_set)
        node.add_post_set_parameters_callback(self._on_changed)

    def __getitem__(self, name: str) -> Any:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def _refuse(self, values: Mapping[str, Any]) -> None:
        for name, value in values.items():
            if isinstance(value, float) and not math.isfinite(value):
                raise ParameterError(f'parameter {name} is {value}; it has to be finite')
        self._check(values)

    def _on_set(self, parameters: Iterable[Parameter]) -> SetParametersResult:
        try:
            self._refuse({**self._values, **self._own(parameters)})
        except HysteresisError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _on_changed(self, parameters: Iterable[Parameter]) -> None:
        values = self._own(parameters)
        if values:
            self._values.update(values)
            self._changed(self)

    def _own(self, parameters: Iterable[Parameter]) -> dict[str, Any]:
        return {parameter.name: parameter.value for parameter in parameters
                if parameter.name in self._specs}

    def _warn_of_unknown_names(self, node: Node) -> None:
        """Warn of given names that neither this node nor the common file knows: misspelt ones."""
        for name in sorted(set(node._parameter_overrides).difference(common_names())):
            if node.has_parameter(name) or name.startswith('qos_overrides.'):
                continue
            close = difflib.get_close_matches(name, self._specs, n=1)
            hint = f'; did you mean {close[0]}?' if close else ''
            node.get_logger().warning(f'parameter {name} is not known and has no effect{hint}')


def _declare(node: Node, spec: Spec) -> Any:
    try:
        return node.declare_parameter(spec.name, spec.default, spec.descriptor()).value
    except (InvalidParameterTypeException, InvalidParameterValueException):
        given = node._parameter_overrides[spec.name].value
        raise ParameterError(
            f'parameter {spec.name} is {given!r}; it has to be {spec.expected()}') from None


def common_names() -> list:
    """Return the parameter names in ``config/bicep.yaml``, which all nodes share."""
    try:
        content = yaml.safe_load(share_path('config/bicep.yaml').read_text(encoding='utf-8'))
    except (OSError, ParameterError):
        return []
    return list(content['/**']['ros__parameters'])
