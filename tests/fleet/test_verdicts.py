"""What stands out and what drifts, on lines whose truth is known; the page that says so."""

import numpy as np
import polars as pl
import pytest
from typer.testing import CliRunner

from benchmarks.synthetic_fleet import FAULTS, Population, write_fleet
from mrdamper.cli import application
from mrdamper.errors import ColumnError
from mrdamper.fleet.page import write_page
from mrdamper.fleet.profile import ColumnLimits, FleetProfile, load_limits
from mrdamper.fleet.run import run_fleet
from mrdamper.fleet.verdicts import clock_findings, drift, suspects, with_features
from mrdamper.rig_files.strict_toml import LimitsError


def line_of(seed, rig=0.0, made=0.0, golden=2, dampers=200, sessions=10):
    """Forces of a line: 2 % from damper to damper, 0.2 % from session to session, 0.2 % of noise."""
    rng = np.random.default_rng(seed)
    share = np.linspace(0, 1, sessions)
    gains = (1 + rig * share) * (1 + 0.002 * rng.standard_normal(sessions))
    rows = []
    own = 1 + 0.02 * rng.standard_normal(golden)
    for s in range(sessions):
        for g in range(golden):
            rows.append((f"G{g}", f"S{s:02}", True, 1000 * own[g] * gains[s] * (1 + 0.002 * rng.standard_normal())))
        for d in range(dampers // sessions):
            spread = 1 + 0.02 * rng.standard_normal()
            force = 1000 * spread * (1 + made * share[s]) * gains[s] * (1 + 0.002 * rng.standard_normal())
            rows.append((f"D{s:02}{d:03}", f"S{s:02}", False, force))
    serials, days, watched, values = zip(*rows, strict=True)
    return np.array(values), days, serials, watched


@pytest.mark.parametrize(("planted", "verdict"), [({"rig": 0.03}, "rig"), ({"made": 0.03}, "line"), ({}, "none")])
def test_a_drift_of_the_rig_is_told_from_one_of_the_line(planted, verdict):
    told = [drift(*line_of(seed, **planted)).verdict for seed in range(100)]
    assert told.count(verdict) >= 95


@pytest.mark.parametrize("planted", [{"rig": 0.03}, {"made": 0.03}])
def test_without_golden_dampers_it_cannot_tell(planted):
    told = [drift(*line_of(seed, golden=0, **planted)) for seed in range(30)]
    assert {d.verdict for d in told} <= {"cannot tell", "none"}
    assert sum(d.verdict == "cannot tell" for d in told) >= 20
    assert all(np.isnan(d.rig) for d in told)
    assert any("cannot tell" in d.text for d in told)


def test_features_are_of_the_highest_speed_at_the_lowest_current_and_its_rise():
    speeds, currents = (0.05, 0.3, 0.1), (0.5, 1.5, 0.0)
    ladder = {}
    for v in speeds:
        for I in currents:
            ladder[f"rebound_N_{v:g}m_s_{I:g}A"] = [1000 * v + 200 * I, 1.0]
            ladder[f"compression_N_{v:g}m_s_{I:g}A"] = [-800 * v - 100 * I, -3.0]
    found = with_features(pl.DataFrame(ladder))
    assert found["force_off_N"].to_list() == pytest.approx([(300 + 240) / 2, 2.0])
    assert found["force_rise_N"].to_list() == pytest.approx([(300 + 150) / 2, 0.0])
    without = with_features(pl.DataFrame({"serial": ["a"]}))
    assert without.select("force_off_N", "force_rise_N").row(0) == (None, None)


def test_what_lies_far_from_its_session_is_named_with_its_cause():
    """Sessions of a rig differ by more than dampers do: each damper is beside those of its session."""
    rng = np.random.default_rng(2)
    sessions = np.repeat(["S1", "S2", "S3"], 20)
    level = 100 + 3.0 * (sessions == "S2") - 5.0 * (sessions == "S3")
    columns = {name: level + 0.1 * rng.standard_normal(60)
               for name in ("force_off_N", "force_rise_N", "gas_force_N", "friction_N")}  # fmt: skip
    columns["shape_deviation"] = 0.01 * np.exp(0.05 * rng.standard_normal(60))
    columns["gas_force_N"][3] -= 2.0
    columns["gas_force_N"][5] += 2.0
    columns["force_rise_N"][25] -= 2.0
    columns["friction_N"][30] -= 1.0
    columns["friction_N"][31] -= 2.0
    columns["gas_force_N"][31] += 1.0
    columns["shape_deviation"][8] *= 2.0
    columns["shape_deviation"][9] *= 0.5  # nearer to the law than others: no fault
    table = pl.DataFrame({"serial": [f"D{i}" for i in range(60)], "session": sessions, **columns})
    found = {s.serial: s for s in suspects(table)}
    causes = {"D3": "low gas", "D5": "look at it", "D25": "wrong coil or weak fluid", "D30": "worn seal",
              "D31": "worn seal", "D8": "odd loop: air in the oil, a valve"}  # fmt: skip
    assert {serial: one.cause for serial, one in found.items()} == causes
    assert found["D3"].session == "S1"
    gas = np.concatenate([v - np.median(v) for v in columns["gas_force_N"].reshape(3, 20)])
    away = gas / (1.4826 * np.median(np.abs(gas)))
    assert found["D3"].findings == (f"gas force {away[3]:+.0f} σ",)
    assert [text.rsplit(" ", 2)[0] for text in found["D31"].findings] == ["friction", "gas force"]  # the farthest first
    turned = {s.serial: s for s in suspects(table[::-1])}
    assert turned == found
    assert suspects(table[:7]) == []


@pytest.mark.parametrize(("rig", "line", "verdict"), [(0.03, 0.0, "rig"), (0.0, -0.02, "line"), (0.03, 0.01, "both")])
def test_a_drift_is_told_by_its_size(rig, line, verdict):
    sessions, values, serials, golden = [], [], [], []
    for s in range(6):
        for d in range(12):
            own = 1 + 0.01 * d if d < 2 else 1 + 0.002 * (d - 6.5)
            wobble = 1 + 1e-5 * (-1) ** s * (d < 2)
            sessions.append(f"S{s}")
            serials.append(f"G{d}" if d < 2 else f"D{s}-{d}")
            golden.append(d < 2)
            values.append(700 * own * wobble * np.exp(rig * s / 5) * (1 if d < 2 else np.exp(line * s / 5)))
    found = drift(np.array(values), sessions, serials, golden)
    assert found.verdict == verdict
    assert (found.rig, found.line) == (pytest.approx(rig, abs=1e-4), pytest.approx(line, abs=1e-4))
    assert f"rig changes by {100 * found.rig:+.1f} %" in found.text
    # A golden damper that misses the last session takes its own level with it: the drift stays.
    most = [i for i, (s, d) in enumerate(zip(sessions, serials, strict=True)) if (s, d) != ("S5", "G1")]
    missed = drift(np.array(values)[most], *([each[i] for i in most] for each in (sessions, serials, golden)))
    assert missed.rig == pytest.approx(rig, abs=5e-3)
    alone = [i for i, g in enumerate(golden) if not g]
    untold = drift(np.array(values)[alone], *([each[i] for i in alone] for each in (sessions, serials, golden)))
    assert (untold.verdict, f"Forces change by {100 * (rig + line):+.1f} %" in untold.text) == ("cannot tell", True)
    few = [i for i, s in enumerate(sessions) if s < "S2"]
    two = drift(np.array(values)[few], *([each[i] for i in few] for each in (sessions, serials, golden)))
    assert (two.verdict, two.text) == ("cannot tell", "sessions: 2; a drift needs three or more.")


def test_false_alarms_are_rare():
    alarms = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        names = ("force_off_N", "force_rise_N", "gas_force_N", "friction_N")
        frame = pl.DataFrame(
            {
                "serial": [f"D{i}" for i in range(200)],
                "session": [f"S{i // 20}" for i in range(200)],
                **{name: 100 * (1 + 0.02 * rng.standard_normal(200)) for name in names},
                "shape_deviation": 0.01 * np.sqrt(rng.chisquare(4, 200) / 4),
            }
        )
        alarms += len(suspects(frame))
    assert alarms <= 0.01 * 20 * 200


@pytest.mark.slow
def test_planted_faults_are_found_and_named(tmp_path):
    line = Population(dampers=60, sessions=4, golden=1, faults=dict.fromkeys(FAULTS, 3), seed=11)
    write_fleet(line, tmp_path / "records")
    found = run_fleet(tmp_path / "records", tmp_path / "out", workers=2)
    table = with_features(pl.read_parquet(found.table)).filter(~pl.col("golden"))
    named = {s.serial: s.cause for s in suspects(table)}
    truth = {d.serial: d.fault for d in line if not d.golden}
    faulty = {serial for serial, fault in truth.items() if fault}
    assert len(faulty & set(named)) >= 0.95 * len(faulty)
    assert not set(named) - faulty
    words = {"low gas": "gas", "air in oil": "air", "worn seal": "seal", "wrong coil": "coil"}
    assert sum(words[truth[s]] in named[s] for s in faulty & set(named)) >= 0.9 * len(faulty)


def test_the_page_traces_everything_by_serial_number(identified, tmp_path):
    said = write_page(
        identified.table, identified.plan, {"gas_force_N": ColumnLimits(lower=119.5)}, tmp_path / "fleet.html"
    )
    text = (tmp_path / "fleet.html").read_text(encoding="utf-8")
    table = pl.read_parquet(identified.table)
    below = table.filter(~pl.col("golden") & (pl.col("gas_force_N") < 119.5))["serial"].to_list()
    assert f"limits of gas_force_N: {len(below)} of 4 outside" in said
    assert all(serial in text for serial in (*below, *table["serial"]))
    assert "Gauge study" in text
    assert "<script" not in text


def test_a_long_line_is_charted_by_medians(identified, tmp_path):
    table = pl.concat([pl.read_parquet(identified.table)] * 200).with_row_index("n")
    table = table.with_columns(serial=pl.format("{}-{}", "serial", "n")).drop("n")
    table.write_parquet(tmp_path / "dampers.parquet")
    write_page(tmp_path / "dampers.parquet", identified.plan, {}, tmp_path / "fleet.html")
    assert "medians of 2 dampers in the order of sessions" in (tmp_path / "fleet.html").read_text(encoding="utf-8")


def test_a_limit_for_no_column_is_refused(identified, tmp_path):
    with pytest.raises(ColumnError, match="gas_force_N"):
        write_page(identified.table, identified.plan, {"gas": ColumnLimits(lower=1)}, tmp_path / "fleet.html")
    assert not (tmp_path / "fleet.html").exists()


def test_a_lower_limit_above_the_upper_is_refused_before_any_work(line, tmp_path):
    limits = tmp_path / "limits.toml"
    limits.write_text("[limits.gas_force_N]\nlower = 3\nupper = 2\n")
    with pytest.raises(LimitsError) as refused:
        load_limits(limits)
    assert refused.value.code == "E_LIMITS"
    out = tmp_path / "out"
    done = CliRunner().invoke(application(), ["fleet", str(line), "--out", str(out), "--limits", str(limits)])
    assert isinstance(done.exception, LimitsError)
    assert not out.exists()


def test_a_clock_that_jumps_is_said():
    frame = pl.DataFrame({"session": ["S1", "S2", "S3"], "date": ["2024-02-01", "2024-01-01", "soon"]})
    jump = "the clock jumps back from 2024-02-01 in session S1 to 2024-01-01 in session S2"
    assert clock_findings(frame)[0] == jump
    assert "soon" in clock_findings(frame)[1]
    timed = ["2024-02-01T10:00:00", "2024-02-02", None]
    assert clock_findings(frame.with_columns(date=pl.Series(timed, dtype=pl.String))) == []


def test_golden_dampers_are_named_in_the_profile():
    profile = FleetProfile(golden=("G1",))
    assert profile.is_golden({"serial": "G1"})
    assert not profile.is_golden({"serial": "D1"})


def test_a_damper_of_another_rig_is_named(identified, tmp_path):
    table = pl.read_parquet(identified.table)
    assert set(table["findings"]) == {""}
    other = table.with_columns(
        findings=pl.when(pl.col("serial") == "D000002").then(pl.lit("W_OTHER_RIG")).otherwise(pl.lit(""))
    )
    other.write_parquet(tmp_path / "dampers.parquet")
    said = write_page(tmp_path / "dampers.parquet", identified.plan, {}, tmp_path / "fleet.html")
    assert "1 dampers were not tested on rig 'virtual' like most of the population: D000002" in said
