"""A header's unit that contradicts the machine file makes its channel not assessable; a matching one does not."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.formats.channels.channel_map import ChannelSource
from cdtool.formats.channels.header_units import channel_unit_findings
from cdtool.formats.channels.reading import read_recording
from cdtool.formats.column_names import split_unit
from cdtool.formats.columns import Column
from tests.base.findings.facts import fact_of

LOAD = """
[machine]
type = "{kind}"
coordinates = "load"
{inertia}
"""
LINEAR = LOAD.format(kind="linear_axis", inertia="load_mass = 50.0")
ROTARY = LOAD.format(kind="rotary_axis", inertia="load_inertia = 1.0")


def unit_findings(recording, channel):
    kinds = "unit_contradicted", "clock_unit_contradicted"
    return [item for item in recording.findings if item.channel == channel and item.kind in kinds]


def recording_of(log, machine, machine_table, channel, header, stated):
    """Return the recording of a log whose column `x` has this header, if the machine file states `stated`."""
    unit = "m/s" if "linear" in machine_table else "rad/s"
    time = np.arange(30) * 0.01
    rows = "".join(f"{t:.2f};{0.1 + t:.3f};{t:.3f}\n" for t in time)
    speed = "" if channel == "speed" else f'speed = {{ column = "v", unit = "{unit}" }}\n'
    text = f'[channels]\ntime = {{ column = "t", unit = "s" }}\n{speed}{channel} = {{ column = "x", {stated} }}\n'
    path = log(f"t [s];x{f' [{header}]' if header else ''};v [{unit}]\n{rows}")
    recording = read_recording(path, machine(text, machine_table))
    assert channel == "speed" or unit_findings(recording, "speed") == []
    return recording


@pytest.mark.parametrize(
    ("kind", "channel", "header", "stated", "ratio", "advice"),
    [
        (LINEAR, "position", "mm", 'unit = "m"', 1000.0, "unit"),
        (LINEAR, "speed", "mm/s", 'unit = "m/s"', 1000.0, "unit"),
        (LINEAR, "force", "kN", 'unit = "N"', 1000.0, "unit"),
        (LINEAR, "force", "N", 'unit = "kN"', 1000.0, "unit"),
        (LINEAR, "force", "filtered", 'unit = "N"', 0.0, "no unit"),
        (LINEAR, "force", "N*10", 'unit = "N"', 0.0, "no unit"),
        (LINEAR, "torque", "actual", 'unit = "N"', 0.0, "no unit"),
        (LINEAR, "contact_pressure", "filtered", 'unit = "kPa"', 0.0, "no unit"),
        (LINEAR, "acceleration", "g", 'unit = "m/s2", scale = -1', 9.807, "unit"),
        (ROTARY, "speed", "rpm", 'unit = "rad/s"', 9.549, "unit"),
        (ROTARY, "speed", "1/min", 'unit = "rad/s"', 9.549, "unit"),
        (ROTARY, "position", "deg", 'unit = "rad"', 57.3, "unit"),
        (ROTARY, "torque", "mNm", 'unit = "N m"', 1000.0, "unit"),
        (ROTARY, "torque", "mA", 'unit = "A", scale = 0.5', 1000.0, "unit"),
        (ROTARY, "torque", "A", 'unit = "N m"', 0.0, "unit and scale: N m per A"),
        (ROTARY, "torque", "Nm", 'unit = "A", scale = 0.5', 0.0, "unit without scale"),
        (ROTARY, "torque", "V", 'unit = "A", scale = 0.5', 0.0, "unit and scale: N m per V"),
        (ROTARY, "torque", "%", 'unit = "1", scale = 20', 100.0, "unit"),
        (ROTARY, "position", "count", 'unit = "rad"', 0.0, "unit and scale: rad per count"),
        (ROTARY, "torque", "mNm", 'unit = "N m", scale = 50', 1000.0, "unit"),
        (ROTARY, "speed", "Nm", 'unit = "rad/s"', 0.0, "other column"),
    ],
    ids=lambda value: value if isinstance(value, str) and "[machine]" not in value else "",
)
def test_a_header_that_contradicts_the_machine_file_is_a_loss_and_its_channel_has_no_value(
    log, machine, kind, channel, header, stated, ratio, advice
):
    recording = recording_of(log, machine, kind, channel, header, stated)
    (finding,) = unit_findings(recording, channel)
    told = {"header": f"x [{header}]", "header_unit": header, "more": 0, "stated": stated.split('"')[1]}
    what, _, scale = advice.partition(": ")
    told |= {"ratio": pytest.approx(ratio, rel=1e-3), "advice": what, "scale": scale}
    assert fact_of(finding) == ("unit_contradicted", told)
    harmless = advice == "no unit" and channel != "contact_pressure"
    assert finding.severity == ("note" if harmless else "loss")
    if not harmless:
        assert channel not in recording or np.isnan(recording[channel].values).all()


@pytest.mark.parametrize(
    ("kind", "channel", "header", "stated"),
    [
        (LINEAR, "position", "mm", 'unit = "mm"'),
        (LINEAR, "position", "mm", 'unit = "m", scale = 0.001'),
        (LINEAR, "position", "mm", 'unit = "m", scale = -0.001'),
        (LINEAR, "acceleration", "m/s^2", 'unit = "m/s2", scale = -1'),
        (LINEAR, "force", "kgf", 'unit = "N", scale = 9.81'),
        (ROTARY, "speed", "1/min", 'unit = "rpm", scale = -1'),
        (ROTARY, "speed", "rpm", 'unit = "rad/s", scale = 0.1047'),
        (ROTARY, "torque", "Nm", 'unit = "N m", scale = 50'),
        (ROTARY, "torque", "mA", 'unit = "mA", scale = 0.5'),
        (ROTARY, "torque", "Nm", 'unit = "1", scale = 1'),
        (ROTARY, "torque", "counts", 'unit = "1", scale = 0.1'),
        (ROTARY, "torque", "%", 'unit = "N m", scale = 0.23'),
        (ROTARY, "torque", "A", 'unit = "N m", scale = -0.056'),
        (ROTARY, "position", "count", 'unit = "rad", scale = 0.0015'),
        (LINEAR, "force", "V", 'unit = "N", scale = 200'),
        (LINEAR, "force", "kN", 'unit = "N", scale = 1000'),
        (LINEAR, "force", "kN", 'unit = "N", unit_confirmed = true'),
        (LINEAR, "force", "lbs", 'unit = "lbf"'),
        (LINEAR, "force", "Kilopond", 'unit = "kgf"'),
        (LINEAR, "force", "raw", 'unit = "N", unit_confirmed = true'),
        (LINEAR, "speed", "Meter pro Sekunde", 'unit = "m/s"'),
        (ROTARY, "torque", "", 'unit = "N m"'),
        (ROTARY, "label", "V", "scale = 1"),
        (ROTARY, "trigger", "mV", "scale = 0.2"),
    ],
    ids=lambda value: value if isinstance(value, str) and "[machine]" not in value else "",
)
def test_a_header_with_a_matching_or_unknown_unit_is_not_reported(log, machine, kind, channel, header, stated):
    assert unit_findings(recording_of(log, machine, kind, channel, header, stated), channel) == []


@pytest.mark.parametrize(
    ("column", "fits"),
    [
        ("F_kN", False),
        ("Kraft in daN", False),
        ("Kraft [kN] gefiltert", False),
        ("Kraft [N] (gefiltert)", True),
        ("Kraft (1)", False),
        ("wrench.force[1]", True),
        ("F_N", True),
        ("Kraft Newton", True),
        ("Fz_max", True),
        ("AI/10 [N]", True),
        ("Kraft 100Hz", True),
        ("Kraft [N] (max. 10 kN)", True),
    ],
)
def test_the_name_of_a_force_may_state_its_unit(column, fits):
    force = ChannelSource("force", (column,), unit="N", stated="N")
    found = channel_unit_findings(force, [Column(column, np.empty(0), unit=split_unit(column)[1])])
    assert not found if fits else found[0].numbers["header"] == column


def test_a_channel_of_linear_and_rotary_joints_is_in_the_si_unit_of_each():
    both = ChannelSource("position", ("a", "b"), factor=(1.0, 1.0), unit="SI", stated="SI")
    columns = [Column("a", np.empty(0), unit="rad"), Column("b", np.empty(0), unit="m")]
    assert channel_unit_findings(both, columns) == []
    columns[0] = Column("a", np.empty(0), unit="deg")
    fact = fact_of(channel_unit_findings(both, columns)[0])
    assert (fact.numbers["header"], fact.numbers["stated"]) == ("a [deg]", "SI")


def test_a_row_of_units_is_compared_with_the_machine_file(log, machine):
    channels = '[channels]\ntime = { column = "t", unit = "s" }\nposition = { column = "pos", unit = "m" }\n'
    rows = "".join(f"{0.01 * k:.2f};{k}\n" for k in range(30))
    recording = read_recording(log(f"t;pos\ns;mm\n{rows}"), machine(channels, LINEAR))
    fact = fact_of(unit_findings(recording, "position")[0])
    assert (fact.numbers["header"], fact.numbers["stated"]) == ("pos [mm]", "m")


def test_joints_with_the_same_wrong_unit_are_one_warning(log, machine):
    channels = """
