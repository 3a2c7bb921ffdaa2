"""Names that mean something where they are written: C, XML, LaTeX, Markdown, CSV, file names, a terminal."""

from __future__ import annotations

import csv
import io
import random
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from xml.etree import ElementTree

from fuzz.counting import NASTY, Count, names, within

_WRITTEN_IN_LATEX = re.compile(  # marks that are escaped, and the signs and Greek letters that are set as formulas
    r"\\(text[a-z]+\{\}|[&%$#_{}])|\$(-|\\(le|ge|in|surd|alpha|beta|gamma|delta|eta|phi|zeta|omega))\$"
)


def attack_names(share: float) -> list[Count]:
    """Names where they are written: C is compiled, XML and HTML parsed, Markdown rendered, CSV read again."""
    from html.parser import HTMLParser

    from markdown_it import MarkdownIt

    from mrdamper.data import encoding
    from mrdamper.errors import InputError

    counts = {kind: Count(kind) for kind in ("name in C", "name in XML and HTML", "name in LaTeX", "name in Markdown")}
    counts |= {kind: Count(kind) for kind in ("name in CSV", "name in a file name", "name in a terminal")}
    rng, comments = random.Random(1), []
    markup = MarkdownIt("commonmark").enable("table")
    folder = Path(tempfile.mkdtemp())
    for name in within(names(max(len(NASTY), int(10_000 * share)), rng)):
        comments.append(
            f'/* {encoding.c_comment(name)}.\n * Made from a model of rig "{encoding.c_comment(name)}". */\n'
        )
        text = f'<a b="{encoding.xml(name)}">{encoding.xml(name)}</a>'
        seen: list[str] = []
        parser = HTMLParser()
        parser.handle_starttag = lambda tag, attrs, seen=seen: seen.append(tag)  # type: ignore[method-assign]
        parser.feed(text)
        try:
            element = ElementTree.fromstring(text)
            counts["name in XML and HTML"].check(not len(element) and seen == ["a"], name)
        except ElementTree.ParseError:
            counts["name in XML and HTML"].check(False, name)
        rest = _WRITTEN_IN_LATEX.sub("", encoding.latex(name))
        counts["name in LaTeX"].check(not re.search(r"[\\&%$#_{}^~\n]", rest), name)
        kinds = {child.type for child in markup.parseInline(encoding.markdown(name))[0].children or ()}
        counts["name in Markdown"].check(kinds <= {"text", "text_special"}, name)
        rows = list(csv.reader(io.StringIO(encoding.csv_text([{"a": name, "b": "end"}]), newline="")))
        cell = rows[1][0]
        held = len(rows) == 2 and rows[1][1] == "end" and encoding.csv_value(cell) == name
        counts["name in CSV"].check(held and (not re.match(r"[=@\t\r]", cell)), name)
        made = encoding.file_names([name])[name]
        try:
            (folder / f"model-{made}.json").write_bytes(b"")
            counts["name in a file name"].check((folder / f"model-{made}.json").is_file(), name)
        except (OSError, ValueError):
            counts["name in a file name"].check(False, name)
        line = str(InputError(name, where=name, remedy=name))
        counts["name in a terminal"].check(
            len(line.splitlines()) == 1 and not re.search(r"[\x00-\x1f\x7f-\x9f]", line), name
        )
    shutil.rmtree(folder)
    _compile(counts["name in C"], comments)
    return list(counts.values())


def _compile(count: Count, comments: list[str]) -> None:
    """All comments in one source, between functions: each function has to be seen, and nothing else."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        print("no C compiler: names in C are not compiled", file=sys.stderr)
        return
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "names.c"
        source.write_text(
            "".join(f"{text}int f{i}(void);\nint f{i}(void) {{ return {i}; }}\n" for i, text in enumerate(comments))
        )
        command = [
            compiler,
            "-std=c99",
            "-trigraphs",
            "-Wall",
            "-Wcomment",
            "-Werror",
            "-c",
            source.name,
            "-o",
            "names.o",
        ]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        listed = subprocess.run(["nm", "names.o"], cwd=folder, capture_output=True, text=True, check=False).stdout
        found = set(re.findall(r" T (\w+)", listed))
    for i, text in enumerate(comments):
        count.check(done.returncode == 0 and f"f{i}" in found, text)
    count.check(found == {f"f{i}" for i in range(len(comments))}, found - {f"f{i}" for i in range(len(comments))})
