"""Commands with the S3 server: several processes, names, errors, credentials, and a server that ends meanwhile."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import zlib
from pathlib import Path

import pytest

import cdtool as api
from cdtool.base.errors import CdtoolError, is_lasting
from cdtool.base.remote import storage
from tests.base.remote.s3_server import SECRET, S3Server
from tests.command import cdtool

ROOT = Path(__file__).parents[3]
GATE = ROOT / "sample_logs" / "gate"
MACHINE = GATE / "machine.toml"


def shell(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own."""
    code = "from cdtool.commands.app import main; main()"
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
    )


@pytest.fixture
def gate(bucket):
    """The sample logs of the gate in the bucket."""
    return bucket.put_folder(GATE)


def test_a_benchmark_in_several_processes_has_the_bytes_of_a_local_one(gate, bucket, tmp_path):
    (tmp_path / "temporary").mkdir()
    outputs = [f"{bucket.url}/out/results.json", f"{bucket.url}/out/report.html"]
    there = shell(
        "benchmark",
        f"{gate}/benchmark.toml",
        "-j",
        2,
        "-o",
        outputs[0],
        "-o",
        outputs[1],
        TMPDIR=str(tmp_path / "temporary"),
    )
    assert there.returncode == 0, there.stderr
    here = cdtool("benchmark", GATE / "benchmark.toml", "-o", tmp_path / "results.json", "-o", tmp_path / "report.html")
    assert there.stdout.replace(f"{bucket.url}/out", str(tmp_path)) == here.out
    for name in ("results.json", "report.html", "results.traces.json.gz"):
        assert bucket.get(f"out/{name}") == (tmp_path / name).read_bytes(), name
    assert not list((tmp_path / "temporary").iterdir())
    size, _, rest = there.stderr.partition("read from URLs: ")[2].partition(" MiB in ")
    logs = sum(path.stat().st_size for path in GATE.rglob("*") if path.is_file()) / 2**20
    assert 0.95 * logs < float(size) < 2.0 * logs and int(rest.split()[0]) >= 24


@pytest.mark.parametrize(
    "name",
    ["a b.csv", "ü/Größe 日本.csv", "log#7.csv", "50%.csv", "[x]?+&=.csv", "x//y.csv"],
)
def test_names_have_any_characters(bucket, name):
    url = bucket.put(name, (GATE / "stiff" / "03.csv").read_bytes())
    done = cdtool("info", url, "-m", MACHINE)
    assert done.status in (0, 3) and done.out.startswith(f"{url}: csv"), done.err
    assert api.read(url, MACHINE).digest == api.read(GATE / "stiff" / "03.csv", MACHINE).digest


def test_a_missing_object_or_bucket_is_one_line(bucket):
    for url, words in [
        (f"{bucket.url}/none.csv", "no such file"),
        ("s3://no-such-bucket/a.csv", "no such file"),
        (bucket.put("a/b.csv", b"").rpartition("/")[0], "is a folder"),
    ]:
        done = cdtool("info", url)
        assert done.status != 0 and f"{url}: {words}" in done.err and len(done.err.splitlines()) == 1
    done = cdtool("benchmark", "s3://no-such-bucket/benchmark.toml")
    assert done.status == 2 and "s3://no-such-bucket/benchmark.toml: no such file" in done.err
    out = cdtool("benchmark", GATE / "benchmark.toml", "-o", "s3://no-such-bucket/report.html")
    assert out.status == 2 and "no bucket s3://no-such-bucket (create the bucket first)" in out.err


@pytest.fixture
def changing(monkeypatch):
    """changing(name, change): after a log of that name was copied, `change` is called."""
    fetch = storage.fetch

    def set_up(name, change):
        def changed(url, target):
            fetch(url, target)
            if url.endswith(name):
                change()

        monkeypatch.setattr(storage, "fetch", changed)

    return set_up


