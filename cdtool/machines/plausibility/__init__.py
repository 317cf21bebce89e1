"""Whether the channels of a log are what the machine file says: signs, units and meanings, checked by mechanics."""

from cdtool.machines.plausibility.gate import check_channels, derivatives

__all__ = ["check_channels", "derivatives"]
