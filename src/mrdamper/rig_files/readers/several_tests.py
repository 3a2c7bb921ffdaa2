"""Arrays that hold several tests, split into a node a test: over conditions, one behind the other, or in lists."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from mrdamper.rig_files.column_names import names_condition, split_name
from mrdamper.rig_files.readers.arrays import Array
from mrdamper.rig_files.readers.base import RigFileError

MOST_ITEMS = 2000  # of a list
FEWEST_SAMPLES = 50  # of a test
_OF_TESTS = re.compile(r"(?i)(?:s|_?(?:vec(?:tor)?|list|values|levels|array|grid|axis))(?=$|_m?a$|\s*[\[(])")
# Samples of each test by channel, the numbers of values of the conditions they stand over, and what all tests have.
_Tests = tuple[Mapping[str, Sequence[Array]], tuple[int, ...], Mapping[str, Any]]


def with_tests_apart(tree: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return what a node holds with a node for each test of its arrays, with its own of the numbers beside them.

    Beside the samples stand vectors of conditions, one for every test or one for every dimension.
    """
    tests = _concatenated_tests(tree) or _tests_of_arrays(tree) or _tests_of_lists(tree)
    if tests is None:
        return tree
    samples, outer, shared = tests
    rest = {key: value for key, value in tree.items() if key not in (*samples, *shared)}
    at, beside = np.indices(outer).reshape(len(outer), -1), {}
    for key, array in _numeric(rest).items():
        shape = _shape(array)
        if shape == outer:
            beside[_of_one_test(key)] = np.reshape(array, -1)
        elif len(shape) == 1 and (axis := _axis_of(key, shape[0], outer, tree)) is not None:
            beside[_of_one_test(key)] = np.reshape(array, -1)[at[axis]]
    title = next(iter(samples)) if len(samples) == 1 else "test"
    nodes = {f"{title}_{i + 1}": {**{k: v[i] for k, v in samples.items()}, **shared} for i in range(math.prod(outer))}
    for i, node in enumerate(nodes.values()):
        node |= {key: float(values[i]) for key, values in beside.items()}
    return {**{key: value for key, value in rest.items() if _of_one_test(key) not in beside}, **nodes}


def _axis_of(key: str, size: int, outer: tuple[int, ...], tree: Mapping[str, Any]) -> int | None:
    """Return the dimension of a vector of conditions: the only one of its size, or as a text states: D{i,j}, I(j)."""
    if outer.count(size) < 2:
        return outer.index(size) if size in outer else None
    text = " ".join(text for text in tree.values() if isinstance(text, str))
    orders = {(*re.findall("[a-z]", of),) for of in re.findall(r"\w ?[({\[]([a-z](?:, ?[a-z])+)[)}\]]", text)}
    own = {*re.findall(rf"(?<!\w){re.escape(key)} ?[({{\[]([a-z])[)}}\]]", text)}
    at = [of.index(letter) for of in orders for letter in own if letter in of and len(of) == len(outer)]
    return at[0] if len(orders) == len(own) == len(at) == 1 and outer[at[0]] == size else None


def _numeric(tree: Mapping[str, Any]) -> dict[str, Array]:
    return {key: v for key, v in tree.items() if isinstance(v, Array) and v.dtype.kind in "iuf" and v.size > 1}


def _shape(array: Array) -> tuple[int, ...]:
    return tuple(n for n in array.shape if n > 1)