def test_a_server_that_ends_meanwhile_is_one_line_per_log_and_nothing_lasting(monkeypatch, tmp_path):
    with S3Server() as server:
        server.set_environment(monkeypatch)
        bucket = server.new_bucket()
        gate = bucket.put_folder(GATE)
        text = (GATE / "benchmark.toml").read_text(encoding="utf-8").partition("[limits]")[0]
        bucket.put("gate/benchmark.toml", text.encode())
        fetch, count = storage.fetch, iter(range(1000))

        def ending(url, target):
            if next(count) == 17:
                server.stop()
            fetch(url, target)

        monkeypatch.setattr(storage, "fetch", ending)
        done = cdtool(
            "benchmark", f"{gate}/benchmark.toml", "--store", tmp_path / "store", "-o", tmp_path / "results.json"
        )
        assert "Traceback" not in done.err and SECRET not in done.out + done.err
        assert done.status == 3, done.err
        skipped = json.loads((tmp_path / "results.json").read_text())["skipped"]
        assert skipped and all(
            "the storage cannot be used" in item["reason"] or "cannot be reached, meanwhile" in item["reason"]
            for item in skipped
        )
        with pytest.raises(CdtoolError) as caught:
            api.read(f"{gate}/stiff/03.csv", MACHINE)
        assert not is_lasting(caught.value)
    stored = [path for path in (tmp_path / "store" / "logs").rglob("*") if path.is_file()]
    recordings = json.loads((tmp_path / "results.json").read_text())["recordings"]
    assert len(stored) == len(recordings)  # a second run tries the others again


def test_credentials_are_nowhere(bucket, tmp_path):
    log = bucket.put("a.csv", (GATE / "stiff" / "03.csv").read_bytes())
    machine = bucket.put("machine.toml", MACHINE.read_bytes())
    signed = f"{log}?X-Amz-Signature=5ecretS1gn&X-Amz-Credential=abcdef"
    for url in (
        signed,
        "sftp://robot:geheim@127.0.0.1:1/a.csv",
        "https://robot:geheim@127.0.0.1:1/a.csv?sig=5ecretS1gn",
    ):
        done = shell("info", url, "-m", machine)
        assert done.returncode != 0 and len(done.stderr.strip().splitlines()) <= 2, done.stderr
        for secret in ("5ecretS1gn", "abcdef", "geheim", "robot", SECRET):
            assert secret not in done.stdout + done.stderr


def test_credentials_of_urls_are_used_and_not_in_results(monkeypatch, tmp_path):
    """An HTTP server that answers only with user info and query."""
    from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

    asked = []

    class Handler(SimpleHTTPRequestHandler):
        def __init__(self, *arguments, **settings):
            super().__init__(*arguments, directory=str(GATE), **settings)

        def do_HEAD(self):
            self._answer(super().do_HEAD)

        def do_GET(self):
            self._answer(super().do_GET)

        def _answer(self, answer):
            asked.append(self.path)
            if "sig=5ecretS1gn" in self.path or self.path.endswith(".toml"):
                answer()
            else:
                self.send_error(403)

        def log_message(self, *_):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        base = f"http://127.0.0.1:{server.server_port}"
        text = (GATE / "benchmark.toml").read_text(encoding="utf-8").partition("[learn]")[0]
        text = text.replace('"machine.toml"', f'"{base}/machine.toml"').partition("detectors")[0]
        names = {group: [f"{base}/{group}/0{i}.csv?sig=5ecretS1gn" for i in (3, 4)] for group in ("free", "stiff")}
        text += f'detectors = ["pt"]\nsignature = {{ force = true }}\n[learn]\nlogs = {json.dumps(names["free"])}\n'
        text += f"[impacts.stiff]\nlogs = {json.dumps(names['stiff'])}\n"
        (tmp_path / "benchmark.toml").write_text(text)
        done = cdtool(
            "benchmark",
            tmp_path / "benchmark.toml",
            "-o",
            tmp_path / "results.json",
            "-o",
            tmp_path / "report.html",
            "--store",
            tmp_path / "store",
        )
        assert done.status == 0, done.err
        results = (tmp_path / "results.json").read_text()
        assert f"{base}/stiff/03.csv" in results
        shown = done.out + done.err + results + (tmp_path / "report.html").read_text()
        shown += "".join(
            zlib.decompress(path.read_bytes()).decode()
            for path in (tmp_path / "store").rglob("*/*/*")
            if path.is_file()
        )
        assert "5ecretS1gn" not in shown and "sig=" not in shown
        refused = cdtool("info", f"{base}/stiff/03.csv?sig=999999", "-m", MACHINE)
        assert refused.status != 0 and "999999" not in refused.out + refused.err
        assert any("sig=5ecretS1gn" in path for path in asked)
    finally:
        server.shutdown()
