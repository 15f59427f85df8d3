# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What H2 is given on a bench, and what each of its weights makes of that."""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy import sparse

from hysteresis_ros.identification.grid import nodes_along
from hysteresis_ros.identification.kinetic_weights import KineticWeights, Tangent
from hysteresis_ros.identification.smoothness import smoothness_square
from hysteresis_ros.kernels.shares import shares
from hysteresis_ros.operators import cell_areas, Preisach


def weight_sizes(nodes: np.ndarray) -> np.ndarray:
    """Return sizes of cells and, for the reversible weights, of intervals, shape (K + N,)."""
    return np.append(cell_areas(nodes), np.diff(nodes))


def operator_with(nodes: np.ndarray, weights: np.ndarray, bias: float) -> Preisach:
    """Return the operator with weights of shape (K + N,); `bias` is its least output."""
    count = len(cell_areas(nodes))
    sizes = weight_sizes(nodes)
    return Preisach(nodes, weights[:count], bias + float(weights @ sizes), weights[count:])


class Excitation:
    """
    What H2 is given, and what each of its weights makes of it.

    Most effects change what is done to H2's output and not this.

    Parameters
    ----------
    inputs : ndarray, shape (rows + trials,)
        Trial after trial, each of which begins with the cold one.
    ends : ndarray of int, shape (trials,)
        Where each trial ends.
    wanted : ndarray of bool, shape (rows + trials,)
        Inputs whose output is judged.
    response : ndarray, shape (n,)
        Measured, for each input wanted.
    trial : ndarray of int, shape (n,)
        Trial of each of them.
    following : float
        Share of the grid's nodes that follow the response; see `nodes_along`.
    """

    def __init__(self, inputs: np.ndarray, ends: np.ndarray, wanted: np.ndarray,
                 response: np.ndarray, trial: np.ndarray, following: float) -> None:
        self.inputs = inputs
        self._ends, self.wanted = ends, wanted
        self._response, self._trial, self._following = response, trial, following
        self._nodes: dict[int, np.ndarray] = {}
        self._shares: dict[int, np.ndarray] = {}
        self._smoothness: dict[int, sparse.csr_matrix] = {}

    def nodes(self, levels: int) -> np.ndarray:
        """Return a grid that is dense where the response varies most, shape (levels + 1,)."""
        if levels not in self._nodes:
            self._nodes[levels] = nodes_along(
                self.inputs.min(), self.inputs.max(), self.inputs[self.wanted], self._response,
                self._trial, levels, self._following)
        return self._nodes[levels]

    def smoothness(self, levels: int) -> sparse.csr_matrix:
        """Return the penalty on rough weights on that grid; see `smoothness_square`."""
        if levels not in self._smoothness:
            self._smoothness[levels] = smoothness_square(self.nodes(levels))
        return self._smoothness[levels]

    def shares(self, levels: int, scale: np.ndarray, columns: np.ndarray | None = None
               ) -> np.ndarray:
        """
        Return what `kernels.shares` does, of all columns or of some that end with the bias.

        Parameters
        ----------
        levels : int
        scale : ndarray, shape (n,)
        columns : ndarray of int, shape (C,), optional
        """
        nodes = self.nodes(levels)
        if levels not in self._shares:
            if columns is not None:
                return shares(nodes, self.inputs, self._ends, self.wanted, scale, columns)
            self._shares[levels] = shares(
                nodes, self.inputs, self._ends, self.wanted, np.ones(len(scale)),
                np.arange(len(weight_sizes(nodes)) + 1))
        found = self._shares[levels]
        found = (found if columns is None else found[:, columns]) * scale[:, None]
        found[:, -1] = 1.0
        return found

    def kinetic(self, levels: int, top: float, oriented: np.ndarray) -> KineticWeights:
        """
        Return what kinetics add to the response where all has transformed at an input.

        Parameters
        ----------
        levels : int
        top : float
        oriented : ndarray, shape (rows + trials,)
            Share of what forms that each input's load orients.
        """
        plain = self.shares(levels, np.ones(len(self._response)))
        return KineticWeights(
            self.nodes(levels), self.inputs, self._ends, self.wanted, plain, top, oriented)


@dataclasses.dataclass
class Feedback:
    """
    What H2 with some weights does that the best ones depend on.

    Attributes
    ----------
    phases : list of ndarray or None
        Martensite share in every row of each trial; None where no effect depends on it.
    kinetics : Tangent or None
        What its output in judged rows would change by if all of the wire followed the kinetics of
        `Kinetics`, near those weights; None where none of it does.
    """

    phases: list[np.ndarray] | None
    kinetics: Tangent | None


@dataclasses.dataclass
class Course:
    """
    What H2 is given, trial after trial, and what is done to its output.

    `scales` and `known` (rows,) multiply the output above its least and are added to it; a share
    `kinetics` of it follows those of `Kinetics`, with the share `oriented` (rows + trials,) of what
    forms.
    """

    excitation: Excitation
    scales: np.ndarray
    known: np.ndarray
    kinetics: float
    oriented: np.ndarray


@dataclasses.dataclass
class Design:
    """
    The least squares problem of H2's weights.

    `shares` (n, K + 1) say what each weight, times the size of its cell, and last the bias
    contribute to the response; `known` (n,) is the part without weights; `smoothness` (K + 1,
    K + 1) is the penalty on rough ones.
    """

    shares: np.ndarray
    known: np.ndarray
    nodes: np.ndarray
    smoothness: sparse.csr_matrix

    @property
    def rows(self) -> np.ndarray:
        """What each weight contributes to the response, shape (n, K)."""
        return self.shares[:, :-1] * weight_sizes(self.nodes)
