"""Roads by their spectrum, bumps by their shape, and records that are refused."""

import numpy as np
import pytest
from scipy.signal import welch
from typer.testing import CliRunner

from mrdamper.cli import application, main
from mrdamper.errors import InputError
from mrdamper.systems.inputs import input_types, load_input, made_inputs
from mrdamper.systems.inputs.record import load_record
from mrdamper.systems.weighting import WEIGHTINGS, frequency_weighted


@pytest.mark.parametrize("letter", "abcde")
def test_a_road_has_the_spectrum_of_its_class(letter):
    spectra = []
    for seed in range(20):
        road = load_input(f"iso8608-{letter}", {"seed": seed, "length_s": 40})
        distance = np.arange(0, 800, 0.05)
        spectra.append(welch(road.profile(distance), 20.0, nperseg=4096)[1])
    n = welch(distance, 20.0, nperseg=4096)[0]
    inside = (n > 0.03) & (n < 2.5)
    wanted = {"a": 16e-6, "b": 64e-6, "c": 256e-6, "d": 1024e-6, "e": 4096e-6}[letter] * (n[inside] / 0.1) ** -2.0
    octaves = np.array_split(np.mean(spectra, axis=0)[inside] / wanted, 6)
    assert [part.mean() for part in octaves] == pytest.approx([1.0] * 6, abs=0.05)


@pytest.mark.parametrize("name", [name for name in made_inputs() if made_inputs()[name][0].kind == "road"])
def test_the_rate_of_a_road_is_the_slope_of_its_height(name):
    road = load_input(name)
    time = np.linspace(0.01, road.duration - 0.01, 4001) + 1.234e-5
    slope = (road.value(time + 1e-6) - road.value(time - 1e-6)) / 2e-6
    assert road.rate(time) == pytest.approx(slope, abs=2e-4 * np.abs(slope).max())
    assert abs(road.value(np.zeros(1))[0]) < 1e-12


def test_one_seed_one_road():
    time = np.linspace(0, 5, 100)
    same = [load_input("iso8608-c", {"seed": seed}).value(time) for seed in (1, 1, 2)]
    assert np.array_equal(same[0], same[1])
    assert not np.allclose(same[0], same[2])


