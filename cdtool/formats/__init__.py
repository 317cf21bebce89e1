"""Formats of recordings, by name; `cdtool/ingest/reading.py` chooses one by suffix and content.

A format is a class that follows `source.Format`: `name`, `suffixes`, `sniff(path)` and `columns(path, wanted)`. It may
also have

* `topics`: True where it holds messages of topics, which [channels.mcap] maps;
* `pieces`: the columns of a file that need not fit into memory (`pieces.py`), `exact_pieces`: the same with the times
  that cdtool convert wrote, `mapped`: those of a map (`pieces.mapped_log`);
* `element_names`: how the messages of a topic name the elements of their arrays, as a JointState names its joints;
* `sniffs_any_text`: True where almost any text passes for a file of it.

What the user should know about a file goes into `Source.findings`: `Finding(Remark("..."), column, severity)`, or with
a kind and numbers of its own, a frozen dataclass derived from `cdtool.findings.Fact` with its `sentence`.

What a column means (channel, unit, scale) is the same for all of them: see `cdtool/ingest/channel_assembly.py`. Writers
are functions that follow `groups.Writer`.
"""

from __future__ import annotations

from cdtool.registry import Registry

FORMATS = Registry(
    kind="format",
    table={
        "csv": "cdtool.formats.csv:Csv",
        "mcap": "cdtool.formats.mcap:Mcap",
        "mat": "cdtool.formats.mat:Mat",
        "parquet": "cdtool.formats.parquet:Parquet",
        "hdf5": "cdtool.formats.hdf5:Hdf5",
        "mdf": "cdtool.formats.mdf:Mdf",
        "tdms": "cdtool.formats.tdms:Tdms",
        "rosbag": "cdtool.formats.rosbag:Rosbag",
    },
    contract=("name", "suffixes", "sniff", "columns"),
)
