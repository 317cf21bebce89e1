"""Fuzz targets of the readers, and the inputs they have found."""
