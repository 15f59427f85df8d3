# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The kernels as plain Python, for an operator that has a class but no kernel."""

from collections.abc import Callable
import types

# What kernels ask an operator for; its class answers in the place of the operator's memory.
_ANSWERS: dict[str, Callable] = {
    'orient': lambda table, operator, oriented: None,
    'reset': lambda table, operator: operator.reset(),
    'step': lambda table, operator, u: operator.step(u),
    'peek': lambda table, operator, u: operator.peek(u),
    'solve': lambda table, operator, y: operator.solve(y),
    'last_input': lambda table, operator: operator.input,
    'last_output': lambda table, operator: operator.output,
}
_OPERATOR = f'{__package__}.operator'


class Plain:
    """
    Kernels uncompiled, with `HysteresisOperator` objects in the place of memories.

    Slower by an order of magnitude, but the same equations: each kernel's own Python function, in
    which the names of other kernels mean their Python functions.
    """

    def __init__(self) -> None:
        self._functions: dict[str, Callable] = {}
        self._modules: dict[str, types.SimpleNamespace] = {}

    def __call__(self, kernel: Callable) -> Callable:
        """Return the plain form of a kernel."""
        function = getattr(kernel, 'py_func', kernel)
        module, name = function.__module__, function.__name__
        if module == _OPERATOR and name in _ANSWERS:
            return _ANSWERS[name]
        key = f'{module}.{name}'
        if key not in self._functions:
            names = dict(function.__globals__)
            plain: Callable = types.FunctionType(
                function.__code__, names, name, function.__defaults__)
            self._functions[key] = plain
            for used in function.__code__.co_names:
                if used in names:
                    names[used] = self._of(names[used])
        return self._functions[key]

    def module(self, module: types.ModuleType) -> '_Module':
        """Return a module whose kernels are plain."""
        return _Module(self, module)

    def _of(self, value: object) -> object:
        """Return what a name of a kernel's module means."""
        if isinstance(value, types.ModuleType) and value.__name__.startswith(__package__):
            return _Module(self, value)
        function = getattr(value, 'py_func', value)
        if (isinstance(function, types.FunctionType)
                and function.__module__.startswith(__package__)):
            return self(function)
        return value


class _Module:
    """A module of kernels, each of them plain."""

    def __init__(self, plain: Plain, module: types.ModuleType) -> None:
        self._plain, self._module = plain, module

    def __getattr__(self, name: str) -> object:
        return self._plain._of(getattr(self._module, name))
