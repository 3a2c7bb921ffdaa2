"""Parts of the covariance beside brute force: covariance matrices written out, recursions in plain Python."""

import math

import numpy as np
import pytest

from mrdamper.identification import covariance
from mrdamper.identification.autoregression import Autoregression, models_by_likelihood
from mrdamper.identification.covariance import spread
from mrdamper.identification.intervals import student

RNG = np.random.default_rng(11)


@pytest.fixture(autouse=True)
def the_same_draws_whatever_ran_before():
    RNG.bit_generator.state = np.random.default_rng(11).bit_generator.state


def numbers(model):
    return np.append(model.variance, model.coefficients)


def burg(series):
    """Burg's recursion with the mean's bias taken out of the first order, and the corrected criterion of Akaike."""
    N = len(series)
    f = b = [v - sum(series) / N for v in series]
    variance, a = sum(v * v for v in f) / N, []
    best, least = [variance], N * math.log(variance) + 2 * N / (N - 2)
    for order in range(1, min(12, N // 10) + 1):
        ahead, behind = f[1:], b[:-1]
        k = (
            -2
            * sum(p * q for p, q in zip(ahead, behind, strict=True))
            / sum(p * p + q * q for p, q in zip(ahead, behind, strict=True))
        )
        if order == 1:
            k = max(k - max(1 - 3 * k, 0.0) / N, -0.9995)
        f = [p + k * q for p, q in zip(ahead, behind, strict=True)]
        b = [q + k * p for p, q in zip(ahead, behind, strict=True)]
        a = [*(p + k * q for p, q in zip(a, a[::-1], strict=True)), k]
        variance = sum(p * p + q * q for p, q in zip(f, b, strict=True)) / (2 * len(f))
        criterion = N * math.log(variance) + 2 * (order + 1) * N / max(N - order - 2, 1)
        if criterion < least:
            best, least = [variance, *a], criterion
    return best


@pytest.mark.parametrize("size", [35, 130, 300])
@pytest.mark.parametrize("coefficients", [(), (-0.7,), (-1.4, 0.6), (-0.2, 0.1, 0.5)])
def test_an_autoregression_is_burgs(size, coefficients):
    noise = np.random.default_rng(size).standard_normal(size + 50)
    series = noise.copy()
    for i in range(len(coefficients), series.size):
        series[i] = noise[i] - sum(a * series[i - k] for k, a in enumerate(coefficients, 1))
    series = series[50:] + 3.0
    assert numbers(Autoregression.of(series)) == pytest.approx(np.array(burg(series.tolist())))
    assert numbers(Autoregression.of(np.full(40, 2.0))).tolist() == [0.0]


@pytest.mark.parametrize(("rho", "variance"), [(0.0, 1.7), (0.6, 1.7), (0.6, 1.7e-4), (-0.4, 1.7)])
def test_noise_gives_the_score_of_its_covariance_matrix(monkeypatch, rho, variance):
    N = 90
    model = Autoregression(variance, np.array([-rho] if rho else []))
    monkeypatch.setattr(Autoregression, "of", lambda residual: model)
    J = RNG.standard_normal((N, 3)) * [1.0, 2.0, 0.5]
    inverse = np.linalg.inv(J.T @ J)
    (score, relative), memory = covariance._noise(J, RNG.standard_normal(N), inverse)

    def by_matrix(r):
        lag = np.abs(np.subtract.outer(np.arange(N), np.arange(N)))
        return J.T @ (variance * r**lag / (1 - r * r)) @ J

    whole = variance / (1 - rho**2)
    plain = by_matrix(rho)
    taken = np.trace(inverse @ plain) / (N * whole)
    assert score == pytest.approx(plain / (1 - taken), rel=1e-6)
    assert memory == pytest.approx((1 + rho) / (1 - rho), rel=1e-6)
    # Relative variance of each variance: 2/N of the innovation, and what an uncertain coefficient bends.
    if not rho:
        assert relative == pytest.approx([2 / N] * 3)
        return
    step = 1e-5
    shares = [np.diag(inverse @ by_matrix(rho + s) @ inverse) for s in (-step, 0.0, step)]
    slope = (shares[2] - shares[0]) / (2 * step) / shares[1]
    assert relative == pytest.approx(2 / N + slope**2 * (1 - rho**2) / N, rel=1e-3)


@pytest.mark.parametrize("fall", [1.5, 2.0])
def test_repeated_power_follows_a_power_of_the_order(fall):
    orders, left = np.arange(1.0, 9.0), np.ones(8)
    odd = orders % 2 == 1
    power = np.where(odd, 9.0, 0.4) * orders**-fall
    # Where the fit has taken most of every line away, too, as long as a kind has left what one line holds.
    assert covariance._power_law(orders, 0.3 * power, np.zeros(8), np.full(8, 0.3))[0] == pytest.approx(power)
    level, relative = covariance._power_law(orders, power, np.zeros(8), left)
    assert level == pytest.approx(power)
    lifted, _ = covariance._power_law(orders, power, np.full(8, 0.3), left)
    assert lifted == pytest.approx(np.maximum(power - 0.3, 0.0))
    X = np.column_stack([odd, ~odd, -np.log(orders)]).astype(float)
    assert relative == pytest.approx(X @ np.linalg.inv(X.T @ X) @ X.T)


def test_parts_add_up_and_doubt_follows_their_shares(monkeypatch):
    J = RNG.standard_normal((60, 2))
    inverse = np.linalg.inv(J.T @ J)
    lines, noise = np.diag([3.0, 1.0]), np.diag([1.0, 5.0])
    rest = np.ones(60)
    monkeypatch.setattr(covariance, "_repeated", lambda *args: (rest, [(lines, np.array([0.5, 0.4]))]))
    monkeypatch.setattr(covariance, "_noise", lambda J, r, inverse: ((noise, np.array([0.1, 0.02])), 4.0))
    time = np.arange(60) / 20
    total, dof, length = covariance.score_covariance(J, rest, time, 1.0, inverse)
    assert total == pytest.approx(lines + noise)
    share = np.diag(inverse @ lines @ inverse) / np.diag(inverse @ (lines + noise) @ inverse)
    doubt = share**2 * [0.5, 0.4] + (1 - share) ** 2 * [0.1, 0.02]
    assert dof == pytest.approx(2 / doubt)
    assert length == pytest.approx(60 / 4)
    alone, dof, _ = covariance.score_covariance(J, rest, None, None, inverse)
    assert alone == pytest.approx(noise)
    assert dof == pytest.approx([20.0, 100.0])


def test_what_repeats_is_taken_out_and_counted_once_however_many_cycles():
    N, cycles = 800, 8
    time = np.arange(N) / N * cycles
    phase = 2 * np.pi * time
    repeated = sum(20 / k**2 * np.cos(k * phase + k) for k in range(1, 20, 2))
    noise = np.random.default_rng(2).standard_normal(N)
    J = np.column_stack([np.cos(2.5 * phase), np.sin(3 * phase)])
    inverse = np.linalg.inv(J.T @ J)
    rest, parts = covariance._repeated(J, repeated + noise, time, 1.0, inverse)
    assert np.std(rest) == pytest.approx(np.sqrt((N - 48) / N), rel=0.08)
    (lines, relative), *more = parts
    assert not more
    # sin 3θ sees its own line alone: N/2 times it, with a mean square that the power law says.
    assert lines[1, 1] == pytest.approx((N / 2) ** 2 * (20 / 9) ** 2 / 2, rel=0.4)
    assert lines[0, 0] < 1e-3 * lines[1, 1]
    assert np.all(relative > 0)
    plain, none = covariance._repeated(J, noise, time, 1.0, inverse)
    assert np.array_equal(plain, noise)
    assert none == []
    short, parts = covariance._repeated(
        J[:150], (repeated + noise)[:150], time[:150], 1.0, np.linalg.inv(J[:150].T @ J[:150])
    )
    assert np.array_equal(short, (repeated + noise)[:150])  # 1.5 cycles: what repeats cannot be told from what does not
    assert len(parts) == 1


def test_a_long_record_is_looked_at_in_means_and_its_errors_are_those_of_the_means():
    N, block = 2001 * 4 + 3, 4
    time = np.arange(N) / 1000
    J = np.column_stack([np.cos(2 * np.pi * time), np.ones(N)])
    residual = np.random.default_rng(5).standard_normal(N)
    kept = N // block * block
    thin = [a[:kept].reshape(-1, block, *a.shape[1:]).mean(axis=1) for a in (J, residual, time)]
    assert spread(J, residual, time, 1.0).errors == pytest.approx(spread(*thin, 1.0).errors)
    as_it_is = spread(J[:4001], residual[:4001]).errors  # less than two blocks: every sample
    assert as_it_is == pytest.approx(np.sqrt([2.0, 1.0]) / np.sqrt(4001), rel=0.1)


def test_degrees_of_freedom_and_effective_samples_of_white_noise():
    N = 400
    J = RNG.standard_normal((N, 2)) * [1.0, 30.0]
    residual = np.random.default_rng(6).standard_normal(N)
    residual -= J @ np.linalg.lstsq(J, residual, rcond=None)[0]
    found = spread(J, residual)
    assert found.effective == pytest.approx([N, N], rel=0.1)
    assert found.dof == pytest.approx([N - 2, N - 2], rel=0.05)
    nothing = spread(np.zeros((N, 2)), residual)
    assert np.isinf(nothing.errors).all()
    assert nothing.effective.tolist() == [0.0, 0.0]
    assert nothing.dof.tolist() == [1.0, 1.0]


def test_a_spread_is_put_together_from_its_parts(monkeypatch):
    N, seen = 50, [0, 2, 3]
    J = np.zeros((N, 4))
    J[:, seen] = RNG.standard_normal((N, 3)) * [1.0, 20.0, 0.5]
    residual, time = RNG.standard_normal(N), np.arange(N) / 10
    S = np.array([[9.0, 0.1, 0.5], [0.1, 0.05, 0.02], [0.5, 0.02, 4.0]])
    given = {}

    def score(unit, residual, time, frequency, inverse):
        given.update(unit=unit, residual=residual, time=time, frequency=frequency, inverse=inverse)
        return S, np.array([0.3, 20.0, 200.0]), 7.5

    monkeypatch.setattr(covariance, "score_covariance", score)
    found = spread(J, residual, time, 2.5)
    scale = np.sqrt((J[:, seen] ** 2).sum(axis=0))
    inverse = np.linalg.inv((J[:, seen] / scale).T @ (J[:, seen] / scale))
    assert given["unit"] == pytest.approx(J[:, seen] / scale)
    assert given["inverse"] == pytest.approx(inverse)
    assert (given["residual"] is residual, given["time"] is time, given["frequency"]) == (True, True, 2.5)
    expected = inverse @ S @ inverse / np.outer(scale, scale)
    assert found.covariance[np.ix_(seen, seen)] == pytest.approx(expected)
    assert found.covariance[1].tolist() == found.covariance[:, 1].tolist() == [0.0, np.inf, 0.0, 0.0]
    textbook = residual @ residual / (N - 3) * np.diag(np.linalg.inv(J[:, seen].T @ J[:, seen]))
    assert found.textbook[seen] == pytest.approx(np.sqrt(textbook))
    assert np.isinf(found.textbook[1])
    assert found.effective[seen] == pytest.approx(np.minimum(N * textbook / np.diag(expected), N))
    assert 0 < found.effective[0] < N == pytest.approx(found.effective[2])
    assert found.effective[1] == 0.0
    assert found.dof.tolist() == [1.0, 1.0, 20.0, N - 3]
    assert (found.memory, found.alike) == (7.5, ())


def test_what_two_parameters_do_alike_is_lost_and_says_so():
    a, b = RNG.standard_normal((2, 60))
    found = spread(np.column_stack([np.zeros(60), a, b, -2 * a]), RNG.standard_normal(60))
    assert found.alike == ((1, 3),)
    assert np.isinf(np.diag(found.covariance)).tolist() == [True, True, False, True]
    off = found.covariance[~np.eye(4, dtype=bool)]
    assert off.tolist() == [0.0] * 12
    assert np.isinf(found.textbook[[1, 3]]).all()
    assert found.effective[[1, 3]].tolist() == [0.0, 0.0]
    # Of unit vectors at a small angle δ the eigenvalues are 2 and δ²/2; below 2e-12 nothing is known.
    for eigenvalue, lost in ((1.5e-12, True), (3e-12, False)):
        delta = np.sqrt(2 * eigenvalue)
        J = np.array([[1.0, np.cos(delta)], [0.0, np.sin(delta)], [0.0, 0.0]])
        assert bool(spread(J, np.array([0.1, 0.2, 0.3])).alike) is lost


@pytest.mark.parametrize("seed", range(8))
def test_alike_parameters_are_grouped_whatever_mixture_shows_them(seed):
    """Three pairs, some of opposite signs, whose combinations without effect are turned into one another."""
    rng = np.random.default_rng(seed)
    places, signs = rng.permutation(8), rng.choice([-1.0, 1.0], 8)
    pairs = [sorted(places[2 * k : 2 * k + 2].tolist()) for k in range(3)]
    plain = np.zeros((8, 3))
    for k, pair in enumerate(pairs):
        plain[pair, k] = signs[pair] / np.sqrt(2)
    turned = plain @ np.linalg.qr(rng.standard_normal((3, 3)))[0]
    groups = covariance.alike_groups(turned)
    assert sorted(group for group, _ in groups) == sorted(pairs)
    assert all(one in group for group, one in groups)


@pytest.mark.parametrize("block", [2, 3])
def test_some_samples_of_many_become_one(monkeypatch, block):
    monkeypatch.setattr(covariance, "_MAX_SAMPLES", 35 // block - 1)
    J, residual, time = RNG.standard_normal((35, 2)), RNG.standard_normal(35), np.arange(35) / 7
    thin = [np.array([a[i : i + block].mean(axis=0) for i in range(0, 36 - block, block)]) for a in (J, residual, time)]
    monkeypatch.setattr(covariance, "score_covariance", lambda *given: (given[0].T @ given[0], np.ones(2), 1.0))
    found, expected = spread(J, residual, time, 1.0), spread(*thin, 1.0)
    assert found.covariance == pytest.approx(expected.covariance)
    of_all = float(residual @ residual) / 33 * np.diag(np.linalg.inv(thin[0].T @ thin[0])) / block
    assert found.textbook == pytest.approx(np.sqrt(of_all))  # as if all 35 were independent
    assert found.effective == pytest.approx(np.minimum(35 * of_all / np.diag(expected.covariance), 35))
    none = spread(J[:19], residual[:19])  # less than two of the most
    assert none.covariance == pytest.approx(np.linalg.inv(J[:19].T @ J[:19]))


def spectrum(model, omega):
    response = np.ones_like(omega) + sum(a * np.exp(-1j * omega * k) for k, a in enumerate(model[1:], 1))
    return model[0] / abs(response) ** 2


def covariance_matrix(model, size):
    circle = 2 * np.pi * np.arange(1 << 14) / (1 << 14)
    memory = np.fft.ifft(spectrum(model, circle)).real[:size]
    return memory[np.abs(np.subtract.outer(np.arange(size), np.arange(size)))]


def repeated_by_hand(J, r, time, f, inverse):
    """What repeats, wave by wave: rest, Jᵀ Σ J, relative variances; None twice where nothing does."""
    N, step = r.size, float(np.median(np.diff(time)))
    most = int(min(24, 0.4 / (step * f), N // 8))
    if most < 4:
        return r, None, None
    waves = [g(2 * np.pi * f * k * (time - time[0])) for k in range(1, most + 1) for g in (np.cos, np.sin)]
    W = np.column_stack(waves)
    a = np.linalg.lstsq(W, r - r.mean(), rcond=None)[0]
    rest = r - W @ a
    model = burg(rest.tolist())
    left = [
        np.mean([1 - (J.T @ w) @ inverse @ (J.T @ w) / (w @ w) for w in waves[2 * k : 2 * k + 2]]) for k in range(most)
    ]
    power = [(a[2 * k] ** 2 + a[2 * k + 1] ** 2) / 2 for k in range(most)]
    whole = covariance_matrix(model, N)
    each = [w @ whole @ w / (w @ w) ** 2 * N / (N - 2 * most) for w in waves]
    expected = [(each[2 * k] + each[2 * k + 1]) / 2 for k in range(most)]
    left, power, expected = (np.array(v) for v in (left, power, expected))
    if power.sum() < (1 + 3 / np.sqrt(left.sum())) * (expected @ left):
        return r, None, None
    level, relative = covariance._power_law(np.arange(1.0, most + 1), power, expected, left)
    lines = sum(level[k // 2] * np.outer(J.T @ w, J.T @ w) for k, w in enumerate(waves))
    pull = np.array([inverse @ (J.T @ w) for w in waves]).T
    shares = level * (pull[:, ::2] ** 2 + pull[:, 1::2] ** 2)
    weights = shares / shares.sum(axis=1, keepdims=True)
    doubt = np.array([w @ relative @ w for w in weights])
    return (r if (time[-1] - time[0]) * f < 1.9 else rest), lines, doubt


@pytest.mark.parametrize(
    ("f", "cycles", "points"),
    [
        (1.7, 5.0, 90),
        (0.4, 3.3, 60),
        (2.0, 6.0, 16),
        (2.0, 6.0, 11),
        (2.0, 6.0, 8),
        (1.3, 1.85, 200),
        (1.3, 1.95, 200),
        (3.0, 12.0, 100),
    ],
)
@pytest.mark.parametrize("noise", [0.02, 0.7])
def test_what_repeats_is_found_wave_by_wave(f, cycles, points, noise):
    N = int(cycles * points)
    time = 5.03 + np.arange(N) / (points * f)
    phase = 2 * np.pi * f * time
    rng = np.random.default_rng(N)
    coloured = np.convolve(rng.standard_normal(N + 3), [1.0, 0.7, 0.3, 0.1], "valid")
    r = 2.0 + sum(np.cos(k * phase + k) / k**1.5 for k in range(1, 12)) + noise * coloured
    J = np.column_stack([np.cos(phase), np.sin(2 * phase + 0.3), np.linspace(-1, 1, N) ** 3])
    inverse = np.linalg.inv(J.T @ J)
    rest, lines, doubt = repeated_by_hand(J, r, time, f, inverse)
    found, parts = covariance._repeated(J, r, time, f, inverse)
    assert found == pytest.approx(rest, abs=1e-9)
    assert len(parts) == (lines is not None)
    if parts:
        assert parts[0][0] == pytest.approx(lines, rel=1e-6, abs=1e-9 * np.abs(lines).max())
        assert parts[0][1] == pytest.approx(doubt)


@pytest.mark.parametrize("seed", range(4))
def test_a_surplus_that_chance_explains_does_not_repeat(seed):
    f, N = 1.7, 360
    time = np.arange(N) / (60 * f)
    noise = np.random.default_rng(seed).standard_normal(N)
    J = np.column_stack([np.cos(2 * np.pi * f * time), np.ones(N)])
    inverse = np.linalg.inv(J.T @ J)

    def by_hand(size):
        return repeated_by_hand(J, noise + size * np.cos(6 * np.pi * f * time), time, f, inverse)[1] is not None

    low, high = 0.0, 1.0
    if by_hand(low) or not by_hand(high):
        pytest.fail("not between")
    while high - low > 1e-4:
        low, high = (low, (low + high) / 2) if by_hand((low + high) / 2) else ((low + high) / 2, high)
    for size, repeats in ((low - 1e-3, False), (high + 1e-3, True)):
        _, parts = covariance._repeated(J, noise + size * np.cos(6 * np.pi * f * time), time, f, inverse)
        assert bool(parts) is repeats


def test_orders_are_chosen_as_by_the_criterion_in_short_and_white_records():
    for seed in range(200):
        series = np.random.default_rng(seed).standard_normal((31 if seed < 60 else 20) + seed % 5)
        assert numbers(Autoregression.of(series)) == pytest.approx(np.array(burg(series.tolist()))), seed


def test_doubt_of_two_coefficients_is_that_of_their_joint_spread(monkeypatch):
    N, model = 80, np.array([1.7, -0.9, 0.4])
    lattice = Autoregression(1.7, np.array([-0.9 / 1.4, 0.4]))
    assert lattice.coefficients == pytest.approx(model[1:])
    monkeypatch.setattr(Autoregression, "of", lambda residual: lattice)
    J = np.random.default_rng(1).standard_normal((N, 3)).cumsum(axis=0)
    inverse = np.linalg.inv(J.T @ J)
    circle = 2 * np.pi * np.arange(4096) / 4096

    def memory(a):
        return np.array([np.mean(np.cos(k * circle) * spectrum([1.7, *a], circle)) for k in range(N)])

    def variances(a):
        return np.diag(inverse @ J.T @ memory(a)[np.abs(np.subtract.outer(np.arange(N), np.arange(N)))] @ J @ inverse)

    g = memory(model[1:])
    spread_of = 1.7 / N * np.linalg.inv([[g[0], g[1]], [g[1], g[0]]])
    step = 1e-5 * np.eye(2)
    bent = np.array([(variances(model[1:] + s) - variances(model[1:] - s)) / 2e-5 for s in step]) / variances(model[1:])
    (_, relative), length = covariance._noise(J, np.ones(N), inverse)
    assert relative == pytest.approx(2 / N + np.einsum("kp,kl,lp->p", bent, spread_of, bent), rel=1e-3)
    assert length == pytest.approx(spectrum(model, 0.0) / g[0])


@pytest.mark.parametrize(("cycles", "asked"), [(0.94, False), (0.96, True)])
def test_a_motion_repeats_from_nearly_a_cycle_on(monkeypatch, cycles, asked):
    seen = []
    monkeypatch.setattr(covariance, "_repeated", lambda *given: seen.append(given) or (given[1], []))
    J = RNG.standard_normal((60, 2))
    time = 9.0 + np.linspace(0, cycles / 3.0, 60)
    covariance.score_covariance(J, RNG.standard_normal(60), time, 3.0, np.linalg.inv(J.T @ J))
    assert bool(seen) is asked


def test_powers_are_powers():
    base = np.exp(1j * np.array([0.1, 2.0]))
    assert covariance._powers(base, 3) == pytest.approx(np.array([base, base**2, base**3]))


@pytest.mark.parametrize("reflections", [(-0.9,), (-0.8, 0.3, -0.2)])
def test_innovations_are_white_from_the_first_sample_on(reflections):
    model = Autoregression(2.5, np.array(reflections))
    whole = covariance_matrix(numbers(model), 40)
    turned = model.innovations(np.eye(40))
    assert turned @ whole @ turned.T == pytest.approx(2.5 * np.eye(40), abs=1e-9)
    assert model.lags == pytest.approx(spectrum(numbers(model), 0.0) / whole[0, 0])


def test_the_probability_of_a_model_is_its_restricted_likelihood():
    N = 120
    residual = np.random.default_rng(4).standard_normal(N).cumsum()
    J = np.column_stack([np.ones(N), np.cos(np.arange(N) / 9.0), np.zeros(N)])
    residual -= J @ np.linalg.lstsq(J, residual, rcond=None)[0]
    models, probabilities = models_by_likelihood(J, residual)
    assert probabilities.sum() == pytest.approx(1.0)
    logs = []
    for model in models:
        whole = covariance_matrix(numbers(model), N)
        inverse, X = np.linalg.inv(whole), J[:, :2]
        normal = X.T @ inverse @ X
        left = inverse - inverse @ X @ np.linalg.inv(normal) @ X.T @ inverse
        assert residual @ left @ residual == pytest.approx(N - 2, rel=1e-3)  # the most likely variance
        determinants = np.linalg.slogdet(whole)[1] + np.linalg.slogdet(normal)[1]
        logs.append(-determinants / 2 + np.log(1 + model.reflections[0]) / 2)
    by_hand = np.exp(np.array(logs) - max(logs))
    assert probabilities == pytest.approx(by_hand / by_hand.sum(), rel=0.02)


@pytest.mark.parametrize("correlation", [0.998, pytest.param(0.99, marks=pytest.mark.slow)])
def test_intervals_hold_the_truth_where_a_record_is_shorter_than_its_memory(correlation):
    N, repeats, rng = 800, 300, np.random.default_rng(8)
    phase = 2 * np.pi * np.arange(N) / 160
    J = np.column_stack([np.ones(N), np.cos(phase), np.sin(3 * phase)])
    start, inside = rng.standard_normal(repeats), np.zeros(3)
    noise = np.sqrt(1 - correlation**2) * rng.standard_normal((repeats, N))
    noise[:, 0] = start
    for k in range(1, N):
        noise[:, k] += correlation * noise[:, k - 1]
    for series in noise:
        fitted = np.linalg.lstsq(J, series, rcond=None)[0]
        found = spread(J, series - J @ fitted, np.arange(N) / 160, 1.0)
        inside += np.abs(fitted) <= found.errors * [student(0.95, d) for d in found.dof]
    assert (inside / repeats > 0.92).all()
    assert (inside[1:] / repeats < 0.99).all()  # of the mean such a record tells little, and no interval is exact
