"""Thresholds: what is normal for a signal. One file per threshold."""

from __future__ import annotations

from cdtool.base.registry import Registry

THRESHOLDS = Registry(
    kind="threshold",
    table={
        "signature": "cdtool.thresholds.signature:Signature",
        "limit": "cdtool.thresholds.limit:Limit",
        "predicted_limit": "cdtool.thresholds.predicted_limit:PredictedLimit",
        "trend": "cdtool.thresholds.trend:Trend",
        "limit_and_trend": "cdtool.thresholds.limit_and_trend:LimitAndTrend",
        "adaptive": "cdtool.thresholds.adaptive:Adaptive",
        "innovation": "cdtool.thresholds.innovation:Innovation",
        "cusum": "cdtool.thresholds.cusum:Cusum",
        "glr": "cdtool.thresholds.glr:Glr",
        "combined": "cdtool.thresholds.combined:Combined",
        "baseline": "cdtool.thresholds.baseline:Baseline",
    },
    contract=("name", "needs", "fitted", "safety_factor", "fit"),
    settings=(),
)
