"""Attributes that do not exist are answered with the nearest that do."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any


class NearAttributes:
    """A result whose unknown attributes are answered with the nearest known ones."""

    def __getattr__(self, name: str) -> Any:
        kind = type(self)
        if name in dir(kind):  # it exists, and raised an AttributeError of its own
            return object.__getattribute__(self, name)
        if name.startswith("_"):  # what copy, pickle or Jupyter ask for
            raise AttributeError(f"{kind.__name__} has no attribute '{name}'")
        public = [known for known in dir(self) if not known.startswith("_")]
        close = get_close_matches(name, public, n=2, cutoff=0.6)
        hint = f"did you mean {' or '.join(close)}?" if close else f"known: {', '.join(public)}"
        raise AttributeError(f"{kind.__name__} has no attribute '{name}' ({hint})")
