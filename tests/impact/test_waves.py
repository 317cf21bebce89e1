"""When elastic waves matter: the ratio of the contact's duration to the first natural period."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.impact.waves import QUASI_STATIC_FROM, check_waves, rod_first_frequency, vibration_share


def test_a_rod_rings_with_the_travel_of_a_wave_there_and_back():
    speed = math.sqrt(210e9 / 7850.0)
    assert rod_first_frequency(1.0, 210e9, 7850.0) == pytest.approx(speed / 2.0)
    assert rod_first_frequency(1.0, 210e9, 7850.0, "one fixed") == pytest.approx(speed / 4.0)
    with pytest.raises(UsageError, match="ends"):
        rod_first_frequency(1.0, 210e9, 7850.0, "both fixed")
    with pytest.raises(UsageError, match="length"):
        rod_first_frequency(0.0, 210e9, 7850.0)


def test_a_long_contact_needs_no_warning_and_a_shorter_one_says_what_is_lost():
    # The steel sphere of 10 mm: 91 us against a first period of some 8 us of a steel bar of its diameter.
    small = check_waves(91.192e-6, rod_first_frequency(0.02, 210e9, 7850.0))
    assert small.quasi_static and small.warning == "" and small.ratio == pytest.approx(11.8, abs=0.05)
    long = check_waves(91.192e-6, rod_first_frequency(0.2, 210e9, 7850.0))
    assert not long.quasi_static
    assert "1.2 periods" in long.warning and "up to 107 %" in long.warning
    longer = check_waves(91.192e-6, rod_first_frequency(2.0, 210e9, 7850.0))
    assert "before the body has responded" in longer.warning


def test_the_warning_ends_where_four_per_cent_of_a_mode_are_left():
    at = check_waves(QUASI_STATIC_FROM, 1.0)
    assert at.quasi_static and not check_waves(0.999 * QUASI_STATIC_FROM, 1.0).quasi_static
    assert vibration_share(QUASI_STATIC_FROM) == pytest.approx(0.041, abs=5e-4)


@pytest.mark.parametrize("ratio", [1.0, 2.0, 5.0, 10.0])
def test_the_share_of_vibration_is_that_of_a_simulated_mode_at_its_worst(ratio):
    # Unit mass and stiffness under half a sine; its duration is moved by up to half a period about the ratio.
    def left(periods: float) -> float:
        end = 2.0 * math.pi * periods

        def motion(time: float, state: FloatArray) -> list[float]:
            return [state[1], math.sin(math.pi * time / end) - state[0]]

        found = solve_ivp(motion, (0.0, end), [0.0, 0.0], rtol=1e-9, atol=1e-12).y[:, -1]
        return float(found @ found)  # over the energy under a static force of 1

    exact = [left(periods) for periods in np.linspace(ratio, ratio + 0.5, 11)]
    shares = vibration_share(np.linspace(ratio, ratio + 0.5, 11))
    assert np.all(np.array(exact) <= shares * (1.0 + 1e-6))
    assert max(exact) >= 0.6 * shares[0]


def test_below_one_period_there_is_no_share_to_tell():
    assert math.isnan(vibration_share(0.9))


def test_durations_and_frequencies_without_meaning_are_refused():
    with pytest.raises(UsageError, match="duration"):
        check_waves(0.0, 100.0)
    with pytest.raises(UsageError, match="frequency"):
        check_waves(1e-3, math.inf)
