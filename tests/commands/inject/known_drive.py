"""The machine file of the sample gate without a doubt about its drive, so that there is no bracket."""

from __future__ import annotations

from pathlib import Path


def known_drive(folder: Path) -> str:
    """Return the text of the model of a folder without the wind-up up to which the stiffness of its drive is known."""
    lines = (folder / "model.toml").read_text(encoding="utf-8").splitlines(keepends=True)
    kept = [line for line in lines if not line.startswith("observed_wind_up")]
    assert len(kept) == len(lines) - 1
    return "".join(kept)