def _grid_of(value: Any, channels: Mapping[int, int | None]) -> tuple[tuple[int, ...], list[Array]]:
    """Return the conditions' dimensions and the arrays of samples of a list, or of an array over conditions.

    The channels of such an array stand along one of the last two, where `_dimensions` does not tell.
    """
    if isinstance(value, Array) and value.ndim > 2 and min(value.shape) > 1 and value.dtype.kind in "iuf":
        array = np.asarray(value)
        along, across = _dimensions(array, channels)
        last = (-2, -1) if across is None else (along, across)
        return _matrices(array, last) if across is not None or along >= array.ndim - 2 else ((), [])
    rows = value if isinstance(value, list) and len(value) > 1 else []
    flat = [item for row in rows for item in (row if isinstance(row, list) else [row])]
    if not flat or not all(isinstance(item, Array) for item in flat):
        return (), []
    return (len(rows), len(flat) // len(rows)) if len(flat) > len(rows) else (len(rows),), flat


def tests_of_array(array: np.ndarray) -> list[Array]:
    """Return the matrices of an array over tests, samples and channels, of which the time tells the channels.

    Raises `RigFileError`, E_AMBIGUOUS, unless the time has its smallest steps along the longest dimension, and one
    other has the channels.
    """
    along, across = _dimensions(array, {})
    if across is None or array.shape[along] < FEWEST_SAMPLES:
        raise _refusal(array)
    channels = np.moveaxis(array.astype(float), (across, along), (0, -1))
    time = next(channel for channel in channels if (np.diff(channel) > 0).all())
    steps = [np.diff(time, axis=i) for i in range(time.ndim) if time.shape[i] > 1]
    if any((of > 0).all() and of.mean() < steps[-1].mean() for of in steps[:-1]):  # the time goes on along another
        raise _refusal(array)
    return _matrices(array, (along, across))[1]


def _matrices(array: np.ndarray, last: tuple[int, int]) -> tuple[tuple[int, ...], list[Array]]:
    """Return the conditions' dimensions of an array and the samples of each; `last`: those of samples and channels."""
    array = np.moveaxis(array, last, (-2, -1))
    outer, matrices = array.shape[:-2], np.reshape(array, (-1, *array.shape[-2:]))
    return (outer, [_unpadded(matrix) for matrix in matrices]) if len(matrices) <= MOST_ITEMS else ((), [])


def _dimensions(array: np.ndarray, channels: Mapping[int, int | None]) -> tuple[int, int | None]:
    """Return the longest dimension, of the samples, and the only other of a length of `channels`, or None.

    `channels` has the place of the time by their number. Of several dimensions, and of all where no channels are named,
    that counts whose time alone increases along the samples; E_AMBIGUOUS if that is not one of those named.
    """
    along = int(np.argmax(array.shape))
    across = [i for i, n in enumerate(array.shape) if i != along and (n in channels or not channels)]
    if len(across) > 1 or not channels:
        steps = {i: np.diff(np.moveaxis(array, (i, along), (0, -1)).astype(float)) for i in across}
        rising = {i: ~(of <= 0).any(axis=tuple(range(1, array.ndim))) for i, of in steps.items()}
        times = {i: [*np.flatnonzero(places)] for i, places in rising.items()}
        across = [i for i, own in times.items() if len(own) == 1 and channels.get(array.shape[i], own[0]) == own[0]]
        if len(across) != 1 and channels:
            raise _refusal(array)
    return along, across[0] if len(across) == 1 else None


def _refusal(array: np.ndarray) -> RigFileError:
    problem = f"the channels may stand along two dimensions of an array of {' x '.join(map(str, array.shape))}"
    remedy = "save each test as an array of its own, its current in its name, or the time among the channels"
    return RigFileError("E_AMBIGUOUS", problem, remedy=remedy)


def _tests_of_lists(tree: Mapping[str, Any]) -> _Tests | None:
    """Return the tests of a list of matrices, data[current, frequency, sample, channel], or several lists of vectors.

    Lists within a list are cells of two conditions: T{i, j}, X{i, j}.
    """
    words = {k: v for k, v in tree.items() if isinstance(v, list) and all(isinstance(i, str) for i in v)}
    named = [[split_name(name).role for name in names] for names in words.values()]
    channels = {len(r): r.index("time") if "time" in r else None for r in named if len(r) - r.count(None) > 1}
    grids = {key: grid for key, value in tree.items() if (grid := _grid_of(value, channels))[1]}
    shapes = {key: [_shape(item) for item in items] for key, (_, items) in grids.items()}
    chosen = [key for key, of in shapes.items() if {len(shape) for shape in of} == {2}]
    vectors = [key for key, of in shapes.items() if {len(shape) for shape in of} == {1}]
    if not chosen and sum(split_name(key).role is not None for key in vectors) > 1:
        chosen = vectors if all(shapes[key] == shapes[vectors[0]] for key in vectors) else []
    if not chosen or len({grids[key][0] for key in chosen}) > 1 or (len(chosen) > 1 and chosen is not vectors):
        return None
    return {key: grids[key][1] for key in chosen}, grids[chosen[0]][0], words


def _of_one_test(key: str) -> str:
    """Return the name of one of the currents of a vector, currents_A or I_vec_A, as that of a current."""
    one = _OF_TESTS.sub("", key, count=1)
    return one if names_condition(split_name(one).name, "current") else key


def _tests_of_arrays(tree: Mapping[str, Any]) -> _Tests | None:
    """Return the tests of arrays over conditions and samples: force[current, frequency, time].

    Two arrays or more, no two dimensions of one length, each but that of the samples with a vector of a condition,
    which displacement[test, sample] and force[test, sample] need not have. The time may be the same for all or some
    conditions: time[frequency, sample].
    """
    numeric = _numeric(tree)
    shapes = {key: _shape(array) for key, array in numeric.items()}
    shape = max(shapes.values(), key=len, default=())
    times = {own for key, own in shapes.items() if split_name(key).role == "time"}
    times -= {(min(shape),)} if len(shape) == 2 and len(times) > 1 else set()  # when each test began
    if len(shape) < 2 or len({*shape}) < len(shape) or len(times) != 1 or not {*max(times)} <= {*shape}:
        return None
    samples = max(max(times))
    outer = tuple(n for n in shape if n != samples)
    tables = [key for key, own in shapes.items() if len(own) > 1 and samples in own and {*own} <= {*shape}]
    clocks = {key: numeric[key] for key, own in shapes.items() if own == (samples,)}
    conditions = {own for own in shapes.values() if len(own) == 1 and own[0] in outer}
    others = [key for key, own in shapes.items() if key not in (*tables, *clocks) and own not in conditions]
    whole = {split_name(key).role for key in tables if len(shapes[key]) == 2}
    of_tests = len(conditions) >= len(outer) or (len(outer) == 1 and {"displacement", "force"} <= whole)
    if not of_tests or others or len(tables) < 2:
        return None
    rows = []
    for key in tables:
        there = [n for n in (*outer, samples) if n in shapes[key]]
        array = np.transpose(np.squeeze(numeric[key]), [shapes[key].index(n) for n in there])
        array = np.reshape(array, [n if n in there else 1 for n in (*outer, samples)])
        rows.append(np.broadcast_to(array, (*outer, samples)).reshape(-1, samples))
    tests = [np.array(test) if clocks else _unpadded(np.array(test)) for test in zip(*rows, strict=True)]
    return dict(zip(tables, zip(*tests, strict=True), strict=True)), outer, clocks


def _concatenated_tests(tree: Mapping[str, Any]) -> _Tests | None:
    """Return the tests that stand behind each other in long arrays, by an array of their numbers of samples."""
    numeric = {key: array for key, array in _numeric(tree).items() if array.size in array.shape}
    samples = max((array.size for array in numeric.values()), default=0)
    long = [key for key, array in numeric.items() if array.size == samples]
    small = {key: array for key, array in numeric.items() if array.size < samples / FEWEST_SAMPLES}
    places = {key: ends for key, array in small.items() if (ends := _ends_of(array, samples)) is not None}
    if len(places) != 1 or sum(split_name(key).role is not None for key in long) < 2:
        return None
    (ends,) = places.values()
    parts = {key: np.split(np.reshape(numeric[key], -1), ends[:-1]) for key in long}
    conditions = [_of_one_test(key) for key, array in small.items() if array.size == ends.size and key not in places]
    clocks = [of for key, of in parts.items() if split_name(key).role == "time"]
    goes_on = any(after[0] > before[-1] for of in clocks for before, after in pairwise(of))
    if goes_on and not any(names_condition(split_name(key).name, "current") for key in conditions):
        return None  # cycles of one test
    return parts, (ends.size,), {}


def _ends_of(array: Array, samples: int) -> np.ndarray | None:
    """Return where tests end, by their numbers of samples or by where they start, with or without the end of all."""
    values = np.reshape(array, -1).astype(float)
    if np.any(values != np.floor(values)):
        return None
    ends = np.cumsum(values) if np.sum(values) == samples else np.unique([*values[1:], samples])
    apart = np.diff(ends, prepend=0).min() >= FEWEST_SAMPLES and ends[-1] == samples
    starts = values[0] == 0 and np.all(np.diff(values) > 0)
    return ends.astype(int) if apart and (starts or np.sum(values) == samples) else None


def _unpadded(matrix: np.ndarray) -> np.ndarray:
    """Return the samples of some channels without those at the end that no channel has: other tests are longer."""
    matrix = matrix if matrix.shape[0] <= matrix.shape[1] else matrix.T
    there = np.flatnonzero(~np.isnan(matrix.astype(float)).all(axis=0))
    return matrix[:, : there[-1] + 1] if there.size else matrix
