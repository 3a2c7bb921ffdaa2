"""The check of the loop on made forces whose share, sign and scatter are worked out by hand."""

from copy import copy
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mrdamper.errors import QualityError
from mrdamper.rig_files.quality import loop
from mrdamper.rig_files.quality.cycles import every_cycle
from mrdamper.rig_files.quality.loop import damping_share, dissipates, keeps_its_sign, repeatability, repeats
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Record

POINTS, F, X = 200, 1.25, 0.02
OMEGA = 2 * np.pi * F


def view(force, cycles=4.0, lead=0.0, points=POINTS, hole=()):
    """A sine, and a force as a function of the phase and of the number of the cycle."""
    time = np.arange(int(cycles * points) + 1) / (points * F)
    number = np.minimum((time * F + 1e-9).astype(int), int(np.ceil(cycles)) - 1)
    kept = np.setdiff1d(np.arange(time.size), hole)
    values = (time + 3.0, X * np.sin(OMEGA * time) + lead, force(OMEGA * time, number, time))
    made = View(Record("made", *(v[kept] for v in values)))
    if hole:
        made.segments = ((0, hole[0]), (hole[0], kept.size))
    return made


def viscous(phase, number, time):
    return np.cos(phase)


def test_the_share_is_that_of_the_force_in_phase_with_the_velocity():
    found = damping_share(view(lambda p, n, t: 30 * np.cos(p) + 40 * np.sin(3 * p) + 7.0, lead=0.01))
    assert found == pytest.approx(0.6, abs=2e-3)
    assert damping_share(view(lambda p, n, t: -30 * np.cos(p) + 40 * np.sin(p) - 7.0)) == pytest.approx(-0.6, abs=2e-3)
    # Whatever drifts with the record's time is no part of it, nor its clock's beginning.
    drifting = damping_share(view(lambda p, n, t: np.cos(p) + 5 * t + 100))
    spread = np.std(np.cos(OMEGA * np.arange(801) / 250) + 5 * np.arange(801) / 250)
    assert drifting == pytest.approx(np.sqrt(0.5) / spread, rel=5e-3)


def test_of_segments_that_hold_a_cycle_the_least_share_counts():
    made = view(lambda p, n, t: np.where(n < 2, 1.0, -0.5) * np.cos(p))

    def share(*segments):
        cut = copy(made)
        cut.run = SimpleNamespace(**{name: getattr(whole, name) for name in ("time", "force")}, segments=segments)
        return damping_share(cut)

    whole = made.run
    made.moving  # noqa: B018  the motion of all
    middle = damping_share(made)
    assert -0.2 < middle < 0.9
    assert share((0, 400), (400, 801)) == pytest.approx(-1.0, abs=5e-3)
    assert share((0, 801)) == pytest.approx(middle)
    assert share((0, 640), (640, 801)) == pytest.approx(middle, abs=0.35)  # four fifths of a cycle says nothing
    assert share((0, 640), (640, 801)) > -0.9
    assert share((0, 551), (551, 801)) == pytest.approx(-1.0, abs=5e-3)  # a second of 0.8 s cycles is one
    made.strokes = SimpleNamespace(period=None, steady=None)
    assert share((0, 400), (400, 801)) == pytest.approx(middle, abs=0.02)


@pytest.mark.parametrize(("share", "cycles", "refused"), [(-0.04, 2.0, False), (-0.06, 2.0, True), (-1.0, 0.9, False)])
def test_a_loop_that_gives_energy_is_refused_from_a_twentieth_on(monkeypatch, share, cycles, refused):
    monkeypatch.setattr(loop, "cycles_of", lambda view: cycles)
    monkeypatch.setattr(loop, "damping_share", lambda view: share)
    made = view(viscous)
    if not refused:
        return dissipates(made)
    with pytest.raises(QualityError, match=r"\(6 % of the force acts along.*count in opposite directions") as told:
        dissipates(made)
    assert told.value.code == "E_DISSIPATION_SIGN"
    monkeypatch.setattr(loop, "_exchanged", lambda view: True)
    with pytest.raises(QualityError, match="look exchanged"):
        dissipates(made)


