"""Tests of cdtool/commands/inject."""
