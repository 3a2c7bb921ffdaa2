"""Results of the project's own tests on one page: `python -m benchmarks.testing` runs each command and writes them.

`--only NAME` runs some of them again and keeps the results of the others.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from pathlib import Path
from tempfile import gettempdir

from mrdamper.data.atomic import write_file

PAGE = Path(__file__).parent.parent / "docs" / "explanation" / "how-we-test.md"
_LAST = 12  # lines of a command's output that the page shows, at most


def commands_of(page: str) -> dict[str, str]:
    """Commands of the page by the heading they stand under."""
    found = re.findall(r"^## (.+?)\n.*?```text\n\$ (.+?)\n", page, re.MULTILINE | re.DOTALL)
    return {heading.lower(): command for heading, command in found}


def with_output(page: str, command: str, output: str) -> str:
    """Replace the output that the page shows of a command by the last lines of another."""
    lines = [line.rstrip() for line in output.strip().splitlines() if gettempdir() not in line]
    kept = "\n".join(lines[-_LAST:])
    begin = page.index(f"$ {command}\n") + len(f"$ {command}\n")
    return page[:begin] + kept + page[page.index("\n```", begin - 1) :]


def main() -> None:
    """Run the commands and write the page; end with 1 if one of them fails."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.testing", description=__doc__)
    page = PAGE.read_text(encoding="utf-8")
    known = commands_of(page)
    parser.add_argument("--only", action="append", choices=list(known), help="a heading; may be repeated")
    failed = []
    for name in parser.parse_args().only or known:
        words = [sys.executable if word == "python" else word for word in known[name].split()]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        print(f"{known[name]}: exit status {done.returncode}", flush=True)
        failed += [name] if done.returncode else []
        page = with_output(page, known[name], done.stdout)
    with write_file(PAGE) as out:
        out.write_text(page, encoding="utf-8")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