def test_a_spring_force_that_comes_late_is_no_inverted_sign():
    late = view(lambda p, n, t: np.sin(p - 0.1) + 0.01 * np.cos(3 * p))
    with pytest.raises(QualityError, match=rf"{1e3 * 0.1 / OMEGA:.2g} ms or more behind the displacement") as told:
        dissipates(late)
    assert "sign" not in str(told.value.remedy)
    with pytest.raises(QualityError, match="count in opposite directions"):
        dissipates(view(lambda p, n, t: -np.sin(p) - 0.1 * np.cos(p) + 0.01 * np.cos(3 * p)))


def test_exchanged_channels_are_told_by_which_moves_like_a_sine():
    def square(p, n, t):
        return 50 * np.sign(np.cos(p)) + 3 * t

    assert not loop._exchanged(view(square))
    time = np.arange(801) / (POINTS * F)
    swapped = View(Record("made", time, square(OMEGA * time, 0, time) * 1e-4, 900 * np.sin(OMEGA * time)))
    assert loop._exchanged(swapped)
    # Overtones of the displacement over its first: as large as 1.4 times those of the force they are the force's.
    for ratio, exchanged in ((1.4, False), (1.6, True)):
        x = 0.02 * (np.sin(OMEGA * time) + 0.2 * ratio * np.sin(2 * OMEGA * time)) + 4e-3 * time
        made = View(Record("made", time + 3, x, 10 * np.cos(OMEGA * time) + 2 * np.cos(2 * OMEGA * time)))
        assert bool(loop._exchanged(made)) is exchanged
    still = view(viscous)
    still.motion, still.strokes = None, SimpleNamespace(steady=None, lengths=np.zeros(9))
    for size in (0.03, 0.05):
        for zero in (0.0, -0.03):
            for other in (0.0, -0.03):
                still.run = SimpleNamespace(
                    displacement=np.array([zero, zero + 0.04]), force=np.array([other, other + size])
                )
                assert loop._exchanged(still) is (size < 0.04)


@pytest.mark.parametrize(("steady", "cycles", "by_form"), [(None, 0.9, False), (None, 9, True), ((0, 9), 0.9, True)])
def test_channels_are_told_by_their_form_where_a_steady_part_or_enough_cycles_show_it(
    monkeypatch, steady, cycles, by_form
):
    """The channel called force is a sine and the other is not, but neither moves by more than the other."""
    phase = 2 * np.pi * np.arange(64) / 64
    forms = SimpleNamespace(
        displacement=SimpleNamespace(loop=np.sign(np.cos(phase))), force=SimpleNamespace(loop=np.cos(phase))
    )
    monkeypatch.setattr(loop, "steady_cycles", lambda view: forms)
    monkeypatch.setattr(loop, "cycles_of", lambda view: cycles)
    run = SimpleNamespace(displacement=np.array([0.0, 0.02]), force=np.array([0.0, 0.02]))
    assert loop._exchanged(SimpleNamespace(strokes=SimpleNamespace(steady=steady), run=run)) is by_form


def levels(turning, out, back, dip=0.0, share=0.0, count=1000):
    """A force at three levels by the velocity, of which a share dips."""
    velocity = np.cos(2 * np.pi * (np.arange(count) + 0.5) / count * 4)
    force = np.select([np.abs(velocity) < 0.3, velocity > 0], [turning, out], back).astype(float)
    force[: int(share * count)] = dip
    displacement = np.sin(2 * np.pi * (np.arange(count) + 0.5) / count * 4)
    return SimpleNamespace(
        run=SimpleNamespace(force=force, displacement=displacement), moving=SimpleNamespace(velocity=velocity)
    )


