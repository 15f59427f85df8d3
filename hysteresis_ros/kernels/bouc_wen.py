# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The hidden state of the normalised Bouc-Wen operator, solved exactly between reversals.

While the input u rises the state w follows dw/du = rho pace(w), with c = 2 sigma - 1 and pace
``1 - w^n`` for w >= 0, ``1 + c |w|^n`` for w < 0. So ``rho (u - u0) = G(w) - G(w0)`` with ::

    G(w) = w F(1, b; 1 + b; w^n)  or, for w < 0,  w F(1, b; 1 + b; -c |w|^n),   b = 1 / n

(F is Gauss's hypergeometric function). While the input falls the same holds for -w over -u.
Everywhere n is `exponent`, c is `curl` and `pole` is psi(1) - psi(b), psi the digamma function.
"""

import math

import numpy as np

from .jit import jit

# exp(-40) is below the spacing of floats at 1: from there on w is 1.
SATURATED = 40.0
# Of all numbers that are summed up or iterated; never reached.
MOST_TERMS, MOST_ITERATIONS = 400, 100


@jit
def pace(w: float, gap: float, curl: float, exponent: float) -> float:
    """Return dw/du over the rate while the input rises; `gap` is 1 - w."""
    if w < 0.0:
        return 1.0 + curl * (-w) ** exponent
    if w < 0.5:
        return 1.0 - w ** exponent
    return -math.expm1(exponent * math.log1p(-gap)) if gap > 0.0 else 0.0


@jit
def _near_one(away: float, b: float, pole: float) -> float:
    """Return F(1, b; 1 + b; 1 - away), 0 < away <= 1/2 (Abramowitz and Stegun, 15.3.10)."""
    logarithm, total, factor, power = math.log(away), 0.0, 1.0, 1.0
    for k in range(MOST_TERMS):
        term = factor * power * (pole - logarithm)
        total += term
        if abs(term) <= 1e-17 * total:
            break
        pole += 1.0 / (k + 1.0) - 1.0 / (b + k)
        factor *= (b + k) / (k + 1.0)
        power *= away
    return b * total


@jit
def _near_zero(z: float, b: float) -> float:
    """Return F(1, b; 1 + b; z) for 0 <= z <= 1/2, by its power series."""
    total, power = 0.0, 1.0
    for k in range(MOST_TERMS):
        term = power * b / (b + k)
        total += term
        if term <= 1e-17 * total:
            break
        power *= z
    return total


@jit
def _negative(x: float, b: float) -> float:
    """Return F(1, b; 1 + b; -x) for x >= 0, by Gauss's continued fraction."""
    if x == 0.0:
        return 1.0
    root = math.sqrt(1.0 + x)
    shrinks = -math.log(x / (root + 1.0) ** 2)
    terms = min(MOST_TERMS, 2 + int(38.0 / shrinks))
    fraction = b + terms
    for k in range(terms, 0, -1):
        m = k // 2
        partial = b + m if k % 2 else float(m)
        fraction = b + (k - 1.0) + partial * partial * x / fraction
    return b / fraction


@jit
def travel(w: float, gap: float, curl: float, exponent: float, pole: float) -> float:
    """Return G(w), the rate times the input from w = 0 to w while rising; gap = 1 - w > 0."""
    b = 1.0 / exponent
    if w < 0.0:
        return w * _negative(curl * (-w) ** exponent, b)
    away = pace(w, gap, curl, exponent)
    return w * (_near_one(away, b, pole) if away < 0.5 else _near_zero(1.0 - away, b))


@jit
def reached(distance: float, curl: float, exponent: float, pole: float) -> float:
    """
    Return w with G(w) = distance.

    Newton's method from the side of 0 over t, w = 1 - exp(-t), respectively over -w: there
    G is concave, so it approaches the solution from one side and cannot overshoot.
    """
    if distance >= SATURATED:
        return 1.0
    place = asked = abs(distance)
    for _ in range(MOST_ITERATIONS):
        if distance >= 0.0:
            w, gap = -math.expm1(-place), math.exp(-place)
            slope = gap / pace(w, gap, curl, exponent)
        else:
            w, gap = -place, 1.0 + place
            slope = 1.0 / pace(w, gap, curl, exponent)
        change = (asked - abs(travel(w, gap, curl, exponent, pole))) / slope
        place += change
        if place >= SATURATED:
            return 1.0
        if abs(change) <= 1e-15 * place:
            break
    return -math.expm1(-place) if distance >= 0.0 else max(-place, -1.0)


@jit
def moved(w: float, change: float, curl: float, exponent: float, pole: float) -> float:
    """Return w after the input moved by `change`, in units of 1 / rate."""
    side = 1.0 if change > 0.0 else -1.0
    v = side * w
    if change == 0.0 or v >= 1.0:
        return w
    return side * reached(
        travel(v, 1.0 - v, curl, exponent, pole) + abs(change), curl, exponent, pole)


@jit
def follow(inputs: np.ndarray, u: float, w: float, rate: float, curl: float, exponent: float,
           pole: float) -> np.ndarray:
    """
    Return the course of the hidden state.

    Parameters
    ----------
    inputs : ndarray, shape (n,)
        Finite.
    u, w : float
        Input and state before the first.
    rate, curl, exponent, pole : float
        See the module.

    Returns
    -------
    ndarray, shape (n,)

    """
    states = np.empty(len(inputs))
    for k in range(len(inputs)):
        w = moved(w, rate * (inputs[k] - u), curl, exponent, pole)
        u = inputs[k]
        states[k] = w
    return states
