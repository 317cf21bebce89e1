"""Formats of recordings, by name; `cdtool/formats/channels/reading.py` chooses one by suffix and content.

A format is a class that implements `source.Format`: `name`, `suffixes`, `sniff(path)` and `columns(path, wanted)`.
Optional attributes:

* `topics`: True if the file contains messages of topics, which [channels.mcap] maps;
* `pieces`: yields the columns of a file that need not fit into memory (`pieces.py`); `exact_pieces`: the same with the
  times that `cdtool convert` wrote;
* `element_names`: returns the names of the elements of a topic's arrays, such as the joints of a JointState.

Anything that the user should know about a file is added to `Source.findings`: by a plug-in as `remark("...", column,
severity)`, here as `Finding(kind, column, numbers)` with a kind in `cdtool/base/findings/kinds.toml`.

The meaning of a column (channel, unit, scale) is assigned in `cdtool/formats/channels/channel_assembly.py`, in the same
way for all formats. Writers are functions that implement `groups.Writer`.
"""

from __future__ import annotations

from cdtool.base.registry import Registry

FORMATS = Registry(
    kind="format",
    table={
        "csv": "cdtool.formats.csv:Csv",
        "twincat_scope": "cdtool.formats.exports.twincat_scope:TwincatScope",
        "mcap": "cdtool.formats.mcap:Mcap",
        "mat": "cdtool.formats.mat:Mat",
        "parquet": "cdtool.formats.containers.parquet:Parquet",
        "hdf5": "cdtool.formats.containers.hdf5:Hdf5",
        "tdms": "cdtool.formats.containers.tdms:Tdms",
        "rosbag": "cdtool.formats.bags.rosbag:Rosbag",
        "rosbag2": "cdtool.formats.bags.rosbag2:Rosbag2",
        "xlsx": "cdtool.formats.containers.xlsx:Xlsx",
    },
    contract=("name", "suffixes", "sniff", "columns"),
)
