# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Hysteresis models that drive artificial muscles and find the physics they lack.

The functions of `hysteresis_ros.api` are here by name (`import hysteresis_ros as hr`); what they
need is imported when one is first used.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hysteresis_ros.api import (
        compare, diagnose, extend, identify, load_model, predict, read)

__all__ = ['compare', 'diagnose', 'extend', 'identify', 'load_model', 'predict', 'read']

__version__ = '0.1.0'


def __getattr__(name: str) -> object:
    """Import a function of the interface when it is first asked for (PEP 562)."""
    if name not in __all__:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    from hysteresis_ros import api
    value = globals()[name] = getattr(api, name)
    return value


def __dir__() -> list[str]:
    """List the functions of the interface before any is used, too."""
    return sorted({*globals(), *__all__})
