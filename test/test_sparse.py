# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Parts of matrices that are mostly zeros are those of the same matrices with their zeros."""

from hysteresis_ros.kernels.sparse import part, product
import numpy as np
import pytest
from scipy import sparse


@pytest.mark.parametrize('chosen', [[], [3], [1, 4, 5, 11], range(12)])
def test_parts_and_products_are_those_of_the_whole_matrix(chosen):
    rng = np.random.default_rng(0)
    whole = np.where(rng.random((12, 12)) < 0.2, rng.normal(size=(12, 12)), 0.0)
    rows, index = sparse.csr_matrix(whole), np.array(chosen, dtype=int)
    x, arrays = rng.normal(size=len(index)), (rows.indptr, rows.indices, rows.data)
    assert np.array_equal(part(*arrays, index), whole[np.ix_(index, index)])
    np.testing.assert_allclose(product(x, *arrays, index), x @ whole[index], atol=1e-15)
