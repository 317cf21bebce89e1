"""Samples for test_markers.py: functions that start a program or drive a browser, directly or by a fixture."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest


def starts_a_program() -> object:
    return subprocess.run


@pytest.fixture
def program() -> object:
    return starts_a_program()


def uses_a_fixture_that_starts_one(program: object) -> object:
    return program


def drives_a_browser() -> object:
    from selenium import webdriver

    return webdriver


def starts_nothing(tmp_path: Path) -> Path:
    return tmp_path
