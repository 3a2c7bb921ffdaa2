"""Tables of the reproduction by made results whose numbers are all different: each in its own column and row."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest

from mrdamper.dampers.published import all_published
from mrdamper.data import Condition
from mrdamper.errors import ExcitationError
from mrdamper.models.bingham import Bingham
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.paper import output
from mrdamper.paper.claims import Claim
from mrdamper.paper.figures import Entry
from mrdamper.paper.options import ALI, CONSISTENT, DIRECT, LITERAL, TRADITIONAL, PaperOptions
from mrdamper.paper.output import all_tables, method_rows
from mrdamper.paper.results import GeneticCheck, GeneticEnd
from mrdamper.paper.sensitivity import OneAtATime, Sobol
from mrdamper.paper.virtual_rig import VirtualRig
from mrdamper.statistics.functions.fitting import FunctionFit
from mrdamper.statistics.functions.forms import ParameterFunction
from mrdamper.statistics.metrics import Scores
from mrdamper.study.validation import RunScore, Validation


def scored(name, current, start):
    scores = Scores(*(start + k / 100 for k in range(6)))
    return RunScore(name, "rig", Condition(current, 1.0, 0.08), scores, None, ())


def contender(title, way, start, seconds):
    runs = (scored("h0", 0.0, start), scored("h1", 1.0, start + 0.2), scored("h2", 2.0, start + 0.5))
    return SimpleNamespace(
        recipe=SimpleNamespace(title=title, way=way, basis=None),
        damper=SimpleNamespace(parameter_count=round(100 * start)),
        validation=Validation(title, runs), train=Validation(title, ()), cross_validated=Validation(title, ()),
        per_run=start / 7, seconds=seconds, identifications=(), fit=None,
    )  # fmt: skip


def study(**more):
    given = dict(
        contenders=(contender("one", "paper", 0.1, 3.0), contender("two", "joint", 0.3, 5.0)),
        seed_errors={"two": np.array([0.31, 0.33, 0.38])}, seed_verdicts={}, loops=(), held_out=(), genetic=(),
        ended=(), there={}, train=(), seconds=12.0,
        sensitivity=(), sobol=None, rig=None, options=PaperOptions(), conditions=(), readings=(), direct={},
    )  # fmt: skip
    made = SimpleNamespace(**(given | more))
    made.contender = lambda title: next((c for c in made.contenders if c.recipe.title == title), None)
    made.named = lambda *titles: [c for title in titles if (c := made.contender(title))]
    return made


def test_table_5_holds_the_median_and_the_worst_of_the_held_out_runs():
    first, second = method_rows(study())
    assert first == {
        "verdict": "paper (literal)", "method": "one", "parameters": 10, "nrmse_pp": pytest.approx(0.3),
        "worst_nrmse_pp": pytest.approx(0.6), "nrmse_std": pytest.approx(0.31), "wape": pytest.approx(0.32),
        "mean_relative_error": pytest.approx(0.35), "per_run_nrmse_pp": pytest.approx(0.1 / 7), "forces_a_run": None,
        "seeds": None, "seed_median_nrmse_pp": None, "seed_lowest_nrmse_pp": None, "seed_highest_nrmse_pp": None,
    }  # fmt: skip
    spread = [second[f"seed_{name}_nrmse_pp"] for name in ("lowest", "median", "highest")]
    assert (second["verdict"], second["seeds"], spread) == ("joint", 3, [0.31, 0.33, 0.38])


def tables(**more):
    claim = Claim("phase", "text", "Eq. 1", "agrees", "recovered", "1 rad", "limit", "fig12", "20 of 20")
    return all_tables(study(**more), (claim,))


def test_table_4_holds_every_run_of_every_method_under_its_own_name():
    made, absent = tables()
    rows = made["errors"]
    assert [(r["method"], r["run_id"], r["current_A"]) for r in rows] == [
        (title, f"h{n}", float(n)) for title in ("one", "two") for n in range(3)
    ]
    assert rows[4] == {
        "method": "two", "run_id": "h1", "current_A": 1.0, "frequency_Hz": 1.0, "amplitude_m": 0.08,
        "mean_relative_error": pytest.approx(0.55), "wape": pytest.approx(0.52), "nrmse_pp": pytest.approx(0.5),
        "nrmse_std": pytest.approx(0.51),
    }  # fmt: skip
    assert made["seeds"] == [{"method": "two", "seed": n, "nrmse_pp": v} for n, v in ((1, 0.31), (2, 0.33), (3, 0.38))]
    assert made["claims"][0] == {
        "key": "phase", "text": "text", "source": "Eq. 1", "verdict": "agrees", "said": "recovered",
        "evidence": "1 rad",
        "threshold": "limit", "figure": "fig12", "seeds": "20 of 20",
    }  # fmt: skip
    assert absent["genetic"] == "no genetic search was made"
    assert absent["virtual_rig"] == "the data are not of the virtual rig"
    assert absent["tests"] == "the data allow no row of it"
    assert absent["parameters"] == "there is no validation run"
    assert not set(absent) & set(made)
    assert made["methods"] == method_rows(study())


def test_table_4_of_the_paper_holds_relative_errors_by_current_in_the_papers_order():
    titles = (ALI, DIRECT, "joint", TRADITIONAL, LITERAL)
    ways = [contender(title, "paper", 0.1 * k, 1.0) for k, title in enumerate(titles, 1)]
    ways[1].validation = Validation(DIRECT, ())
    rows = output._TABLES["table4"](study(contenders=ways))
    assert [row["method"] for row in rows] == [LITERAL, TRADITIONAL, ALI]
    for row, start in zip(rows, (0.5, 0.4, 0.1), strict=True):
        errors = [start + more + 0.05 for more in (0.0, 0.2, 0.5)]
        assert [row[f"{current}.00 A"] for current in range(3)] == pytest.approx(errors)
        assert row["mean"] == pytest.approx(np.mean(errors))
        assert list(row) == ["method", "0.00 A", "1.00 A", "2.00 A", "mean"]


def test_tables_1_and_2_hold_what_was_identified_at_their_amplitude_by_frequency_and_current():
    model = BoucWen(c=1e3, alpha=4e5, beta=6e6, gamma=6e6)
    at = [(0.03, 2.0, 0.0), (0.03, 1.0, 1.0), (0.03, 1.0, 0.0), (0.06, 1.0, 0.0), (0.03, 3.0, 0.0)]
    conditions = [Condition(I, f, a) for a, f, I in at]
    train = tuple(SimpleNamespace(id=f"t{i}") for i in range(5))
    one = contender(LITERAL, "paper", 0.1, 6.0)
    one.identifications = tuple(  # the last was not identified
        SimpleNamespace(run_id=f"t{i}", condition=c, model=model, evaluations=e, free=("c", "m"))
        for i, (c, e) in enumerate(zip(conditions[:4], (10, 20, 90, 30), strict=True))
    )
    readings = tuple(SimpleNamespace(amplitude=100.0 + i, phase=0.1 * i) for i in range(5))
    made = study(contenders=(one,), train=train, conditions=tuple(conditions), readings=readings)
    made.amplitude_group = lambda place: [t for t, c in zip(train, conditions, strict=True)
                                          if c.amplitude_m == sorted({0.03, 0.06})[place]]  # fmt: skip
    found = {f"table{n}": output._TABLES[f"table{n}"](made) for n in (1, 2, 5)}
    assert [row["run_id"] for row in found["table1"]] == ["t2", "t1", "t0"]
    assert [row["run_id"] for row in found["table2"]] == ["t3"]
    first = found["table1"][0]
    assert (first["F0 [N]"], first["phi [rad]"], first["c [N s/m]"]) == (102.0, 0.2, 1e3)
    assert (first["frequency_Hz"], first["amplitude_m"], first["current_A"]) == (1.0, 0.03, 0.0)
    assert method_rows(made)[0]["forces_a_run"] == 25.0  # the median
    assert found["table5"][0]["identified_per_run"] == 2
    assert {row["what"]: row["seconds_a_run"] for row in output.time_rows(made)}[LITERAL] == 1.5


def test_table_5_of_the_paper_counts_what_is_searched_among_what_is_identified():
    first, *others = tables()[0]["table5"]
    assert (first["searched_per_run"], first["identified_per_run"]) == (2, None)
    based = [row for row in others if row["data_needed"].startswith("sines")]
    assert 0 < len(based) < len(others)
    for row in others:
        if row in based:
            assert 0 <= row["searched_per_run"] < row["identified_per_run"]
        else:
            assert row["searched_per_run"] is row["identified_per_run"] is None
        assert " " in row["limits"]
    assert {row["model"] for row in others} == {cls.heading for cls in all_published().values()}


def test_everything_is_written_and_shown_in_its_place(monkeypatch, tmp_path):
    claim = Claim("phase", "text", "Eq. 1", "agrees", "recovered", "1 rad", "limit", "fig12", "20 of 20")
    page, asked = {}, []

    def drawn(study, also, names, progress):
        asked.append((also, names))
        return {name: "one motion" if name == "fig09" else {"svg": name.encode()} for name in names}

    def render(template, title, about, **given):
        page.update(given, template=template, about=about)
        return "<p>page</p>"

    monkeypatch.setattr(output, "check_claims", lambda study: (claim,))
    figures = {name: Entry(name, "Eq. 1", (), None) for name in ("fig09", "fig12", "seeds")}
    monkeypatch.setattr(output, "FIGURES", figures)
    monkeypatch.setattr(output, "caption", lambda name: f"caption of {name}")
    monkeypatch.setattr(output, "pictures", drawn)
    monkeypatch.setattr(output, "render_page", render)
    monkeypatch.setattr(output, "made_from", lambda dataset: f"from {dataset}")
    made = study(notes=("first",), seconds=12.4, dataset="rig 1", best="one")
    told = []
    written = output.write_reproduction(made, tmp_path / "out", lambda what, share: told.append((what, share)))
    assert written[0] == tmp_path / "out" / "reproduction.html"
    assert written[0].read_text(encoding="utf-8") == "<p>page</p>"
    assert (tmp_path / "out" / "figures" / "fig12.svg").is_file()
    assert (tmp_path / "out" / "tables" / "claims.csv").read_text(encoding="utf-8").startswith("key,text,source")
    assert (tmp_path / "out" / "figures" / "seeds.svg").is_file()
    assert [also for also, _ in asked] == [(), ()]
    assert sorted(name for _, names in asked for name in names) == sorted(figures)
    assert page["pictures"] == {name: (f"caption of {name}", name.encode()) for name in ("fig12", "seeds")}
    tables, absent = all_tables(made, (claim,))
    assert page["tables"] == tables
    assert page["claims"] == (claim,)
    missing = [f"Table {name} is not made: {why}." for name, why in absent.items()]
    assert page["notes"] == ("first", "Figure fig09 is not drawn: one motion.", *missing)
    assert (page["study"], page["best"], page["synthetic"]) == (made, "one", False)
    assert page["about"].startswith("from rig 1. Reference")
    times = (tmp_path / "out" / "tables" / "seconds.csv").read_text(encoding="utf-8").splitlines()
    assert page["numbered"] == [(name, output.NUMBERED[name]) for name in ("table4", "table5") if name in tables]
    assert times[1:] == ["one,0,3.0,3.0", "two,0,5.0,5.0", "in all,0,12.4,"]
    facts = json.loads((tmp_path / "out" / "made.json").read_text(encoding="utf-8"))
    assert facts["seconds"] == {"in all": 12.4, "one": 3.0, "two": 5.0}
    assert told[-1] == ("written", 1.0)
    made.rig = VirtualRig()
    output.write_reproduction(made, tmp_path / "out", png=True)
    assert page["synthetic"]
    assert asked[-1][0] == ("png",)


def test_tests_and_searches_stand_in_their_columns():
    loop = SimpleNamespace(run_id="a", split="train", condition=Condition(0.5, 2.0, 0.03), peak_force=900.0,
                           dissipated_energy=33.0)  # fmt: skip
    minimum = SimpleNamespace(evaluations=123, point=np.array([4e5, 7e6]))
    check = GeneticCheck(Condition(1.0, 1.5, 0.05), minimum, 21.0, 20.0, 8.0)
    made, _ = tables(loops=(loop,), genetic=(check,), ended=(GeneticEnd("a", 3, 1.5, 0.2, 1.01, 420, 90, 0.7),))
    assert made["tests"] == [
        {"run_id": "a", "split": "train", "current_A": 0.5, "frequency_Hz": 2.0, "amplitude_m": 0.03,
         "peak_force_N": 900.0, "dissipated_energy_J": 33.0}
    ]  # fmt: skip
    assert made["genetic"] == [
        {"current_A": 1.0, "frequency_Hz": 1.5, "amplitude_m": 0.05, "reached_rmse_N": 21.0, "least_rmse_N": 20.0,
         "evaluations": 123, "alpha": 4e5, "beta": 7e6}
    ]  # fmt: skip
    searches = [row for row in output.time_rows(study(genetic=(check, check))) if "genetic" in row["what"]]
    assert [row["what"].partition(",")[0] for row in searches] == ["genetic search 1", "genetic search 2"]
    assert [(row["runs"], row["seconds"], row["seconds_a_run"]) for row in searches] == [(1, 8.0, 8.0)] * 2
    assert made["genetic_runs"] == [
        {"run_id": "a", "seed": 3, "alpha_over_optimum": 1.5, "beta_over_optimum": 0.2, "error_over_least": 1.01,
         "forces": 420, "forces_to_settle": 90}
    ]  # fmt: skip


def test_sensitivities_and_functions_stand_in_their_columns():
    numbers = [np.array([k + 0.1, k + 0.2]) for k in (1, 2, 3, 4)]
    indices = Sobol(("c", "n"), *numbers)
    single = (OneAtATime("n", 0.1, 0.7, 0.02), OneAtATime("A", 0.1, 0.5, float("nan")))
    made, _ = tables(sensitivity=single, sobol=indices)
    assert made["sensitivity"] == [
        {"parameter": "n", "change": 0.1, "effect": 0.7, "left_after_identifying_anew": 0.02, "sobol_first": 1.2,
         "sobol_first_half_width": 3.2, "sobol_total": 2.2, "sobol_total_half_width": 4.2},
        {"parameter": "A", "change": 0.1, "effect": 0.5, "left_after_identifying_anew": None},
    ]  # fmt: skip


def test_a_parameter_that_was_held_has_no_r2(monkeypatch):
    def function(value, r2):
        return FunctionFit(ParameterFunction("linear-current", (value, 1.0)), r2, 0.5)

    fit = SimpleNamespace(
        functions={"c": function(2.0, 0.9), "k1": function(3.0, math.nan)},
        values={"c": np.array([1.0, 2.0]), "k1": np.array([5.0, 5.0])},
    )
    monkeypatch.setattr(output, "ModifiedFit", SimpleNamespace)
    one = contender("one", "paper", 0.1, 3.0)
    one.fit = fit
    rows = output._function_rows(study(contenders=(one,)))
    assert [(r["method"], r["parameter"], r["form"], r["function"], r["r2"], r["coefficients"]) for r in rows] == [
        ("one", "c", "linear-current", "2 I + 1", 0.9, "2.0 1.0"),
        ("one", "k1", "linear-current", "3 I + 1", None, "3.0 1.0"),
    ]


def test_parameters_at_the_held_out_condition_are_listed_way_by_way(monkeypatch):
    predicted, identified = (BoucWen(c=c, alpha=a, beta=b, gamma=b) for c, a, b in ((1e3, 4e5, 6e6), (900.0, 3e5, 5e6)))
    condition = Condition(1.5, 1.0, 0.08)
    monkeypatch.setattr(output, "SineRecord", SimpleNamespace(of=lambda run: SimpleNamespace(condition=condition)))

    def refuses(_):
        raise ExcitationError("no sine")

    there = {(LITERAL, "h0"): SimpleNamespace(model=identified), (CONSISTENT, "h0"): "no sine"}
    ways = [contender(LITERAL, "paper", 0.1, 1.0), contender("tanh", "literature", 0.2, 1.0)]
    ways += [contender(CONSISTENT, "consistent", 0.1, 1.0), contender("broken", "joint", 0.1, 1.0)]
    ways[0].damper.model_at, ways[1].damper.model_at = lambda at: predicted, lambda at: Bingham(fy=1.0, c=1.0, f0=0.0)
    ways[2].damper.model_at, ways[3].damper.model_at = lambda at: predicted, refuses
    held = (SimpleNamespace(id="h0"),)
    rows = output.parameter_rows(study(contenders=ways, held_out=held, options=PaperOptions(A=2.0), there=there))
    told = [(r["method"], r["values"], r["run_id"], r["current_A"], r["c [N s/m]"], r["alpha [N/m]"]) for r in rows]
    table3 = output._TABLES["table3"](study(contenders=ways, held_out=held, options=PaperOptions(A=2.0), there=there))
    assert table3 == [row for row in rows if row["method"] == LITERAL][:1]
    assert told == [
        (LITERAL, "by the functions", "h0", 1.5, 1000.0, 2e5),
        (CONSISTENT, "by the functions", "h0", 1.5, 1000.0, 2e5),
        (LITERAL, "identified there", "h0", 1.5, 900.0, 1.5e5),
    ]
    assert (rows[0]["beta [m^-n]"], rows[0]["A [-]"], rows[0]["amplitude_m"]) == (3e6, 2.0, 0.08)
    there[CONSISTENT, "h0"] = SimpleNamespace(model=predicted)
    rows = output.parameter_rows(study(contenders=ways, held_out=held, there=there))
    shown = [(r["method"], r["c [N s/m]"]) for r in rows if r["values"] == "identified there"]
    assert shown == [(LITERAL, 900.0), (CONSISTENT, 1000.0)]
    rows = output.parameter_rows(study(contenders=ways[:2], held_out=held, there=there))
    assert [r["method"] for r in rows] == [LITERAL, LITERAL]
    _, absent = tables(contenders=ways[1:2], held_out=held)
    assert absent["parameters"] == "the data allow no row of it"


def test_a_program_reads_verdicts_and_whether_the_data_are_synthetic(monkeypatch):
    claim = Claim("phase", "text", "Eq. 1", "agrees", "recovered", "1 rad", "limit", "fig12", "20 of 20")
    monkeypatch.setattr(output, "check_claims", lambda study: (claim,))
    made = study(notes=("one",), seconds=12.0)
    found = output.summary(made)
    assert found["claims"] == [
        {"claim": "text", "verdict": "agrees", "said": "recovered",
        "evidence": "1 rad", "threshold": "limit",
         "seeds": "20 of 20"}
    ]  # fmt: skip
    assert (found["synthetic"], found["notes"], found["times"][-1]["seconds"]) == (False, ["one"], 12.0)
    assert found["verdicts"] == method_rows(made)
    made.rig = VirtualRig()
    assert output.summary(made)["synthetic"]
    rows = {r["parameter"]: r for r in all_tables(made, ())[0]["virtual_rig"]}
    assert rows["mass"]["value"] == 4.0
    assert (rows["mass"]["unit"], rows["mass"]["meaning"]) == ("kg", "moving mass beyond the load cell")
