"""The type of an argument or option that names a file: a local path or a URL.

For a parameter of the type Path, typer makes a path of the text, in which `s3://` becomes `s3:/`. It is therefore given
another type, with `location` as its parser.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from cdtool.base.remote.remote_path import location as location

if TYPE_CHECKING:
    Place: TypeAlias = Path
else:
    Place = type("path", (), {"__doc__": "A path, by the name that the help shows."})