@pytest.mark.parametrize(
    ("made", "rectified"),
    [
        (levels(0, 100, 90), True),
        (levels(0, -100, -90), True),  # the other way up
        (levels(0, 100, -90), False),
        (levels(80, 100, 84), True),  # a fifth of the range below the weaker stroke
        (levels(82, 100, 84.5), False),  # a seventh
        (levels(0, 100, 90, -1.5, 0.02), True),  # little below zero
        (levels(0, 100, 90, -3.0, 0.02), False),
        (levels(0, 100, 90, -30.0, 0.002), True),  # a few samples do not count
        (levels(0, 100, 90, count=90), False),  # too few at the reversals
        (levels(0, 0, 0), False),
    ],
)
def test_a_rectified_force_is_nearer_to_zero_at_the_reversals_than_in_either_stroke(made, rectified):
    assert bool(loop._is_rectified(made)) is rectified
    slow = SimpleNamespace(run=made.run, moving=SimpleNamespace(velocity=0.15 * made.moving.velocity))
    assert bool(loop._is_rectified(slow)) is rectified  # whatever the speed of the test


@pytest.mark.parametrize("mirrored", [1.0, -1.0])
def test_reversals_and_strokes_are_told_by_the_largest_speed_either_way(mirrored):
    rng = np.random.default_rng(0)
    # To 2 m/s one way, 1.2 the other: turning below 0.2, strokes above 1.0.
    bands = ((0.0, 0.05, 30, 90.0), (0.05, 0.2, 100, 0.0), (0.2, 1.0, 200, 5.0), (1.0, 1.2, 60, 100.0))
    parts = [(sign * rng.uniform(low, high, n), np.full(n, F)) for low, high, n, F in bands for sign in (1, -1)]
    parts += [(-rng.uniform(1.2, 2.0, 10), np.full(10, 100.0)), (np.array([-2.0]), np.array([100.0]))]
    v, force = (np.concatenate(each) for each in zip(*parts, strict=True))

    def rectified(force):
        run = SimpleNamespace(force=mirrored * np.asarray(force), displacement=np.linspace(-1, 1, v.size))
        return loop._is_rectified(SimpleNamespace(run=run, moving=SimpleNamespace(velocity=mirrored * v)))

    assert rectified(force)
    half = np.where((np.abs(v) >= 1) & (np.arange(v.size) % 9 < 4), 0.0, force)  # four ninths of a stroke are missing
    assert rectified(np.where((np.abs(v) < 0.2) & (np.abs(v) > 0.05), 50.0, half))
    assert rectified(np.where(np.abs(v) < 1, 0.0, force) + 2 * rng.standard_normal(v.size))  # below zero by noise


def test_a_rectified_force_is_refused_by_its_name():
    with pytest.raises(QualityError, match="absolute value") as told:
        dissipates(view(lambda p, n, t: np.abs(np.cos(p))))
    assert told.value.code == "E_RECTIFIED"


def folded(back=1.0, lag=0.6, steep=4.0):
    """The absolute value of a hysteretic force: zero on either side of the middle, as large both ways."""
    return lambda p, n, t: np.abs(np.tanh(steep * np.cos(p - lag))) * np.where(np.cos(p - lag) > 0, 1.0, back)


