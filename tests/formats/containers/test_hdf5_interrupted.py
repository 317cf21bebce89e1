"""An interruption while HDF5 writes a file is never raised in its callbacks."""

from __future__ import annotations

import os
import signal

import numpy as np
import pytest

from cdtool.commands.convert.converting import convert
from cdtool.formats.containers import hdf5_writing


@pytest.mark.parametrize("call", [1, 5, 8])
def test_an_interruption_while_hdf5_writes_leaves_no_file(tmp_path, monkeypatch, call):
    pytest.importorskip("h5py")
    rows = "\n".join(f"{k * 0.001:.3f},{value}" for k, value in enumerate(np.sin(np.arange(500) / 50.0)))
    (tmp_path / "log.csv").write_text(f"time [s],torque [N m]\n{rows}\n", encoding="utf-8")
    write, calls = hdf5_writing._CheckedFile.write, []

    def interrupted(self: hdf5_writing._CheckedFile, data: object) -> int:
        calls.append(data)
        if len(calls) == call:
            os.kill(os.getpid(), signal.SIGINT)
        return write(self, data)

    monkeypatch.setattr(hdf5_writing._CheckedFile, "write", interrupted)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            convert(tmp_path / "log.csv", tmp_path / "log.h5")
    finally:
        signal.signal(signal.SIGINT, before)
    assert len(calls) >= call and not (tmp_path / "log.h5").exists()
