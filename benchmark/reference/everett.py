# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The Preisach plane cut into cells, and the weight above any of its points.

The weight function is constant in each cell of a triangular grid (below Eq. 5). Cell (i, j) of
Eqs. 6 and 8 is the i-th interval of beta from below and the j-th interval of alpha counted from
the diagonal: beta in [x_(i-1), x_i], alpha in [x_(i+j-2), x_(i+j-1)]; j = 1 are the triangles on
the diagonal. The Everett function E(alpha, beta) is the weight over the triangle
{beta <= b <= a <= alpha}; in a cell it is

    E = E(x_a, x_(b+1)) + A p + C q + w p q + (w_a p^2 + w_b q^2) / 2

with p = alpha - x_a, q = x_(b+1) - beta, the weights w, w_a, w_b of the cell and of the two
diagonal cells beside it, and A, C the weight along the row and along the column up to the cell.
In a diagonal cell it is w (alpha - beta)^2 / 2. All terms are non-negative: nothing cancels.

A weight can also lie on the diagonal beta = alpha itself, g per unit of its length: relays without
a loop, the limit of ever smaller diagonal cells. It adds g (alpha - beta) in a diagonal cell, g_a
to A and g_b to C.
"""

from bisect import bisect_right
import math

import numpy as np

from hysteresis_ros.operators import cell_areas, cells


class Everett:
    """
    The Everett function of a piecewise constant weight.

    Parameters
    ----------
    nodes : ndarray, shape (N + 1,)
        Checked grid nodes.
    weights : ndarray, shape (N (N + 1) / 2,)
        Non-negative weights in the order of Eq. 8.
    slopes : ndarray, shape (N,), optional
        Non-negative weights on the diagonal itself, one an interval; default 0.

    Attributes
    ----------
    total : float
        E over the whole plane.

    """

    def __init__(self, nodes: np.ndarray, weights: np.ndarray,
                 slopes: np.ndarray | None = None) -> None:
        levels = len(nodes) - 1
        width = np.diff(nodes)
        beta, alpha = cells(levels)
        density = np.zeros((levels, levels))
        density[beta, alpha] = weights
        mass = np.zeros((levels, levels))
        mass[beta, alpha] = weights * cell_areas(nodes)

        # corner[b, a] = E(x_a, x_b); row[b, a]: weight of alpha's interval a from x_b to x_a;
        # column[b, a]: weight of beta's interval b from x_(b+1) to x_a.
        corner = np.zeros((levels + 1, levels + 1))
        corner[:levels, 1:] = np.cumsum(np.cumsum(mass[::-1], axis=0)[::-1], axis=1)
        row = np.zeros((levels + 1, levels))
        column = np.zeros((levels, levels + 1))
        across = np.triu(density * width[:, None], 1)
        row[:levels] = np.cumsum(across[::-1], axis=0)[::-1]
        column[:, 1:] = np.cumsum(np.triu(density * width[None, :], 1), axis=1)
        half = np.diag(density) / 2.0

        slopes = np.zeros(levels) if slopes is None else slopes
        along = np.concatenate(([0.0], np.cumsum(slopes * width)))
        corner += np.triu(along[None, :] - along[:, None])
        row += slopes[None, :]
        column += slopes[:, None]

        self._given = nodes, weights, slopes
        self._tilted: dict[float, Everett] = {}
        self.total = float(corner[0, levels])
        self.nodes = nodes
        self._arrays = corner, row, column, density, half, slopes
        # The scalar path reads plain floats from lists: about ten times faster than arrays.
        self._levels = levels
        self._list = nodes.tolist()
        self._inner = self._list[1:-1]
        self._half = half.tolist()
        self._slope = slopes.tolist()
        self._corner = corner.tolist()
        self._corner_columns = corner.T.tolist()
        self._row_columns = row.T.tolist()
        self._column = column.tolist()
        self._cells = [
            [(self._list[a], self._list[b + 1], corner[b + 1, a].item(), row[b + 1, a].item(),
              column[b, a].item(), density[b, a].item(), self._half[a], self._half[b])
             for b in range(a)] for a in range(levels)]

    def __deepcopy__(self, memo: dict) -> 'Everett':
        """Return itself: nothing of it changes, and its tables are most of an operator."""
        return self

    def tilted(self, slope: float) -> 'Everett':
        """Return the function with `slope` added to every weight on the diagonal."""
        if slope not in self._tilted:
            # The tables cost as much as hundreds of steps, and the slope seldom changes.
            self._tilted.clear()
            nodes, weights, slopes = self._given
            self._tilted[slope] = Everett(nodes, weights, slopes + slope)
        return self._tilted[slope]

    def at(self, alpha: float, beta: float) -> float:
        """Return E at one point, nodes[0] <= beta <= alpha <= nodes[-1]."""
        a = bisect_right(self._inner, alpha)
        b = bisect_right(self._inner, beta)
        if a == b:
            d = alpha - beta
            return d * (self._slope[a] + self._half[a] * d)
        x_a, x_b, corner, row, column, cross, half_a, half_b = self._cells[a][b]
        p = alpha - x_a
        q = x_b - beta
        return corner + p * (row + cross * q + half_a * p) + q * (column + half_b * q)

    def value(self, alpha: np.ndarray, beta: np.ndarray) -> np.ndarray:
        """Return E at points given as arrays that broadcast."""
        corner, row, column, density, half, slope = self._arrays
        a, b = self.cell(alpha), self.cell(beta)
        p = alpha - self.nodes[a]
        q = self.nodes[b + 1] - beta
        square = (corner[b + 1, a] + p * (row[b + 1, a] + density[b, a] * q + half[a] * p)
                  + q * (column[b, a] + half[b] * q))
        d = alpha - beta
        return np.where(a == b, d * (slope[a] + half[a] * d), square)

    def cell(self, u: np.ndarray) -> np.ndarray:
        """Return the interval that inputs lie in; a node belongs to the one above it."""
        return np.searchsorted(self.nodes[1:-1], u, side='right')

    def alpha(self, target: float, beta: float, tolerance: float) -> tuple[float, float]:
        """
        Solve E(alpha, beta) = target for the smallest alpha.

        Parameters
        ----------
        target : float
            Sought value.
        beta : float
            The fixed corner.
        tolerance : float
            A value that falls short of the target by less counts as reaching it, so that
            rounding does not send the solution across a plateau.

        Returns
        -------
        alpha, value : float
            The solution, or the last node if the target is beyond, and E there.

        """
        if target <= tolerance:
            return beta, 0.0
        b = bisect_right(self._inner, beta)
        q = self._list[b + 1] - beta
        half = self._half[b]
        slope = self._slope[b]
        first = q * (slope + half * q)
        if target - tolerance <= first:
            p = _root(target, slope, half, q)
            return beta + p, p * (slope + half * p)
        corners, columns = self._corner[b + 1], self._column[b]
        low, high = b + 1, self._levels
        if low == high:
            return self._list[high], first
        bend = half * q * q
        sought = target - tolerance - bend
        while high - low > 1:
            middle = (low + high) // 2
            if corners[middle] + columns[middle] * q < sought:
                low = middle
            else:
                high = middle
        x, _, corner, row, column, cross, half, _ = self._cells[low][b]
        start = bend + corner + column * q
        slope = row + cross * q
        p = _root(target - start, slope, half, self._list[high] - x)
        return x + p, start + p * (slope + half * p)

    def beta(self, target: float, alpha: float, tolerance: float) -> tuple[float, float]:
        """
        Solve E(alpha, beta) = target for the largest beta.

        As `alpha`, with the other corner fixed.
        """
        if target <= tolerance:
            return alpha, 0.0
        a = bisect_right(self._inner, alpha)
        p = alpha - self._list[a]
        half = self._half[a]
        slope = self._slope[a]
        first = p * (slope + half * p)
        if target - tolerance <= first:
            q = _root(target, slope, half, p)
            return alpha - q, q * (slope + half * q)
        corners, rows = self._corner_columns[a], self._row_columns[a]
        low, high = 0, a
        if low == high:
            return self._list[low], first
        bend = half * p * p
        sought = target - tolerance - bend
        while high - low > 1:
            middle = (low + high) // 2
            if corners[middle] + rows[middle] * p < sought:
                high = middle
            else:
                low = middle
        _, x, corner, row, column, cross, _, half = self._cells[a][low]
        start = bend + corner + row * p
        slope = column + cross * p
        q = _root(target - start, slope, half, x - self._list[low])
        return x - q, start + q * (slope + half * q)


def _root(rest: float, slope: float, bend: float, width: float) -> float:
    """Return d in [0, width] with slope d + bend d^2 = rest; all arguments non-negative."""
    if rest <= 0.0:
        return 0.0
    denominator = slope + math.sqrt(slope * slope + 4.0 * bend * rest)
    rest += rest
    # Also where a weight is so small that its square is lost and the denominator is 0.
    return rest / denominator if rest < width * denominator else width
