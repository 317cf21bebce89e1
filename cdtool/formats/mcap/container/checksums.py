"""CRC-32 as MCAP uses it (IEEE 802.3, the polynomial of zlib), at the speed of memory.

zlib's takes half as long as decompressing does, ISA-L's about an eighth (`benchmarks/mcap.py`). Both give the same
number and release the interpreter lock.
"""

from __future__ import annotations

try:
    from isal.isal_zlib import crc32
except ImportError:  # a platform without a wheel
    from zlib import crc32

__all__ = ["crc32"]
