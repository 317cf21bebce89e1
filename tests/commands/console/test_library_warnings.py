"""Warnings of libraries are about the code and not shown; those that are meant for the user are."""

import warnings

import numpy as np
import pytest

from cdtool.commands.app import _show_note


@pytest.fixture
def shown(capsys, monkeypatch):
    monkeypatch.setattr(warnings, "showwarning", _show_note)
    return lambda: capsys.readouterr().err


@pytest.mark.filterwarnings("always")
def test_a_warning_of_numpy_is_not_shown(shown):
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.showwarning = _show_note
        assert np.isnan(np.float64(0.0) / np.float64(0.0))
        warnings.warn("old name", DeprecationWarning, stacklevel=1)
        assert shown() == ""
        warnings.warn("kernels are recompiled", stacklevel=1)
        assert shown() == "note: kernels are recompiled\n"
