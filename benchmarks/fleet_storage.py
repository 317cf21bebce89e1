"""A fleet on an S3 server with damaged, deleted and fatal recordings, and a long MCAP file that is read by ranges.

The server is moto's (`pip install 'cdtool[s3test]'`), a process of its own on the loopback interface.

python benchmarks/fleet_storage.py s3 [RECORDINGS]   # 1,000 recordings with two workers; 3 min
python benchmarks/fleet_storage.py mcap [GB]         # 2 GB, of which 5 % are mapped; 10 min, 9 GB of memory
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fleet_logs import write_fleet
from timing import Spread, main, verdict

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import cdtool  # noqa: E402
from cdtool.base.remote import session  # noqa: E402
from tests.base.remote.s3_server import S3Server  # noqa: E402
from tests.execution.dask_cluster import environment, site_with_plugin  # noqa: E402

RECORDINGS, GIGABYTES = 1000, 2.0
DAMAGED, DELETED, FATAL = 30, 10, 5
# So many recordings are done when some are deleted.
DELETED_AFTER = 100
AT_MOST_TRANSFERRED = 0.10

_RUN = "import sys; from fleet import child; child(*sys.argv[1:])"


def s3(recordings: int) -> bool:
    """Compare a fleet on the server with the same fleet in a folder."""
    with S3Server() as server, tempfile.TemporaryDirectory() as name:
        os.environ.update(server.environment())
        base = Path(name)
        site = site_with_plugin(base)
        file = write_fleet(base / "fleet", recordings)
        logs = sorted((file.parent / "soft").glob("*.csv"))
        deleted, damaged = logs[-DELETED:], logs[:DAMAGED]
        for log in damaged:
            log.write_text(f"t,i_motor\nnot,a\n{log.stem},0\n", encoding="utf-8")
        for number in range(FATAL):
            (file.parent / "stiff" / f"0000-{number:02d}x.fatal").write_text("segfault", encoding="utf-8")
        text = file.read_text(encoding="utf-8").replace('["stiff/*.csv"]', '["stiff/*.csv", "stiff/*.fatal"]')
        file.write_text(text, encoding="utf-8")
        bucket = server.new_bucket()
        bucket.fs.put(str(file.parent), f"{bucket.name}/fleet", recursive=True)
        objects = [f"{bucket.name}/fleet/soft/{log.name}" for log in deleted]
        there = _results(f"{bucket.url}/fleet/benchmark.toml", base / "there.json", site, lambda: bucket.fs.rm(objects))
        here = _results(str(file), base / "here.json", site, lambda: [log.unlink() for log in deleted])
    names = {f"soft/{log.name}" for log in deleted}
    reported = [item["recording"] for item in there.pop("skipped")]
    locally = [item["recording"] for item in here.pop("skipped")]
    expected = DAMAGED + DELETED + FATAL
    print(f"left out: {len(reported)} at the URL, {len(locally)} in the folder, {expected} expected")
    once = len(reported) == len(set(reported)) == expected and sorted(reported) == sorted(locally)
    same = json.dumps(there) == json.dumps(here)
    print(
        f"each once: {once}; deleted ones among them: {names <= set(reported)}; everything else the same bytes: {same}"
    )
    return once and same and names <= set(reported)


def _results(file: str, output: Path, site: Path, delete: Callable[[], object]) -> dict[str, Any]:
    """Return the results of a run during which some recordings are deleted."""
    process = subprocess.Popen(
        [sys.executable, "-c", _RUN, file, "", "2", str(output), "report"],
        stdout=subprocess.PIPE,
        text=True,
        env=environment(site, Path(__file__).resolve().parent),
    )
    assert process.stdout is not None
    for line in process.stdout:
        if line.strip() == str(DELETED_AFTER):
            delete()
    if process.wait():
        raise SystemExit(f"{file}: the run ended with {process.returncode}")
    print(f"  {file}: {line.strip()}")
    found: dict[str, Any] = json.loads(output.read_text(encoding="utf-8"))
    return found


def mcap(gigabytes: float) -> bool:
    """Read the mapped 5 % of a file of one camera and one axis, each in chunks of its own."""
    from large_mcap import MACHINE, write_camera_and_axis

    with S3Server() as server, tempfile.TemporaryDirectory() as name:
        os.environ.update(server.environment())
        log = Path(name) / "long.mcap"
        share = write_camera_and_axis(log, int(1e9 * gigabytes), 0.05)
        machine = Path(name) / "machine.toml"
        machine.write_text(MACHINE, encoding="utf-8")
        bucket = server.new_bucket()
        # One request: the server cannot join parts of so large an object.
        bucket.fs.put_file(str(log), f"{bucket.name}/long.mcap", chunksize=4 << 30)
        before = session.amount_read()
        there = cdtool.read(f"{bucket.url}/long.mcap", machine)
        size, requests = (now - then for now, then in zip(session.amount_read(), before, strict=True))
        here = cdtool.read(log, machine)
        same = all(there[channel].values.tobytes() == here[channel].values.tobytes() for channel in here.channels)
        total = log.stat().st_size
    print(f"{total / 1e9:.2f} GB, {100 * share:.1f} % mapped: {size / 1e6:.1f} MB in {requests} requests; same: {same}")
    return same and verdict("bytes transferred / file", Spread.of([size / total]), AT_MOST_TRANSFERRED, at_most=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=("s3", "mcap"))
    parser.add_argument("number", type=float, nargs="?")
    chosen = parser.parse_args()
    if chosen.part == "s3":
        main("fleet: S3", lambda: s3(int(chosen.number or RECORDINGS)))
    else:
        main("fleet: MCAP by ranges", lambda: mcap(chosen.number or GIGABYTES))