@pytest.mark.parametrize(
    ("force", "refused"),
    [
        (folded(), True),
        (folded(back=0.8), True),
        (folded(back=1.25), True),
        (folded(back=0.7), False),  # strokes that differ by a third of the larger are two forces
        (lambda p, n, t: -folded()(p, n, t), True),
        (lambda p, n, t: np.tanh(4 * np.cos(p - 0.6)), False),
        # Down to zero on one side only: a spring stop, a hole, or play at one end.
        (lambda p, n, t: 1 - 0.97 * np.exp(-((np.mod(p, 2 * np.pi) - 2.2) ** 2) / 0.05), False),
        # On either side, but never near zero.
        (lambda p, n, t: 0.6 + 0.4 * folded()(p, n, t), False),
    ],
)
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_a_folded_force_has_zeros_on_either_side_and_strokes_alike(force, refused, size):
    made = view(lambda p, n, t: size * (force(p, n, t) + 0.02 * np.cos(p)))  # dissipative by a little
    if not refused:
        return dissipates(made)
    with pytest.raises(QualityError) as told:
        dissipates(made)
    assert told.value.code == "E_RECTIFIED"


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_strokes_of_a_folded_force_are_over_half_of_its_largest(size):
    phase = 2 * np.pi * np.arange(800) / 200
    force = folded()(phase, 0, 0)
    force[100] = 1.0 / 0.55
    seen = SimpleNamespace(run=SimpleNamespace(displacement=np.sin(phase)))
    assert loop._is_folded(seen, size * force, size, 0.95 * size)
    for out, back in ((1.0, 1.7), (1.7, 1.0)):
        assert not loop._is_folded(seen, size * force, out * size, back * size)
    force[100] = 1.0 / 0.45
    assert not loop._is_folded(seen, size * force, size, 0.95 * size)


@pytest.mark.parametrize("centre", [-3.0, 0.0, 3.0])  # wherever the displacement counts from
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_folded_force_is_near_zero_on_both_sides_of_the_middle(centre, side):
    phase = 2 * np.pi * np.arange(800) / 200
    seen = SimpleNamespace(run=SimpleNamespace(displacement=centre + side * np.sin(phase)))
    force = folded()(phase, 0, 0)
    assert loop._is_folded(seen, force, 1.0, 0.95)
    assert not loop._is_folded(seen, np.where(np.sin(phase) > 0, 1.0, force), 1.0, 0.95)


@pytest.mark.parametrize(("ratio", "length", "refuses"), [(0.6, 1.0, True), (0.8, 1.0, False), (0.6, 0.9, False)])
def test_a_motion_without_a_period_whose_force_changes_in_strokes_of_one_length_is_refused(ratio, length, refuses):
    """Two tests of one motion in one file, 0.37 s apart, the second with a part of the force or of the stroke."""
    time = np.arange(0, 10.37, 0.004)
    phase = 2 * np.pi * np.select([time < 5, time < 5.37], [time, 5.0], time - 0.37)
    second = time > 5.2
    force = np.where(second, ratio, 1.0) * 700 * np.tanh(4 * np.cos(phase))
    whole = View(Record("two", time, 0.01 * np.where(second, length, 1.0) * np.sin(phase), force))
    assert every_cycle(whole) is None
    if not refuses:
        return keeps_its_sign(whole)
    with pytest.raises(QualityError, match="or the record holds two tests") as refused:
        keeps_its_sign(whole)
    assert refused.value.code == "E_UNRELATED"


@pytest.mark.parametrize(
    ("times", "told"),
    [
        ([1, 1, 1, 1.4, 1.4, 1.4], r"1\.4 times as large from about 5\.4 s on"),
        ([1, 1, 1, 1, 1, 0.225], r"0\.225 times as large from about 7 s on"),
        ([1, 1, 1.2, 1.4, 1.4, 1.4], r"1\.4 times as large from about 4\.6 s on"),  # within a cycle
        ([1, 1, 1, 1.32, 1.32, 1.32], None),  # exp(0.3) is 1.35
        ([1, 1.4, 1.4, 1.4, 1.4, 1.4], None),  # the first cycle may be a way in from rest
        ([1, 1.1, 1, 1.5, 1.5, 1.5], None),  # a force that varies before
        ([1, 1, 1, 1.5, 1.65, 1.5], None),  # or after
        ([1, 1.05, 1, 1.5, 1.55, 1.5], "times as large"),  # a little does not matter
        ([1, 1.15, 1.3, 1.45, 1.6, 1.75], None),  # it grows
    ],
)
def test_a_force_that_is_from_somewhere_on_times_another_number_is_refused(times, told):
    made = view(lambda p, n, t: 7.0 + np.asarray(times)[n] * np.cos(p), 6.0)
    if told is None:
        return keeps_its_sign(made)
    with pytest.raises(QualityError, match=told) as refused:
        keeps_its_sign(made)
    assert refused.value.code == "E_UNRELATED"
    for step, right in ((0.05, False), (0.2, True)):  # a current that changes is a reason
        current = step * (made.record.time > 5.4)
        made.record = replace(made.record, current=current)
        made.run = SimpleNamespace(time=made.run.time, force=made.run.force, current=current)
        if right:
            keeps_its_sign(made)
        else:
            with pytest.raises(QualityError):
                keeps_its_sign(made)


