"""Dampers without identification, one for each kind of streaming and export."""

from functools import cache

from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.joint import JointDamper
from mrdamper.dampers.modified import ModifiedModel
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.dampers.published import conditioned_type
from mrdamper.data import Condition
from mrdamper.models import all_models, model_type
from mrdamper.statistics.functions.forms import ParameterFunction
from support.models import EXAMPLES, example_values

ENVELOPE = Envelope((0.0, 1.0), (0.5, 4.0), (0.004, 0.02), (0.02, 0.3))
VARIANTS = {
    "bouc-wen, gamma apart": ("bouc-wen", {**EXAMPLES["bouc-wen"], "gamma": 1e5, "m": 5.0, "k3": 1e5}),
    "bouc-wen, n = 1": ("bouc-wen", {"c": 1440.0, "alpha": 9e5, "beta": 600.0, "gamma": 900.0, "n": 1.0}),
    "bouc-wen, n = 1.6": ("bouc-wen", {"c": 1440.0, "alpha": 9e5, "beta": 2e4, "gamma": 1e4, "n": 1.6}),
    "kwok, smooth": ("kwok", {**EXAMPLES["kwok"], "xs": 1e-3}),
}


def all_bare_models():
    """Every model of the package and some of its branches, by a name for the test's output."""
    plain = {name: cls.build(example_values(name)) for name, cls in all_models().items()}
    return plain | {title: model_type(name).build(values) for title, (name, values) in VARIANTS.items()}


@cache  # the same object for every test, compiled once
def joint_damper(name="play-bypass"):
    model = model_type(name).build(EXAMPLES[name])
    return JointDamper(model, tuple(EXAMPLES[name]), rig="bench", envelope=ENVELOPE)


@cache
def modified_damper():
    functions = {
        "c": ParameterFunction("linear-current", (500.0, 1000.0)),
        "yield_force": ParameterFunction("quadratic-current-linear-speed", (-300.0, 900.0, 400.0, 150.0)),
        "yield_displacement": ParameterFunction("decaying-current", (-1.0, -7.0), (2.0,), log=True),
        "k1": ParameterFunction("plane", (0.0, 100.0, 50.0, 1e3, 400.0)),
        "f0": ParameterFunction("constant", (30.0,)),
    }
    return ModifiedModel(ParameterMap(model_type("bouc-wen"), functions), rig="bench", envelope=ENVELOPE)


@cache
def conditioned_damper():
    """A published damper whose parameters are functions of the condition."""
    coefficients = {
        **{"alpha1": 2e6, "alpha2": 4e6, "alpha3": 2.0, "alpha4": 8e5, "d2": 0.15, "d4": 0.3},
        **{"beta": 4e6, "gamma1": 3e6, "gamma2": 2e6, "k1": 700.0, "k2": 300.0, "f0": 47.0},
        **{"c1": 1500.0, "c2": 900.0, "c3": 2.0, "c4": 800.0},
    }
    reference = Condition(0.25, 1.0, 0.013)
    return conditioned_type("dominguez-type")(coefficients, reference, rig="bench", envelope=joint_damper().envelope)


def all_dampers():
    """All kinds of dampers that stream: models, global, modified and published dampers."""
    return {
        **all_bare_models(), "joint": joint_damper(), "modified": modified_damper(), "conditioned": conditioned_damper()
    }  # fmt: skip
