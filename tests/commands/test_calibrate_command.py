"""`rotorjax calibrate`: bad input is one line and exit code 2. What it writes: tests/calibration."""

import pytest

from rotorjax.cli import main


@pytest.fixture
def known(tmp_path):
    from known_study import known_study

    from rotorjax.io import netcdf

    netcdf.write(tmp_path / "cases.nc", known_study())
    return tmp_path


BAD = {
    "calibrate": "TARGET",
    "calibrate hayden": "--out",
    "calibrate hayden --out {tmp}/a --heights 0.1": "but holds 0.1",
    "calibrate hayden --out {tmp}/a --heights 9": "but holds 9",
    "calibrate hayden --out {tmp}/a --parameters radius,q": "but holds 'q'",
    "calibrate hayden --out {tmp}/a --heights 1": "there are 2 (radius, clearance) and 1 data",
    "calibrate hayden --out {tmp}/a --loading square": "invalid choice: 'square'",
    "calibrate hayden --out {tmp}/file/a": "must be writable",
    "calibrate freewake --out {tmp}/a": "--cases",
    "calibrate freewake --out {tmp}/a --cases {tmp}/none.nc": "must be readable",
    "calibrate freewake --out {tmp}/a --cases {tmp} --held h9": "but holds 'h9'",
    "calibrate freewake --out {tmp}/a --cases {tmp} --parameters core": "but holds 'core'",
    "calibrate hayden --out {tmp}/a --cases {tmp} --heights 1.2": "h1.2 is not",
}


@pytest.mark.parametrize("line", BAD)
def test_bad_input_is_one_line_and_exit_code_2(line, tmp_path, capsys, known):
    (tmp_path / "file").write_text("")
    try:
        code = main(line.format(tmp=tmp_path).split())
    except SystemExit as stop:
        code = stop.code
    printed = capsys.readouterr()
    assert code == 2
    assert printed.out == ""
    assert BAD[line] in printed.err.strip().splitlines()[-1]
