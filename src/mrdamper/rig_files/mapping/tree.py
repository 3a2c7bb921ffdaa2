"""The dry run: what is in the files, and which of it would be taken for a test."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from mrdamper.errors import InputError
from mrdamper.rig_files.readers.base import RawTable

_MOST_COLUMNS, _MOST_REMARKS, _MOST_NAMES = 40, 6, 3


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a node: its name, its unit, and its first value."""

    name: str
    unit: str


@dataclass(frozen=True, slots=True)
class Node:
    """A table within a file."""

    path: str  # within the file, empty for its only table
    columns: tuple[Column, ...]
    beside: tuple[str, ...]  # numbers and lines beside the columns


@dataclass(frozen=True, slots=True)
class FileTree:
    """A file, its tables, and why it could not be opened."""

    name: str
    nodes: tuple[Node, ...]
    problem: str = ""


def nodes_of(tables: Iterable[RawTable]) -> tuple[Node, ...]:
    """Return the tables of a file as nodes of its tree."""
    nodes = []
    for table in tables:
        if table.fallback:
            continue
        columns = tuple(Column(header.name, header.unit) for header in table.headers)
        beside = [f"{name} = {value:g}" for name, value in table.constants.items()]
        nodes.append(Node(table.label, columns, (*beside, *table.remarks)))
    return tuple(nodes)


def tree_lines(trees: Sequence[FileTree]) -> list[str]:
    """Return the trees as lines: files and tables that hold the same columns are one entry with a count."""
    alike: dict[tuple, list[tuple[str, Node]]] = defaultdict(list)
    lines: list[str] = []
    for tree in trees:
        for node in tree.nodes:
            alike[node.columns].append((tree.name, node))
    for columns, places in alike.items():
        names = [f"{file}: {node.path}" if node.path else file for file, node in places]
        shown = ", ".join(names[:_MOST_NAMES]) + (
            f" and {len(names) - _MOST_NAMES} more" if names[_MOST_NAMES:] else ""
        )
        lines.append(f"{shown}" if len(names) == 1 else f"{len(names)} tables with the same columns: {shown}")
        lines += [
            f"  {i}  {c.name or '(no name)'}{f' [{c.unit}]' if c.unit else ''}"
            for i, c in enumerate(columns[:_MOST_COLUMNS], 1)
        ]
        if columns[_MOST_COLUMNS:]:
            lines.append(f"  ... and {len(columns) - _MOST_COLUMNS} more columns")
        lines += [f"  beside them: {text[:100]}" for text in places[0][1].beside[:_MOST_REMARKS]]
    lines += [f"{tree.name}: {tree.problem}" for tree in trees if tree.problem]
    return lines


def problem_of(error: InputError) -> str:
    """Return the reason a file cannot be opened, in a line."""
    return f"{error.found} [{error.code}]"
