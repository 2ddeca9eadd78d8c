"""Weight, speed and air as users have them: what they come to, and the commands that take them."""

import math

import pytest

from rotorjax.bench.as_flown import advance_ratio, in_air, thrust_coefficient
from rotorjax.cli import main
from rotorjax.errors import InputError
from rotorjax.operating import standard_air
from rotorjax.rotor.catalogue import load


@pytest.mark.parametrize(
    ("altitude", "density", "sound_speed"),  # ISO 2533, geopotential altitudes
    [(0.0, 1.2250, 340.294), (2000.0, 1.00649, 332.529), (5000.0, 0.736116, 320.529), (11000.0, 0.363918, 295.070)],
)
def test_the_standard_atmosphere(altitude, density, sound_speed):
    air = standard_air(altitude)
    assert air.density == pytest.approx(density, rel=1e-5)
    assert air.sound_speed == pytest.approx(sound_speed, rel=1e-5)


def test_weight_and_speed_come_to_coefficients():
    rotor, operating = load("uh60")
    thin = in_air(operating, altitude=2000.0)
    area, tip = math.pi * float(rotor.radius) ** 2, float(operating.omega * rotor.radius)
    assert thrust_coefficient(72e3, rotor, thin) == pytest.approx(72e3 / (1.00649 * area * tip**2), rel=1e-5)
    assert advance_ratio(0.2 * tip, rotor, thin) == pytest.approx(0.2)
    assert in_air(operating) is operating
    assert float(in_air(operating, density=1.0).density) == 1.0
    assert float(in_air(operating, density=1.0).sound_speed) == float(operating.sound_speed)


def test_what_cannot_be_is_named():
    rotor, operating = load("uh60")
    for change, words in (
        (lambda: in_air(operating, 1000.0, 1.0), "density"),
        (lambda: in_air(operating, 2e4), "altitude"),
        (lambda: in_air(operating, density=-1.0), "density"),
        (lambda: thrust_coefficient(-5.0, rotor, operating), "weight"),
        (lambda: advance_ratio(math.nan, rotor, operating), "speed"),
    ):
        with pytest.raises(InputError, match=words):
            change()


@pytest.mark.parametrize(
    ("command", "place"),
    [("trim", "rotorjax.trim.curve.curve"), ("linearise --out {tmp}", "rotorjax.linearisation.schedule.flights")],
)
def test_commands_take_them_alike(command, place, monkeypatch, tmp_path):
    found = []

    def asked(requests, *_, **__):
        found.extend(requests)
        raise KeyboardInterrupt

    monkeypatch.setattr(place, asked)
    line = [*command.format(tmp=tmp_path).split(), "--weight", "72000", "--speed", "0", "30", "--altitude", "2000"]
    assert main(line) == 130
    rotor, operating = load("uh60")
    thin = in_air(operating, 2000.0)
    assert [one.advance for one in found] == [advance_ratio(v, rotor, thin) for v in (0.0, 30.0)]
    assert {one.thrust for one in found} == {thrust_coefficient(72e3, rotor, thin)}
    assert {float(one.operating.density) for one in found} == {float(thin.density)}


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("trim --weight 72000 --thrust-coefficient 0.006", "not allowed"),
        ("trim --weight 72000 --density 1 --altitude 3", "not allowed"),
        ("trim", "one of the arguments"),
        ("trim --weight 2e6", "must come to a C_T that is a number in (0, 0.1], but 2e+06 N comes to 0.159"),
        ("trim --weight 72000 --speed 200", "200 m/s comes to 0.9058"),
        ("trim --weight 72000 --wieght 3", "unknown argument --wieght: did you mean --weight"),
        ("trim --weight 72000 --height 0.4 --inflow uniform", "but is 0.4: use vpbfsm or freewake"),
        ("linearise --out x --altitude 1000", "altitude"),
    ],
)
def test_what_does_not_go_together_is_one_line(line, words, capsys):
    try:
        code = main(line.split())
    except SystemExit as left:
        code = left.code
    assert code == 2
    assert words in capsys.readouterr().err
