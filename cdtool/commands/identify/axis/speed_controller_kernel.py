"""The sampled speed controller driven by logged references and speeds, for output-error identification.

Per period h, with the raw speed v_raw (logged, or the position's difference)::

    v     = LP(LP(v_raw))                      order 0, 1 or 2, held-input low-passes
    e     = v_ref + position_gain (x_ref - x) - v
    w     = speed_gain e + I
    u    += clip(w - u, +-slew_limit h), then clipped to +-force_limit
    I    += (integral_gain e + anti_windup_rate (u - w)) h
    y    += (1 - exp(-h / lag)) (u - y)

A controller that is faster than its log runs `substeps` times per period, on the interpolated error.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cdtool.base.kernels import kernel

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]

# fmt: off
PARAMETER_ORDER = (
    "period", "speed_gain", "integral_gain", "position_gain", "anti_windup_rate", "slew_limit", "force_limit",
    "speed_filter_hz", "speed_filter_order", "lag", "delay_samples", "substeps",
)
# fmt: on
"""The numbers that the kernel unpacks."""

INPUTS = ("reference_speed", "position_error", "raw_speed")
"""The rows of the inputs, one value per sample."""


@kernel(
    "void(UniTuple(float64, 12), int64[::1], float64[::1], float64[::1], float64[:, ::1], float64[::1])",
)
def simulate_controller(
    parameters: tuple[float, ...], starts: Indices, integrals: Array, commands: Array, inputs: Array, output: Array
) -> None:
    """Fill `output` (n,) with the force that follows the controller's command [N].

    `starts` (sections + 1,): the first sample of each section, and n at the end. `integrals` (sections,): I at the
    start of each section [N]. `commands` (sections,): the first command of each section [N], NaN for an unlimited one.
    A section starts in the steady state of its filters.
    `inputs` (3, n): a row per name of `INPUTS`. `delay_samples` may be negative where a log writes the command first.
    """
    (
        period,
        speed_gain,
        integral_gain,
        position_gain,
        anti_windup_rate,
        slew_limit,
        force_limit,
        speed_filter_hz,
        speed_filter_order,
        lag,
        delay_samples,
        substeps,
    ) = parameters
    speed_keep = 0.0
    if speed_filter_order > 0.5 and speed_filter_hz < math.inf:
        speed_keep = math.exp(-2.0 * math.pi * speed_filter_hz * period)
    force_keep = math.exp(-period / lag) if lag > 0.0 else 0.0
    step = period / substeps
    largest_change = slew_limit * step
    delay = int(delay_samples)
    for section in range(integrals.size):
        first, end = starts[section], starts[section + 1]
        # The position's difference is a sequence of counts: one of them is no speed.
        settled = 0.0
        count = min(end - first, 10)
        for sample in range(first, first + count):
            settled += inputs[2, sample] / count
        once_filtered = settled
        measured_speed = settled
        integral = integrals[section]
        command = 0.0
        force = 0.0
        error_before = 0.0
        for sample in range(first, end):
            source = min(max(sample - delay, first), end - 1)
            once_filtered = speed_keep * once_filtered + (1.0 - speed_keep) * inputs[2, source]
            if speed_filter_order > 1.5:
                measured_speed = speed_keep * measured_speed + (1.0 - speed_keep) * once_filtered
            else:
                measured_speed = once_filtered
            error = inputs[0, source] + position_gain * inputs[1, source] - measured_speed
            if sample == first:
                error_before = error
                command = speed_gain * error + integral
                if not math.isnan(commands[section]):
                    command = commands[section]
            for substep in range(int(substeps)):
                held = error_before + (error - error_before) * (substep + 1.0) / substeps
                wanted = speed_gain * held + integral
                if sample > first or math.isnan(commands[section]):
                    command += min(max(wanted - command, -largest_change), largest_change)
                command = min(max(command, -force_limit), force_limit)
                integral += (integral_gain * held + anti_windup_rate * (command - wanted)) * step
            error_before = error
            force = command if sample == first else force_keep * force + (1.0 - force_keep) * command
            output[sample] = force
