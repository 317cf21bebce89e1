"""Reading recordings: every format behind one function.

A format is a class with `suffixes`, `sniff(path) -> bool`, `columns(path, wanted) -> Source` and, where it can,
`write(path, ...)`. What a column means (channel, unit, scale) is the same for all of them: see channel_assembly.
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
