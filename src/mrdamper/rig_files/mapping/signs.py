"""Senses in which a file counts displacement and force: lines on signs, and columns of the sense of a force."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from mrdamper.data import Floats
from mrdamper.rig_files.column_names import role_of
from mrdamper.rig_files.readers.base import RawTable
from mrdamper.rig_files.record import SIGNED, Finding
from mrdamper.rig_files.vocabulary import words

_CONVENTION = words("sign")
_SENSE_NAMES = words("sense") | _CONVENTION
_SENSES = {1: tuple(words("tension_stems")), -1: tuple(words("compression_stems"))}
_POLARITIES = {1: tuple(words("positive_stems")), -1: tuple(words("negative_stems"))}
_WORD = re.compile(r"[^\W\d_]+")
_WORD_OR_SIGN = re.compile(r"[^\W\d_]+|(?<![\w+/-])[+-](?=\s*(?:[,;.)=]|$))")  # tension +, compression -
_PARTICLE = re.compile(r"とも|[とはがのを]")  # 変位と荷重は
_CLAUSE = re.compile(r"[,;|\t，；。]|\.\s")
_IS = {"i", "ist", "est", "e", "count"}  # without an s at the end: compression is positive
_MOVES = {"velocity": "displacement"}  # counts as
_LONGEST_LINE = 300


def with_sense(table: RawTable) -> RawTable:
    """Return a force recorded as a magnitude, with the sign that a column of two words beside it states."""
    forces = table.columns("force")
    senses = [i for i, name in enumerate(table.names) if name.strip().casefold() in _SENSE_NAMES]
    if len(forces) != 1 or len(senses) != 1 or table.words is None:
        return table
    words = table.words(senses[0])
    signs = [_sign_of(label, table.remarks) for label in words.labels]
    if sorted(signs) != [-1, 1]:
        return table
    sign, force = np.array(signs)[words.codes], forces[0]

    def signed(values: Mapping[int, Floats]) -> Floats:
        return values[force] if np.nanmin(values[force]) < 0 else sign * values[force]

    note = Finding("W_SCALE", f"the sign of the force is that of column {table.names[senses[0]]!r}")
    return table.computed(force, (force,), signed).noted(note)


def _sign_of(label: str, remarks: Sequence[str]) -> int:
    """1 for tension, -1 for compression, by the word itself or by a line that explains it; 0 if neither says."""
    explained = re.compile(rf"(?<!\w){re.escape(label)}\s*[=:]\s*([^\W\d]+)")
    words = [label, *(match[1] for line in remarks for match in explained.finditer(line))]
    signs = {_sign(_SENSES, word) for word in words} - {0}
    return signs.pop() if len(signs) == 1 else 0


def with_stated_signs(table: RawTable) -> RawTable:
    """Return the table with the senses in which lines count displacement and force: force positive in compression.

    A line of one sense holds for all that it names, unless clauses of it are about the sign of a channel each; else
    each clause does. A line about the sign that names no channel holds for those that no other states; what else may be
    about the sign leaves it unclear, as a clause does whose sense is none of the words known.
    """
    stated: dict[str, set[int]] = {}
    for line in table.remarks:
        whole = line[:_LONGEST_LINE]
        counted, clauses = _counted(whole), _CLAUSE.split(whole)
        each = [clause for clause in clauses if _signs(_POLARITIES, clause)]
        apart = len(each) > 1 and all(_named(clause) & {*SIGNED} for clause in each) and counted
        for clause in clauses if apart or len(counted) > 1 else [whole]:
            named, others = _named(clause), _others(clause)
            own = _counted(clause) if not named or named & {*SIGNED} else set()  # a pressure counts otherwise
            if not own and clause in each and (apart or (others & _CONVENTION and (not named or named & {*SIGNED}))):
                own = {1, -1}  # in other words than those known
            general = others & _CONVENTION or others <= _IS | _SENSE_NAMES
            for role in named & {*SIGNED} or {""}:
                stated.setdefault(role, set()).update(own if named or general or -1 not in own else {1, -1})
    unnamed = stated.get("", set()) - {1} and stated[""]
    senses = {role: sum(own) for role in SIGNED if (own := stated.get(role) or unnamed)}
    text = "the file counts compression positive in the {}: its sign is changed unless a profile states it"
    notes = [Finding("W_SCALE", text.format(role)) for role, sense in senses.items() if sense == -1]
    return replace(table, senses=senses).noted(*notes)


def states_sign(line: str) -> bool:
    """Tell if a line may state in which sense a channel counts positive."""
    line = line[:_LONGEST_LINE]
    others = _others(line)
    if others & _CONVENTION:
        return bool(_signs(_POLARITIES, line))
    return bool((others <= _IS | _SENSE_NAMES or _named(line) & {*SIGNED}) and _counted(line))


def _others(clause: str) -> set[str]:
    """Return the words of a clause that are neither senses nor polarities, without an s at the end."""
    words = _WORD.findall(clause)
    return {w.casefold().rstrip("s") for w in words if not _sign(_SENSES, w) and not _sign(_POLARITIES, w)}


def _named(clause: str) -> set[str]:
    """Return the channels that a clause names, by words that are no senses themselves."""
    roles = {word: role_of(word) for word in _WORD.findall(_PARTICLE.sub(" ", clause))}
    named = {role for word, role in roles.items() if role and (role == "force" or not _sign(_SENSES, word))}
    return {_MOVES.get(role, role) for role in named}


def _signs(stems: Mapping[int, tuple[str, ...]], clause: str) -> list[int]:
    return [sign for word in _WORD_OR_SIGN.findall(clause) if (sign := _sign(stems, word))]


def _counted(clause: str) -> set[int]:
    """Return the senses that a clause counts positive: 1 for tension, -1 for compression."""
    senses, polarities = _signs(_SENSES, clause), _signs(_POLARITIES, clause)
    paired = zip(senses, polarities, strict=True) if len(senses) == len(polarities) else product(senses, polarities)
    return {sense * polarity for sense, polarity in paired}


def _sign(stems: Mapping[int, tuple[str, ...]], word: str) -> int:
    """Return 1 or -1 where a word begins with one of its stems, or has a Chinese or Japanese one in it; else 0."""
    low = word.casefold()
    return next((sign for sign, of in stems.items() if low.startswith(of) or any(s in low for s in of if s > "⺀")), 0)
