"""The CRC-32 of MCAP (IEEE 802.3, the same as zlib's), from ISA-L if it is installed.

ISA-L's function needs about a seventh of the time of zlib's (`benchmarks/mcap_reading.py` measures it). Both return the
same number and release the interpreter lock.
"""

from __future__ import annotations

try:
    from isal.isal_zlib import crc32
except ImportError:  # a platform without a wheel
    from zlib import crc32

__all__ = ["crc32"]
