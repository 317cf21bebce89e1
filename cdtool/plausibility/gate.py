"""The checks of a machine file's channels by mechanics, on impact-free logs or on what is before a contact.

Three answers for each: it agrees, it contradicts, or the motion does not show it. What contradicts is a loss: no
detector may use the channel until the machine file is corrected, or confirms it with `confirmed = true`.
"""

from __future__ import annotations

from collections.abc import Container, Sequence

from cdtool.dynamics import Machine
from cdtool.findings import Finding
from cdtool.findings.channels import DerivedSpeed, IntegratedPosition
from cdtool.plausibility.derivatives import derivative_checks
from cdtool.plausibility.drive import drive_checks
from cdtool.recording import Recording


def check_channels(
    recordings: Sequence[Recording], machine: Machine, confirmed: Container[str] = ()
) -> tuple[Finding, ...]:
    """Return the answer of each check of torque, speed and acceleration, for all logs together.

    Parameters
    ----------
    recordings : sequence of Recording
        Logs of one machine on the load side, without contacts.
    machine : Machine
        The machine: its inertia is compared with what starts show.
    confirmed : container of str, optional
        Channels that the machine file confirms; they are not checked.

    Returns
    -------
    tuple of Finding
        Of `ChannelCheck` each: a contradiction is a loss, all else a note.
    """
    checked = derivatives(recordings, confirmed)
    if not any(item.severity == "loss" and item.channel == "speed" for item in checked) and "torque" not in confirmed:
        checked += drive_checks([item for item in recordings if "speed" in item], machine)
    return tuple(checked)


def derivatives(recordings: Sequence[Recording], confirmed: Container[str] = ()) -> list[Finding]:
    """Return whether the speed is the derivative of the position and the acceleration that of the speed.

    A speed that contradicts the position says nothing about the acceleration.
    """
    measured = [item for item in recordings if "speed" in item]
    derived = any(
        isinstance(found.fact, DerivedSpeed | IntegratedPosition) for item in measured for found in item.findings
    )
    found = [] if derived or "speed" in confirmed else list(derivative_checks(measured, "speed", "position"))
    if "acceleration" in confirmed or any(item.severity == "loss" for item in found):
        return found
    return [*found, *derivative_checks(measured, "acceleration", "speed")]
