"""A search over a population of hysteretic shapes: on one thread by mrdamper, and by JAX on the device that it has.

    python -m benchmarks.accelerator

Both compute, for P shapes and 1,000 samples, the least squared force error with three other columns. JAX integrates the
Bouc–Wen equation by RK4 at the sample step for all shapes at once, in double and in single precision. Needs JAX, which
`make bench` does not install.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import jax
import numpy as np
from jax import Array, lax
from jax import numpy as jnp

from benchmarks.batches import batch_cost, loop, motion, shapes
from mrdamper.data import Floats
from mrdamper.physics.hysteresis import Shape
from mrdamper.statistics.linear import FixedColumns

SAMPLES, POPULATIONS = 1000, (1_000, 30_000, 1_000_000)


def main() -> None:
    """Print a table of the populations."""
    jax.config.update("jax_enable_x64", True)
    print(f"JAX {jax.__version__} on {jax.devices()[0].device_kind}; wall time of the fastest of five calls\n")
    print("| shapes | method | ms | ns per sample and shape | largest relative difference of a cost |")
    print("| --- | --- | --- | --- | --- |")
    for population in POPULATIONS:
        _compare(shapes(population))


def _compare(candidates: Shape) -> None:
    path, fixed = loop(SAMPLES, 1)
    reference, whole = batch_cost(path, fixed, candidates), float(fixed.rest @ fixed.rest)
    _print("mrdamper, one thread", lambda: batch_cost(path, fixed, candidates), reference)
    for precision in (jnp.float64, jnp.float32):
        gain = _gain(motion(SAMPLES, 1), fixed, candidates, precision)
        _print(
            f"JAX, RK4, {jnp.dtype(precision).name}",
            lambda g=gain: whole - np.asarray(g()),
            reference,
        )


def _gain(x: Floats, fixed: FixedColumns, candidates: Shape, precision: type) -> Callable[[], Array]:
    """Sums over the samples while the equation is integrated, so that no array of shapes × samples is kept."""
    columns = np.column_stack([fixed.basis, fixed.rest])
    step, rows, shape = (jnp.asarray(a, precision) for a in (np.diff(x, prepend=x[0]), columns, candidates.kappa))

    def rate(dx: Array, z: Array, kappa: Array) -> Array:  # n = 2, and beta equal to gamma
        return kappa * (dx - (abs(dx) * abs(z) * z + dx * z**2) / 2)

    @jax.jit
    def gain(kappa: Array) -> Array:
        def sample(carry: tuple[Array, Array, Array], inputs: tuple[Array, Array]) -> tuple[tuple[Array, ...], None]:
            z, along, square = carry
            dx, row = inputs
            k1 = rate(dx, z, kappa)
            k2 = rate(dx, z + k1 / 2, kappa)
            k3 = rate(dx, z + k2 / 2, kappa)
            k4 = rate(dx, z + k3, kappa)
            z += (k1 + 2 * k2 + 2 * k3 + k4) / 6
            return (z, along + row[:, None] * z, square + z * z), None

        start = (jnp.zeros_like(kappa), jnp.zeros((rows.shape[1], kappa.size), precision), jnp.zeros_like(kappa))
        (_, along, square), _ = lax.scan(sample, start, (step, rows))
        left = square - jnp.sum(along[:-1] ** 2, axis=0)
        return jnp.maximum(along[-1], 0) ** 2 / left

    return lambda: gain(shape).block_until_ready()


def _print(name: str, call: Callable[[], Floats], reference: Floats) -> None:
    error = np.max(np.abs(call() / reference - 1))
    seconds = min(_seconds(call) for _ in range(5))
    each = 1e9 * seconds / reference.size / SAMPLES
    print(f"| {reference.size:,} | {name} | {1e3 * seconds:.4g} | {each:.3g} | {error:.0e} |", flush=True)


def _seconds(call: Callable[[], np.ndarray]) -> float:
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


if __name__ == "__main__":
    main()
