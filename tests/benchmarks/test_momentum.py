"""The bare loop that benchmarks/momentum.py times gives the detector's own residual."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


def test_the_bare_loop_has_the_residual_of_the_detector(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import arrays
    import momentum

    machine, detector = arrays.gate(), momentum.Momentum()
    run = arrays.clean(4000, machine)
    values = momentum._core(run, machine, detector.bandwidth)()
    expected = detector.signal(arrays.recording(run), machine).values[:, 0]
    assert np.allclose(values, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
