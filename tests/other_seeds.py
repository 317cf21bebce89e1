"""Give every generator of random numbers that a test makes another seed: no result may hang on it.

`CDTOOL_SEED=7 python -m pytest -p tests.other_seeds tests/truth`, with some 20 numbers one after another.
"""

from __future__ import annotations

import os
import sys
from typing import Any

import numpy as np

NUMBER = int(os.environ.get("CDTOOL_SEED", "0"))
_make = np.random.default_rng


def _other(seed: Any = None) -> np.random.Generator:
    """Return a generator; asked for by a module of tests/, one of another seed."""
    if NUMBER and isinstance(seed, int | list | tuple) and sys._getframe(1).f_globals["__name__"].startswith("tests."):
        return _make([*(seed if isinstance(seed, list | tuple) else [seed]), 90_000 + NUMBER])
    return _make(seed)


def pytest_configure() -> None:
    """Stand in for numpy's function before the tests are imported."""
    np.random.default_rng = _other
