"""machine.toml: accepted content, and errors that name the key and what is allowed."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from cdtool.base.errors import ConfigurationError, MistakesError
from cdtool.detectors.momentum import Momentum
from cdtool.formats.machine_file import fingerprint, read_machine_file

MACHINE = """
[machine]
type = "linear_axis"
name = "gate"
motor_inertia = 9.5e-4
load_mass = 620.0
transmission_ratio = 1.3333e-3
viscous_friction = 2.67e-4
coulomb_friction = 0.0
"""
CHANNELS = """
[channels]
time = { column = "t", unit = "ms" }
torque = { column = "i_motor", unit = "A", scale = 0.56 }
speed = { column = "n_motor", unit = "rpm" }
position = { column = "phi", unit = "rad" }
acceleration = { column = "acc_x", unit = "g", scale = -1, time_offset = 0.002 }
force = { column = "load_cell", unit = "kN" }
[channels.mcap]
position = { topic = "/joint_states", field = "position[0]" }
[detectors.friction_ekf]
minimum_speed = 0.02
"""


def read(tmp_path: Path, text: str):
    path = tmp_path / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return read_machine_file(path)


def test_the_example_of_the_documentation_is_read(tmp_path):
    file = read(tmp_path, MACHINE + CHANNELS)
    assert file.machine.nominal_inertia[0] == pytest.approx(620.0 + 9.5e-4 / 1.3333e-3**2)
    assert file.machine.friction(np.array([[2.0]]))[0, 0] == pytest.approx(2.0 * 2.67e-4 / 1.3333e-3**2)
    by_name = {source.channel: source for source in file.columns.sources}
    assert by_name["torque"].factor == (0.56,) and by_name["torque"].unit == "N m"
    assert by_name["speed"].factor == pytest.approx((2.0 * math.pi / 60.0,))
    assert by_name["acceleration"].factor == pytest.approx((-9.80665,))
    assert by_name["acceleration"].time_offset == 0.002
    assert by_name["force"].factor == (1000.0,)
    assert file.columns.time.factor == 1e-3
    assert [source.topic for source in file.topics.sources] == ["/joint_states"]
    assert file.detector("feekf").minimum_speed == 0.02
    assert file.detector("gm") == Momentum()


@pytest.mark.parametrize(
    ("old", "new", "key", "allowed"),
    [
        ('type = "linear_axis"', 'type = "linear_axes"', "machine.type", "linear_axis"),
        ("load_mass = 620.0", "load_mas = 620.0", "machine.load_mas", "did you mean load_mass"),
        ("load_mass = 620.0", "load_mass = -1.0", "machine.load_mass", "at least 0"),
        ("load_mass = 620.0", 'load_mass = "heavy"', "machine.load_mass", "number"),
        ("transmission_ratio = 1.3333e-3", "transmission_ratio = 0.0", "machine.transmission_ratio", "travel"),
        ('name = "gate"', 'name = "gate"\ncolour = "red"', "machine.colour", "unknown key"),
        ('unit = "rpm"', 'unit = "rmp"', "channels.speed.unit", "rpm"),
        ('unit = "rpm"', 'unit = "kN"', "channels.speed.unit", "rad/s"),
        (", scale = 0.56 }", " }", "channels.torque.scale", "N m per A"),
        ('speed = { column = "n_motor", unit = "rpm" }', 'speed = { column = "n" }', "channels.speed.unit", "missing"),
        ("speed = { column", "sped = { column", "channels.sped", "speed"),
        ('time = { column = "t", unit = "ms" }', "", "channels.time", "is missing"),
        ('unit = "ms"', 'unit = "mm"', "channels.time.unit", "unit of time"),
        ('column = "phi"', "column = -1", "channels.position.column", "counted from 0"),
        ('column = "phi"', 'columns = ["a", "b"]', "channels.position.columns", "give 1"),
        ('field = "position[0]"', 'feild = "position[0]"', "channels.mcap.position.feild", "did you mean field"),
        ("[detectors.friction_ekf]", "[detectors.friction]", "detectors.friction", "friction_ekf"),
        ("minimum_speed = 0.02", "minimum_sped = 0.02", "minimum_sped", "minimum_speed"),
        ("minimum_speed = 0.02", "minimum_speed = 0", "minimum_speed", "above 0"),
        ("[channels]", "[chanels]", "chanels", "channels"),
    ],
)
def test_a_wrong_key_or_value_is_named_with_what_is_allowed(tmp_path, old, new, key, allowed):
    text = MACHINE + CHANNELS
    assert old in text
    with pytest.raises(ConfigurationError) as caught:
        read(tmp_path, text.replace(old, new, 1))
    assert "machine.toml" in str(caught.value)
    assert key in str(caught.value) and allowed in str(caught.value)
    lines = str(caught.value).splitlines()
    assert len(lines) == 1


def test_missing_and_broken_files_are_one_line(tmp_path):
    with pytest.raises(ConfigurationError, match="no such file"):
        read_machine_file(tmp_path / "none.toml")
    with pytest.raises(ConfigurationError, match="line 2"):
        read(tmp_path, "[machine]\nname = = 3\n")


def test_the_fingerprint_changes_with_every_parameter(tmp_path):
    one = fingerprint(read(tmp_path, MACHINE).machine)
    assert one == fingerprint(read(tmp_path, MACHINE).machine)
    assert one != fingerprint(read(tmp_path, MACHINE.replace("620.0", "620.1")).machine)
    assert one != fingerprint(
        read(tmp_path, MACHINE.replace("coulomb_friction = 0.0", "coulomb_friction = 0.1")).machine
    )


def test_a_motor_voltage_can_replace_the_torque(tmp_path):
    torque = (
        'torque = { column = "pwm", unit = "%", kind = "duty", supply_voltage = 24.0, resistance = 0.5, '
        "back_emf_constant = 0.05, torque_constant = 0.05 }"
    )
    text = MACHINE + CHANNELS.replace('torque = { column = "i_motor", unit = "A", scale = 0.56 }', torque)
    source = next(item for item in read(tmp_path, text).columns.sources if item.channel == "torque")
    assert source.duty is not None and source.duty.supply_voltage == 24.0 and source.factor == (0.01,)
    with pytest.raises(ConfigurationError, match="resistance"):
        read(tmp_path, text.replace("resistance = 0.5, ", ""))


def test_gains_of_one_detector_under_both_its_names_are_refused(tmp_path):
    text = MACHINE + CHANNELS + "[detectors.feekf]\nminimum_speed = 0.04\n"
    with pytest.raises(ConfigurationError, match=r"detectors\.feekf.*repeats friction_ekf"):
        read(tmp_path, text)


LABEL = '[channels]\ntime = { column = "t", unit = "s" }\nlabel = { column = "class", kinds = KINDS }\n'


def test_the_values_of_a_label_have_kinds(tmp_path):
    file = read(tmp_path, MACHINE + LABEL.replace("KINDS", '{ 1 = "hard", "2.5" = "soft", "-1" = "hard" }'))
    assert file.columns.sources[0].kinds == ((1.0, "hard"), (2.5, "soft"), (-1.0, "hard"))
    assert file.label_kinds == ("hard", "soft")


@pytest.mark.parametrize(
    ("kinds", "said"),
    [
        ("{}", "is empty"),
        ("{ hard = 1 }", "kinds.hard: is 1"),
        ('{ nan = "hard" }', "kinds.nan: is not a number"),
        ('{ 1 = "" }', "kinds.1: has no name"),
        ("{ 1 = 2 }", "kinds.1: is 2"),
        ('{ 1 = "hard", "1.0" = "soft" }', "a value twice"),
        ('["hard"]', "kinds: is "),
    ],
)
def test_wrong_kinds_of_a_label_name_their_key(tmp_path, kinds, said):
    with pytest.raises(ConfigurationError, match=said):
        read(tmp_path, MACHINE + LABEL.replace("KINDS", kinds))


MISTAKEN = """
name = 3
joints = ["a", "a"]
motor_inertia = [1.0, 2.0, 3.0]
transmission_ratio = 0
load_inertia = "heavy"
[channels]
time = { column = "t", unit = "furlong" }
torque = { columns = ["a", "b", "c"], unit = "A" }
speed = { columns = ["a", "b"], unit = "kg", scale = 0 }
position = { columns = ["a", "b"], unit = "rad", min = 5, max = 1, saturation = [3, 1] }
force = { columns = ["x", "x"], unit = "N", direction = [0, 0] }
acceleration = { unit = "rad/s2", scale = [1, 2, 3] }
[detectors]
gm = { gain = 3 }
[model.friction]
viscous = [1, 2, 3]
"""


@pytest.mark.parametrize("kind", ['type = "rotary_axis"', "type = rotary_axis", 'type = "rotary"', ""])
def test_no_mistake_hides_another_nor_leads_to_a_false_one(tmp_path, kind):
    with pytest.raises(MistakesError) as caught:
        read(tmp_path, f"[machine]\n{kind}{MISTAKEN}")
    keys = {fault.key for fault in caught.value.mistakes}
    assert keys - {"machine.type", ""} == {
        "machine.name",
        "machine.joints",
        "machine.motor_inertia",
        "machine.transmission_ratio",
        "machine.load_inertia",
        "channels.time.unit",
        "channels.torque.columns",
        "channels.torque.scale",
        "channels.speed.unit",
        "channels.speed.scale",
        "channels.position.min",
        "channels.position.saturation",
        "channels.force.columns",
        "channels.force.direction",
        "channels.acceleration.column",
        "channels.acceleration.scale",
        "detectors.gm.gain",
        "model.friction.viscous",
    }
    assert len(caught.value.mistakes) == len(keys)


ARM = """
[machine]
type = "planar_arm"
joints = ["arm", "forearm", "hand"]
link_mass = [1.3, 1.6]
link_length = 0.3
centre_of_mass = [0.14, 0.18]
link_inertia = [1.0, 2.0, 3.0]
[channels]
time = { rate_hz = -1000 }
torque = { columns = ["a"], unit = "N m" }
speed = { columns = ["a", "b"], unit = "rad/s" }
position = { columns = ["a", -1], unit = "count", scale = [1, 2] }
force = { file = "cell.csv", column = "F", unit = "N" }
contact_pressure = { file = "{stem}.csv", column = "p", unit = "bar", trigger = "sync", time = { rate_hz = 5 } }
[channels.mcap]
speed = { topic = "/joint_states", field = "velocity[0" }
torque = { scale = 2 }
[detectors]
gm = { bandwidth = [1, 2, 3] }
momentum = { bandwidth = 2 }
feekf = { minimum_spede = 2, sigma_speed = -1 }
"""


def test_what_follows_from_a_mistake_of_an_arm_is_not_called_wrong(tmp_path):
    with pytest.raises(MistakesError) as caught:
        read(tmp_path, ARM)
    assert [fault.key for fault in caught.value.mistakes] == [
        "machine.joints",
        "machine.transmission_ratio",
        "machine.link_inertia",
        "channels.time.rate_hz",
        "channels.position.columns[2]",
        "channels.contact_pressure.trigger",
        "channels.torque.columns",
        "channels.force.file",
        "channels.force.clock",
        "channels.force.time",
        "channels.mcap.speed.field",
        "channels.mcap.torque.topic",
        "channels.mcap.torque.field",
        "detectors.gm.bandwidth",
        "detectors.momentum",
        "detectors.feekf.minimum_spede",
        "detectors.feekf.sigma_speed",
    ]
    assert "give 2: one per joint" in str(caught.value)
