"""The scripts of benchmarks/, on small tasks."""
