"""The installed version, without importing anything heavy."""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("cdtool")
except PackageNotFoundError:  # a source tree that is not installed
    __version__ = "0+unknown"
