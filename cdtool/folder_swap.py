"""Exchanging a folder for another in one step, so that a reader sees the old one or the new one and never a mixture."""

from __future__ import annotations

import errno
import os
from pathlib import Path

_HERE = -100  # AT_FDCWD
_EXCHANGE = 2  # RENAME_EXCHANGE
_UNABLE = (errno.ENOSYS, errno.EINVAL, errno.EXDEV, errno.EBUSY, errno.EOPNOTSUPP, errno.EPERM)


def exchange(first: Path, second: Path) -> bool:
    """Exchange two folders by one call (Linux: renameat2); False where system or file system cannot; raises OSError."""
    import ctypes

    try:
        call = ctypes.CDLL(None, use_errno=True).renameat2
    except (AttributeError, OSError, TypeError):
        return False
    if call(_HERE, os.fsencode(first), _HERE, os.fsencode(second), _EXCHANGE) == 0:
        return True
    fault = ctypes.get_errno()
    if fault in _UNABLE:
        return False
    raise OSError(fault, os.strerror(fault), str(second))


def has_to_stay(folder: Path) -> bool:
    """An existing folder that must not be renamed: a mount point, the current folder, or one in a read-only folder."""
    if not folder.is_dir():
        return False
    try:
        inside = Path(os.path.realpath(Path.cwd())).is_relative_to(folder)
    except FileNotFoundError:  # the current folder is gone
        inside = False
    return inside or folder.is_mount() or not os.access(folder.parent, os.W_OK | os.X_OK)
