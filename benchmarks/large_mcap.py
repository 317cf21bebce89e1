"""A long MCAP file of a camera and an axis, each in chunks of its own, as recorders write it that buffer by topic."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer

MACHINE = """
[machine]
type = "linear_axis"
name = "axis"
motor_inertia = 0.001
load_mass = 100
transmission_ratio = 0.001
[channels.mcap]
position = { topic = "/axis", field = "q" }
torque = { topic = "/axis", field = "i", unit = "A", scale = 0.5 }
"""
_CHUNK = 8 << 20
_START_NS, _STEP_NS = 1_700_000_000 * 10**9, 10**6


def write_camera_and_axis(path: Path, size: int, share: float) -> float:
    """Write a file of about `size` bytes, a `share` of them on the axis; return the share that was written."""
    image = np.random.default_rng(0).bytes(_CHUNK)
    written = of_axis = row = 0
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=_CHUNK, compression=CompressionType.NONE)
        writer.start(library="cdtool")
        axis = writer.register_channel("/axis", "json", writer.register_schema("axis", "jsonschema", b"{}"))
        camera = writer.register_channel("/camera", "json", writer.register_schema("camera", "jsonschema", b"{}"))
        while written < size:
            is_axis = of_axis < share * written
            before = file.tell()
            while file.tell() == before:  # until the chunk is written
                stamp = _START_NS + row * _STEP_NS
                if is_axis:
                    row += 1
                    sample = {"q": 1e-6 * (row % 4000) ** 2, "i": 0.5 + 1e-4 * (row % 77), "note": 60 * "."}
                    writer.add_message(axis, stamp, json.dumps(sample).encode(), stamp)
                else:
                    writer.add_message(camera, stamp, image, stamp)
            written += file.tell() - before
            of_axis += (file.tell() - before) * is_axis
        writer.finish()
    return of_axis / written
