"""Reading a log in a notebook."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cdtool.base.errors import UsageError
from cdtool.base.remote.remote_path import location
from cdtool.commands.judging.runs import read_log
from cdtool.formats.machine_file import MachineFile
from cdtool.recordings.recording import Recording

if TYPE_CHECKING:
    from cdtool.recordings.plausible import PlausibleRanges


def read(
    log: str | Path, machine: str | Path | MachineFile | None = None, ranges: PlausibleRanges | None = None
) -> Recording:
    """Read a log through a machine file.

    Parameters
    ----------
    log : str or Path
        The log, in any format of `cdtool list formats`, or a folder with its parts.
    machine : str, Path or MachineFile
        The machine file, or what `cdtool.read_machine_file` returned. It is needed: it states which column is which
        channel, and in which unit.
    ranges : PlausibleRanges, optional
        Plausible ranges of the channels, in SI units: values outside are masked and reported as a loss.

    Returns
    -------
    Recording
        Every mapped channel on the load side in SI units, at its own times; a missing sample is NaN. A force with
        several columns has one column per axis.

    Raises
    ------
    UsageError
        No machine file is given.
    CdtoolError
        The log or the machine file cannot be read, or no channel is mapped; the message names the file.

    Examples
    --------
    >>> import cdtool
    >>> recording = cdtool.read("sample_logs/gate/stiff/03.csv", "sample_logs/gate/machine.toml")
    >>> recording["speed"].values.shape, recording["speed"].unit
    ((7200, 1), 'm/s')
    """
    if machine is None:
        name = location(log).name
        raise UsageError(
            f"cdtool.read('{name}') needs a machine file: it states which column is which channel, and the units",
            f"cdtool.read('{name}', 'machine.toml'); cdtool.init('{name}', 'machine.toml') drafts one",
        )
    return read_log(log, machine, ranges)
