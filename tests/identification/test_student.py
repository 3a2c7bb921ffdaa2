"""The quantile of Student's t against SciPy's, which takes longer to import than most commands to run."""

import pytest
from scipy.special import stdtrit

from mrdamper.errors import InputError
from mrdamper.identification.intervals import student


@pytest.mark.parametrize("level", [0.5, 0.9, 0.95, 0.999])
@pytest.mark.parametrize("dof", [1, 1.3, 2, 5.5, 40, 999.0, 1001.0, 1e6])
def test_quantiles_are_scipys(level, dof):
    assert student(level, dof) == pytest.approx(float(stdtrit(dof, (1 + level) / 2)), rel=1e-10)


@pytest.mark.parametrize("level", [0.0, 1.0, -1.0, float("nan")])
def test_a_level_that_is_no_share_is_refused(level):
    with pytest.raises(InputError, match="E_LEVEL"):
        student(level, 5.0)
