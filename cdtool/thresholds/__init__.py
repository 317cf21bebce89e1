"""Thresholds: what is normal. One file a threshold."""

from __future__ import annotations

from cdtool.registry import Registry

THRESHOLDS = Registry(
    kind="threshold",
    table={
        "signature": "cdtool.thresholds.signature:Signature",
        "limit": "cdtool.thresholds.limit:Limit",
    },
    contract=("name", "needs", "safety_factor", "fit"),
    settings=(),
)
