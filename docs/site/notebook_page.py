"""The notebook of docs/examples as a page of the site: run with nbclient, with what its cells show."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any


def run(notebook: Path) -> Any:
    """Run a notebook in its folder, which is left as it is; raises nbclient's CellExecutionError."""
    import nbclient
    import nbformat

    cells = nbformat.read(notebook, as_version=4)
    where = {"metadata": {"path": str(notebook.parent)}}
    nbclient.NotebookClient(cells, timeout=300, record_timing=False, resources=where).execute()
    return cells


def write_page(notebook: Path, page: Path) -> None:
    """Write the page of a notebook, and its pictures beside it as NAME_1.png."""
    pictures, parts = 0, list[str]()
    for cell in run(notebook).cells:
        parts.append(cell.source if cell.cell_type == "markdown" else f"```py\n{cell.source}\n```")
        for data in (output.data for output in cell.get("outputs", ()) if "data" in output):
            if "image/png" in data:
                pictures += 1
                file = page.with_name(f"{page.stem}_{pictures}.png")
                file.write_bytes(base64.b64decode(data["image/png"]))
                parts.append(f"![{notebook.stem}]({file.name})")
            elif "text/html" in data:
                table = data["text/html"].replace("\n", "")
                parts.append(f'<div class="shown pst-scrollable-table-container">{table}</div>')
            else:
                parts.append(f"```text\n{data['text/plain']}\n```")
    page.write_text("\n\n".join(parts) + "\n", encoding="utf-8")