@pytest.mark.parametrize(
    ("force", "cycles", "told"),
    [
        (viscous, 4.0, None),
        (lambda p, n, t: np.where(n == 2, -1.0, 1.0) * np.cos(p), 4.0, r"from 4.6 s on \(1 of 4 cycles\)"),
        (lambda p, n, t: np.where(n >= 1, -1.0, 1.0) * np.cos(p), 4.0, r"from 3.8 s on \(3 of 4 cycles\)"),
        (lambda p, n, t: np.where(n == 1, -1.0, 1.0) * np.cos(p), 2.0, r"from 3.8 s on \(1 of 2 cycles\)"),
        (lambda p, n, t: np.where(n == 1, -1.0, 1.0) * np.cos(p), 1.9, None),
        # A cycle that opposes clearly and one that pushes a little, or the other way round, are no flip.
        (lambda p, n, t: np.where(n == 1, -0.25, 0.97) * np.cos(p) + np.where(n == 1, 0.97, 0.25) * np.cos(2 * p),
         2.0, None),
        (lambda p, n, t: np.where(n == 1, -0.35, 0.94) * np.cos(p) + np.where(n == 1, 0.94, 0.35) * np.cos(2 * p),
         2.0, "1 of 2"),
        (lambda p, n, t: np.where(n == 1, 0.25, -0.97) * np.cos(p) + np.where(n == 1, 0.97, 0.25) * np.cos(2 * p),
         2.0, None),
        # A tenth of one cycle, where the force is large; a twentieth may be timing.
        (lambda p, n, t: np.where((n == 2) & (abs(p - 4 * np.pi - np.pi) < 0.1 * np.pi), -1, 1) * np.cos(p), 4.0,
         r"from 4.9[56]\d* s on \(1 of 4 cycles\)"),
        (lambda p, n, t: np.where((n == 2) & (abs(p - 4 * np.pi - np.pi) < 0.06 * np.pi), -1, 1) * np.cos(p), 4.0,
         None),
        (lambda p, n, t: np.where((n == 1) & (abs(p - 3 * np.pi) < 0.1 * np.pi), -1, 1) * np.cos(p), 2.0, None),
        (lambda p, n, t: np.where((n == 1) & (abs(p - 3 * np.pi) < 0.1 * np.pi), -1, 1) * np.cos(p), 3.0,
         r"\(1 of 3 cycles\)"),
        # Where the force is large and positive too, and a short stretch beside a long one.
        (lambda p, n, t: np.where((n == 2) & (p < 4.2 * np.pi), -1, 1) * np.cos(p), 4.0, "1 of 4"),
        (lambda p, n, t: np.where((n == 2) & ((p < 4.2 * np.pi) | (abs(p - 5 * np.pi) < 0.02)), -1, 1) * np.cos(p), 4.0,
         r"from 4.6 s on \(1 of 4"),
        (lambda p, n, t: np.where((n == 2) & ((p > 5.8 * np.pi) | (abs(p - 5 * np.pi) < 0.02)), -1, 1) * np.cos(p), 4.0,
         r"from 5.3\d* s on \(1 of 4"),
        # Where the force is small either sign is near; a force that is weak for a while has not turned.
        (lambda p, n, t: 100 * np.where((n == 2) & (abs(p - 4.5 * np.pi) < 0.29), -1, 1) * np.cos(p), 4.0, None),
        (lambda p, n, t: np.where((n == 2) & (p < 4.2 * np.pi), 0.3, 1) * np.cos(p), 4.0, None),
        (lambda p, n, t: np.where(abs(np.cos(p)) < 0.7, np.where(n == 2, -0.05, 0.05), np.cos(p)), 4.0, None),
        # The rest of a record beyond its last whole cycle.
        (lambda p, n, t: np.where(n == 2, -1.0, 1.0) * np.cos(p), 2.6, None),
    ],
)  # fmt: skip
def test_a_force_that_changes_its_sign_is_refused_from_where_it_does(force, cycles, told):
    made = view(force, cycles)
    if told is None:
        return keeps_its_sign(made)
    with pytest.raises(QualityError, match=told) as refused:
        keeps_its_sign(made)
    assert refused.value.code == "E_DISSIPATION_SIGN"
    made.found.append(SimpleNamespace(code="W_FROZEN"))
    keeps_its_sign(made)


