"""The colours of detectors: told apart with all cones, without red and without green ones, on white and on dark."""

from __future__ import annotations

from itertools import combinations

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


def ciede2000(first, second) -> float:
    (l1, a1, b1), (l2, a2, b2) = first, second
    mean = (np.hypot(a1, b1) + np.hypot(a2, b2)) / 2
    grey = 1.5 - 0.5 * np.sqrt(mean**7 / (mean**7 + 25**7))
    c1, c2 = np.hypot(grey * a1, b1), np.hypot(grey * a2, b2)
    h1, h2 = np.degrees(np.arctan2([b1, b2], [grey * a1, grey * a2])) % 360
    light, chroma, turn = (l1 + l2) / 2, (c1 + c2) / 2, (h2 - h1 + 180) % 360 - 180
    hue = h1 + turn / 2
    t = 1 + np.cos(np.radians([hue - 30, 2 * hue, 3 * hue + 6, 4 * hue - 63])) @ [-0.17, 0.24, 0.32, -0.2]
    by_l = (l2 - l1) / (1 + 0.015 * (light - 50) ** 2 / np.sqrt(20 + (light - 50) ** 2))
    by_c = (c2 - c1) / (1 + 0.045 * chroma)
    by_h = 2 * np.sqrt(c1 * c2) * np.sin(np.radians(turn / 2)) / (1 + 0.015 * chroma * t)
    twist = np.sin(np.radians(60 * np.exp(-(((hue % 360 - 275) / 25) ** 2))))
    rotation = -2 * np.sqrt(chroma**7 / (chroma**7 + 25**7)) * twist
    return float(np.sqrt(by_l**2 + by_c**2 + by_h**2 + rotation * by_c * by_h))


@pytest.mark.parametrize("eyes", EYES)
def test_the_five_most_used_detectors_differ_by_25_on_a_light_and_a_dark_page(eyes):
    # Sharma, Wu and Dalal 2005, table 1, pair 1.
    assert ciede2000((50, 2.6772, -79.7751), (50, 0, -82.7485)) == pytest.approx(2.0425, abs=1e-4)
    light = [look_of(name).colour for name in FIVE]
    for colours in (light, [DARK[colour] for colour in light]):
        seen = [lab(np.clip(EYES[eyes] @ linear(colour), 0, 1)) for colour in colours]
        assert min(ciede2000(*pair) for pair in combinations(seen, 2)) >= 25


def test_every_detector_has_a_contrast_of_3_on_the_page_and_dashes_of_its_own():
    looks = [look_of(name) for name in DETECTORS.table]
    light, dark = (part[:7] for part in style_sheet().split("--page: ")[1:3])
    for page, colours in ((light, [look.colour for look in looks]), (dark, DARK.values())):
        background, *luminances = (0.05 + XYZ[1] @ linear(colour) for colour in (page, *colours))
        assert all(max(background, item) / min(background, item) >= 3 for item in luminances)
    assert len({look.dashes for look in looks}) == len(looks)
