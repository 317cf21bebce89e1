"""Files at URLs: paths that fsspec reads, staged to a bounded local cache or read by ranges."""
