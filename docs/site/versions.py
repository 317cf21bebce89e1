"""Write what the folders of all versions share: the list of versions, and a front page that leads to the newest.

    python docs/site/versions.py FOLDER /BASE/

FOLDER has one folder per version, as the branch gh-pages; /BASE/ is the path of the site on its host.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

_PAGE = (
    '<!DOCTYPE html><meta charset="utf-8"><title>cdtool</title>'
    '<meta http-equiv="refresh" content="0; url={0}/index.html">'
)


def _order(name: str) -> tuple[bool, list[int]]:
    """Sort releases by their numbers, after main."""
    return name != "main", [int(part) for part in re.findall(r"\d+", name)]


def write_versions(folder: Path, base: str) -> list[str]:
    """Write switcher.json, index.html and .nojekyll for the versions in a folder; return these, newest first."""
    names = [item.parent.name for item in folder.glob("*/index.html")]
    names.sort(key=_order, reverse=True)
    newest = names[0]
    rows: list[dict[str, object]] = [
        {"name": f"{name} (newest)" if name == newest != "main" else name, "version": name, "url": f"{base}{name}/"}
        for name in names
    ]
    if newest != "main":
        rows[0]["preferred"] = True
    (folder / "switcher.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    (folder / "index.html").write_text(_PAGE.format(newest) + "\n", encoding="utf-8")
    (folder / ".nojekyll").write_text("", encoding="utf-8")  # else folders that begin with _ are left out
    return names


if __name__ == "__main__":
    print(", ".join(write_versions(Path(sys.argv[1]), sys.argv[2])))