def test_cycles_with_a_hole_or_too_few_samples_are_not_judged():
    def flipped(p, n, t):
        return np.where(n == 2, -1.0, 1.0) * np.cos(p)

    keeps_its_sign(view(flipped, hole=range(470, 500)))
    with pytest.raises(QualityError, match="1 of 3"):
        keeps_its_sign(view(flipped, hole=range(670, 700)))
    keeps_its_sign(view(flipped, points=15))
    with pytest.raises(QualityError, match="1 of 4"):
        keeps_its_sign(view(flipped, points=24))


def test_scatter_is_the_spread_of_the_cycles_over_the_peak_to_peak_force():
    gains = np.array([3.0, 0.9, 1.0, 1.2])

    def scaled(p, n, t):
        return 100 * gains[n] * np.cos(p) + 40

    scatter, noise = repeatability(view(scaled))
    last = gains[1:]  # the first of several may hold the way in from rest
    assert scatter == pytest.approx(np.std(last, ddof=1) * np.sqrt(0.5) / (2 * last.mean()), rel=0.02)
    assert noise < 1e-3
    scatter, _ = repeatability(view(lambda p, n, t: scaled(p, n + 1, t), cycles=2.0))
    assert scatter == pytest.approx(np.std([0.9, 1.0], ddof=1) * np.sqrt(0.5) / (2 * 0.95), rel=0.03)
    assert repeatability(view(scaled, cycles=1.9)) is None
    cubed, _ = repeatability(view(lambda p, n, t: 100 * gains[n] * np.cos(p) ** 3, cycles=3.0))
    assert cubed == pytest.approx(np.std([0.9, 1.0], ddof=1) * np.sqrt(5 / 16) / (2 * 0.95), rel=0.03)
    holed, _ = repeatability(view(scaled, hole=range(670, 700)))
    assert holed == pytest.approx(np.std([0.9, 1.0], ddof=1) * np.sqrt(0.5) / (2 * 0.95), rel=0.03)
    grain = np.random.default_rng(0).standard_normal(801)
    _, noise = repeatability(view(lambda p, n, t: 100 * np.cos(p) + 5 * grain))
    assert noise == pytest.approx(5 / 200, rel=0.15)
    still = view(viscous)
    still.motion = None
    assert repeatability(still) is None


@pytest.mark.parametrize(
    ("found", "said"),
    [((0.06, 0.0), "6.0 %"), ((0.06, 0.01), "6.0 %"), ((0.04, 0.03), None), ((0.05, 0.06), None), (None, None)],
)
def test_cycles_that_differ_by_more_than_noise_are_said(monkeypatch, found, said):
    monkeypatch.setattr(loop, "repeatability", lambda view: found)
    codes = (
        [(finding.code, said in finding.text) for finding in repeats(view(viscous))] if said else list(repeats(None))
    )
    assert codes == ([("W_REPEATABILITY", True)] if said else [])
