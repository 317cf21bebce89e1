"""The colours of detectors: told apart with all cones, without red and without green ones, on white and on dark."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from cdtool.detectors import DETECTORS
from cdtool.detectors.look import DARK
from cdtool.report.html.self_contained import style_sheet
from cdtool.report.plots.style import look_of

FIVE = ("pure_torque", "pure_inertia", "momentum", "inertial_momentum", "friction_ekf")
# Machado, Oliveira and Fernandes 2009, severity 1.0, on linear RGB.
EYES = {
    "normal": np.eye(3),
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
}
XYZ = np.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.072175], [0.0193339, 0.119192, 0.9503041]])


def linear(colour: str) -> np.ndarray:
    rgb = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def lab(rgb: np.ndarray) -> np.ndarray:
    share = XYZ @ rgb / XYZ.sum(axis=1)
    x, y, z = np.where(share > 216 / 24389, np.cbrt(share), (24389 / 27 * share + 16) / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def ciede2000(first: np.ndarray, second: np.ndarray) -> float:
    (l1, a1, b1), (l2, a2, b2) = first, second
    mean = (np.hypot(a1, b1) + np.hypot(a2, b2)) / 2
    grey = 1.5 - 0.5 * np.sqrt(mean**7 / (mean**7 + 25**7))
    c1, c2 = np.hypot(grey * a1, b1), np.hypot(grey * a2, b2)
    h1, h2 = np.degrees(np.arctan2(b1, grey * a1)) % 360, np.degrees(np.arctan2(b2, grey * a2)) % 360
    light, chroma, turn = (l1 + l2) / 2, (c1 + c2) / 2, (h2 - h1 + 180) % 360 - 180
    hue = h1 + turn / 2
    cos = [np.cos(np.radians(k * hue - at)) for k, at in ((1, 30), (2, 0), (3, -6), (4, 63))]
    t = 1 - 0.17 * cos[0] + 0.24 * cos[1] + 0.32 * cos[2] - 0.2 * cos[3]
    twist = np.radians(60 * np.exp(-(((hue % 360 - 275) / 25) ** 2)))
    by_l = (l2 - l1) / (1 + 0.015 * (light - 50) ** 2 / np.sqrt(20 + (light - 50) ** 2))
    by_c = (c2 - c1) / (1 + 0.045 * chroma)
    by_h = 2 * np.sqrt(c1 * c2) * np.sin(np.radians(turn / 2)) / (1 + 0.015 * chroma * t)
    rotation = -2 * np.sqrt(chroma**7 / (chroma**7 + 25**7)) * np.sin(twist)
    return float(np.sqrt(by_l**2 + by_c**2 + by_h**2 + rotation * by_c * by_h))


def contrast(first: str, second: str) -> float:
    low, high = sorted(float(XYZ[1] @ linear(colour)) for colour in (first, second))
    return (high + 0.05) / (low + 0.05)


def test_the_difference_of_colours_is_that_of_its_authors():
    """Sharma, Wu and Dalal 2005, table 1, pairs 1, 13 and 25."""
    for first, second, expected in (
        ((50, 2.6772, -79.7751), (50, 0, -82.7485), 2.0425),
        ((50, -0.001, 2.49), (50, 0.0011, -2.49), 4.7461),
        ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644),
    ):
        assert ciede2000(np.array(first), np.array(second)) == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("eyes", EYES)
def test_the_five_most_used_detectors_differ_by_25_on_a_light_and_a_dark_page(eyes):
    for colours in ([look_of(name).colour for name in FIVE], [DARK[look_of(name).colour] for name in FIVE]):
        seen = [lab(np.clip(EYES[eyes] @ linear(colour), 0, 1)) for colour in colours]
        assert min(ciede2000(*pair) for pair in itertools.combinations(seen, 2)) >= 25


def test_every_detector_has_a_contrast_of_3_on_the_page_and_dashes_of_its_own():
    looks = [look_of(name) for name in DETECTORS.table]
    light, dark = (style_sheet().split("--page: ")[i][:7] for i in (1, 2))
    assert all(contrast(look.colour, light) >= 3 for look in looks)
    assert len(DARK) == 5 and all(contrast(colour, dark) >= 3 for colour in DARK.values())
    assert len({look.dashes for look in looks}) == len(looks)
