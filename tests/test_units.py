"""Units: what is read, and what is refused with which remedy."""

import math

import pytest

from jaxrotor.core.errors import InputError
from jaxrotor.core.units import quantity

READ = [
    ("60 mm", "m", 0.06),
    ("0.06m", "m", 0.06),
    ("6e-2 m", "m", 0.06),
    ("210 GPa", "Pa", 2.1e11),
    ("7.85 g/cm^3", "kg/m^3", 7850.0),
    ("-9.81 m/s²", "m/s^2", -9.81),
    ("3 N·m", "N*m", 3.0),
    ("3000 rpm", "rad/s", 100 * math.pi),
    ("50 rev/s", "rad/s", 100 * math.pi),
    ("57.29577951308232 deg/s", "rad/s", 1.0),
    ("180 deg", "rad", math.pi),
    ("90 °", "rad", math.pi / 2),
    ("0.5 rad", "rad", 0.5),
    ("1 kHz", "Hz", 1000.0),
    ("0.002 1/s", "1/s", 0.002),
    ("0.002/s", "1/s", 0.002),
    ("2 ms", "s", 0.002),
    # the paper prints N s m where N m s/rad is meant: an angle below the line may be left out
    ("5 N*m*s", "N*m*s/rad", 5.0),
    ("5 N*m*s/rad", "N*m*s/rad", 5.0),
    ("1 N*m/deg", "N*m/rad", 180 / math.pi),
    (3, "", 3.0),
    (0.25, "", 0.25),
    ("20 %", "", 0.2),
    # NIST SP 811 (2008), appendix B.8
    ("1 mil", "m", 25.4e-6),
    ("2 thou", "m", 50.8e-6),
    ("1 lbm", "kg", 0.45359237),
    ("60 cpm", "Hz", 1.0),
    ("1 ft-lb", "N*m", 4.4482216152605 * 0.3048),
    ("1 lbf-in", "N*m", 4.4482216152605 * 0.0254),
]

REFUSED = [
    (0.06, "m", ["bare number 0.06", 'write "0.06 m"']),
    ("60", "m", ["must carry a unit", 'write "60 m"']),
    (1, "rad", ["must carry a unit", 'write "1 rad"']),
    ("60 kg", "m", ["must be in m", '"60 kg" is in kg', 'write "1 m"']),
    ("60 mmm", "m", ['unknown unit "mmm"', 'did you mean "60 mm"?']),
    ("210 GPA", "Pa", ['unknown unit "GPA"', 'did you mean "210 GPa"?']),
    # a frequency for a speed is the classic slip: off by 2 pi
    ("50 Hz", "rad/s", ["must be in rad/s", "is in Hz", '"3000 rpm"']),
    ("50 1/s", "rad/s", ["must be in rad/s", '"3000 rpm"']),
    ("600 rpm", "Hz", ["must be in Hz", 'write a frequency as "10 Hz"']),
    ("1 Nm", "N*m", ["must be in N*m", 'write "1 N*m"']),
    ("3 N*m*rad", "N*m", ["must be in N*m", "N*m*rad"]),
    ("0,06 m", "m", ['"0,06 m"', "decimal point"]),
    ("1.2.3 m", "m", ['"1.2.3 m"', 'write "1 m"']),
    ("about 3 m", "m", ["must be a number with its unit", 'write "1 m"']),
    ("", "m", ["must be a number with its unit", 'write "1 m"']),
    ("nan m", "m", ["must be finite", '"nan m"']),
    ("1e999 m", "m", ["must be finite", '"1e999 m"']),
    (math.inf, "", ["must be finite", "inf"]),
    (math.nan, "", ["must be finite", "nan"]),
    (True, "m", ["but is true", 'write "1 m"']),
    (["1 m"], "m", ["a list of 1", 'write "1 m"']),
    ({"value": 1}, "m", ["a table with value", 'write "1 m"']),
    ("3 m", "", ["without a unit", '"3 m"', "write 3"]),
    ("1 m; import os", "m", ["unknown unit"]),
    ("1 mil", "rad", ["another quantity"]),
    ("3 dB", "", ["a level", "1.413"]),  # 10^(3/20)
    ("5 Khz", "Hz", ["did you mean", '"5 kHz"']),
    # at once: a tower of powers would be worked out before it is refused
    ("1 (kg**9)**9**9**9", "kg", ["unknown unit"]),
    ("1 ((kg**9)**9)**9", "kg", ["unknown unit"]),
    ("1 kg" + "*kg" * 5000, "kg", ["must be a number with its unit"]),
    ("1 m" + " " * 100_000 + "x", "m", ["must be a number with its unit"]),
    (10**4000, "", ["finite", "4001 digits"]),
    ("3 __class__", "m", ["unknown unit"]),
]


@pytest.mark.parametrize("given, unit, expected", READ)
def test_a_quantity_is_read(given, unit, expected):
    assert quantity(given, unit) == pytest.approx(expected, rel=1e-15, abs=0)


@pytest.mark.parametrize("given, unit, parts", REFUSED)
def test_a_wrong_quantity_is_refused_in_one_sentence(given, unit, parts):
    with pytest.raises(InputError) as caught:
        quantity(given, unit)
    (sentence,) = caught.value.problems
    assert "\n" not in sentence
    for part in parts:
        assert part in sentence


def test_sections_lengths_come_out_exactly():
    # 60 * 0.001 in floats: what the machine in Python has
    assert [quantity(f"{n} mm", "m") for n in (60, 80, 127, 20, 12)] == [
        0.06, 0.08, 0.127, 0.02, 0.012
    ]  # fmt: skip