[channels]
time = { column = "t", unit = "s" }
position = { columns = ["a", "b"], unit = "rad" }
speed = { columns = ["c", "d"], unit = "rad/s" }
"""
    rows = "".join(f"{0.01 * k:.2f};{k};{2 * k};{3 * k};{4 * k}\n" for k in range(30))
    recording = read_recording(
        log(f"t [s];a [deg];b [deg];c [rad/s];d [rpm]\n{rows}"), machine(channels, ROTARY + 'joints = ["a", "b"]\n')
    )
    assert [(item.numbers["header"], item.numbers["more"]) for item in unit_findings(recording, "position")] == [
        ("a [deg]", 1)
    ]
    assert [(item.numbers["header"], item.numbers["more"]) for item in unit_findings(recording, "speed")] == [
        ("d [rpm]", 0)
    ]


@pytest.mark.parametrize(
    ("header", "time", "rate", "ratio"),
    [
        ("ms", 'unit = "s"', 0.0, 1000.0),
        ("mm", 'unit = "s"', 0.0, 0.0),
        ("ms", "rate_hz = 100", 100.0, 10.0),
        ("ms", "rate_hz = 1000", 1000.0, None),
        ("count", "rate_hz = 100", 100.0, None),
        ("s", 'unit = "s"', 0.0, None),
    ],
)
def test_the_unit_of_the_clock_is_compared_with_the_machine_file(log, machine, header, time, rate, ratio):
    channels = f'[channels]\ntime = {{ column = "t", {time} }}\nposition = {{ column = "x", unit = "m" }}\n'
    rows = "".join(f"{k};{k}\n" for k in range(30))
    findings = unit_findings(read_recording(log(f"t [{header}];x [m]\n{rows}"), machine(channels, LINEAR)), "time")
    fact = (
        "clock_unit_contradicted",
        {
            "header": f"t [{header}]",
            "header_unit": header,
            "stated": "s",
            "rate": rate,
            "ratio": None if ratio is None else pytest.approx(ratio),
        },
    )
    assert [fact_of(item) for item in findings] == ([] if ratio is None else [fact])