REFUSED = {
    "no unit": ("time_s,acceleration\n0,0\n1,1\n2,0\n", "E_UNITS"),
    "a time without a unit": ("time,acceleration_g\n0,0\n1,1\n2,0\n", "E_UNITS"),
    "nothing of the kind": ("x,y\n0,0\n1,1\n2,0\n", "E_COLUMN"),
    "both": ("time_s,acceleration_g,acceleration_m_s2\n0,0,0\n1,1,1\n2,0,0\n", "E_COLUMN"),
    "text": ("time_s,acceleration_g\n0,zero\n1,1\n2,0\n", "E_COLUMN"),
    "a step that differs": ("time_s,acceleration_g\n0,0\n0.02,1\n0.05,0\n0.07,0\n0.09,0\n", "E_RECORD_STEP"),
    "backwards": ("time_s,acceleration_g\n0,0\n-0.02,1\n-0.04,0\n", "E_RECORD_STEP"),
    "in gal": ("time_s,acceleration_m_s2\n0,0\n0.02,342\n0.04,0\n", "E_UNITS"),
    "m/s² named g": ("time_s,acceleration_g\n0,0\n0.02,9.5\n0.04,0\n", "E_UNITS"),
    "too short": ("time_s,acceleration_g\n0,0\n", "E_RECORD"),
    "not finite": ("time_s,acceleration_g\n0,0\n0.02,inf\n0.04,0\n", "E_RECORD"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_record_that_cannot_be_used_is_refused(case, tmp_path):
    text, code = REFUSED[case]
    (tmp_path / "r.csv").write_text(text)
    with pytest.raises(InputError) as refused:
        load_record(tmp_path / "r.csv")
    assert refused.value.code == code
    assert refused.value.remedy
    assert case != "not finite" or "no number in 1 sample, the first of them sample 2" in str(refused.value)


def test_a_record_in_g_and_in_si_at_another_speed(tmp_path):
    (tmp_path / "g.csv").write_text("time_s,acceleration_g\n5,0\n5.02,0.1\n5.04,0\n")
    found = load_record(tmp_path / "g.csv", time_scale=2)
    assert found.times.tolist() == pytest.approx([0, 0.01, 0.02])
    assert found.values.tolist() == pytest.approx([0, 0.981, 0])


def test_a_ground_motion_does_not_shake_a_car_nor_a_road_a_frame(monkeypatch, capsys):
    for system, source in (("quarter-car", "elcentro"), ("dyke1996", "iso8608-a")):
        monkeypatch.setattr("sys.argv", ["mrdamper", "simulate", system, "--input", source, "--without-damper"])
        with pytest.raises(SystemExit) as end:
            main()
        assert end.value.code == 2
        assert "E_EXCITATION" in capsys.readouterr().err


def test_every_input_says_what_it_takes():
    assert set(input_types()) >= {"record", "iso8608", "bump", "sweep", "steps"}
    done = CliRunner().invoke(
        application(), ["simulate", "quarter-car", "--input", "bump:hight_m=1", "--without-damper"]
    )
    assert "height_m" in str(done.exception)


# ISO 2631-1:1997, Table 3, third octaves. The 10 Hz entry of Wd is left out: it is printed 0.212, off the
# standard's own formula and off its neighbours.
TABLE = {
    "Wk": {0.5: 0.418, 0.63: 0.459, 0.8: 0.477, 1: 0.482, 1.25: 0.484, 1.6: 0.494, 2: 0.531, 2.5: 0.631, 3.15: 0.804,
           4: 0.967, 5: 1.039, 6.3: 1.054, 8: 1.036, 10: 0.988, 12.5: 0.902, 16: 0.768, 20: 0.636, 25: 0.513,
           31.5: 0.405, 40: 0.314, 50: 0.246, 63: 0.186, 80: 0.132},
    "Wd": {0.5: 0.853, 0.63: 0.944, 0.8: 0.992, 1: 1.011, 1.25: 1.008, 1.6: 0.968, 2: 0.890, 2.5: 0.776, 3.15: 0.642,
           4: 0.512, 5: 0.409, 6.3: 0.323, 8: 0.253, 12.5: 0.161, 16: 0.125, 20: 0.100, 25: 0.0800, 31.5: 0.0632,
           40: 0.0494, 50: 0.0388, 63: 0.0295, 80: 0.0211},
    "Wf": {0.1: 0.695, 0.125: 0.895, 0.16: 1.006, 0.2: 0.992, 0.25: 0.854, 0.315: 0.619, 0.4: 0.384, 0.5: 0.224},
}  # fmt: skip


@pytest.mark.parametrize("rate", [200, 1000, 10_000])
@pytest.mark.parametrize("name", WEIGHTINGS)
def test_weightings_follow_the_standard_at_any_rate(name, rate):
    for frequency, gain in TABLE[name].items():
        cycles = 40 if frequency >= 1 or rate < 10_000 else 12
        time = np.arange(0, cycles / frequency, 1 / rate)
        if time.size > 200_000 or frequency > 0.45 * rate:
            continue
        weighted = frequency_weighted(np.sin(2 * np.pi * frequency * time), 1 / rate, name)
        last = np.abs(time - 0.7 * time[-1]) < 2 / frequency  # its ends ring near half the rate
        waves = np.exp(2j * np.pi * frequency * time[last])
        found = np.abs(np.linalg.lstsq(np.column_stack([waves, waves.conj()]), weighted[last], rcond=None)[0][0]) * 2
        assert found == pytest.approx(gain, rel=5e-3, abs=6e-5), f"{name} at {frequency} Hz"
