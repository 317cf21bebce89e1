"""The exit statuses and messages of `cdtool convert --recover`."""

from __future__ import annotations

import typer
from typer.testing import CliRunner

from cdtool.base.errors import UsageError
from cdtool.base.exit_status import ExitStatus
from cdtool.commands.convert.command import convert
from tests.formats.mcap.small_files import small_file

APP = typer.Typer()
APP.command()(convert)


def run(*arguments, keep="verified"):
    return CliRunner().invoke(APP, [*map(str, arguments), "--recover", keep])


def test_recovering_an_undamaged_file_exits_with_status_0(tmp_path):
    small_file(tmp_path / "log.mcap")
    done = run(tmp_path / "log.mcap", tmp_path / "out.mcap")
    assert done.exit_code == 0
    assert "24 messages" in done.output


def test_recovering_a_cut_file_exits_with_status_3_and_reports_losses(tmp_path):
    sent = small_file(tmp_path / "log.mcap")
    whole = (tmp_path / "log.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: whole.index(sent[-1][2])])
    done = run(tmp_path / "cut.mcap", tmp_path / "out.mcap")
    assert done.exit_code == ExitStatus.LOST
    assert "loss: damaged at byte" in done.output
    assert "(--recover all keeps them)" in done.output
    kept = run(tmp_path / "cut.mcap", tmp_path / "out.mcap", "--force", keep="all")
    assert kept.exit_code == ExitStatus.LOST
    assert f"{len(sent) - 1} messages" in kept.output
    assert "left out" not in kept.output


def test_an_existing_file_is_overwritten_only_with_force_and_the_source_never(tmp_path):
    for name in ("log.mcap", "other.mcap"):
        small_file(tmp_path / name, messages=12 if name == "log.mcap" else 24)
    other, source = (tmp_path / "other.mcap").read_bytes(), (tmp_path / "log.mcap").read_bytes()
    refused = run(tmp_path / "log.mcap", tmp_path / "other.mcap")
    assert isinstance(refused.exception, UsageError) and "--force" in str(refused.exception)
    assert (tmp_path / "other.mcap").read_bytes() == other
    assert run(tmp_path / "log.mcap", tmp_path / "other.mcap", "--force").exit_code == 0
    assert (tmp_path / "other.mcap").read_bytes() != other
    refused = run(tmp_path / "log.mcap", tmp_path / "new.mcap", "--to", "1s")
    assert "--recover copies messages as they are" in str(refused.exception)
    (tmp_path / "link.mcap").symlink_to(tmp_path / "log.mcap")
    for name in ("log.mcap", "link.mcap"):
        refused = run(tmp_path / "log.mcap", tmp_path / name, "--force")
        assert "is the file to recover" in str(refused.exception)
    assert (tmp_path / "log.mcap").read_bytes() == source
