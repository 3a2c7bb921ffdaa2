"""`mrdamper explain`: meaning, example and remedy of an error or warning code."""

from __future__ import annotations

import tomllib
from difflib import get_close_matches
from importlib.resources import files

import typer

from mrdamper.errors import UnknownNameError

app = typer.Typer()


@app.command(epilog="Example: mrdamper explain E_LIMITS")
def explain(
    code: str | None = typer.Argument(None, help="Code in the brackets of a message; omit it to list all codes."),
) -> None:
    """Explain an error or warning code, such as E_LIMITS or W_CLIPPED."""
    codes = load_codes()
    if code is None:
        width = max(map(len, codes))
        print("\n".join(f"{name:{width}}  {entry['meaning']}" for name, entry in codes.items()))
        return
    name = code.strip().strip("[]").upper()
    if name not in codes:
        near = " or ".join(get_close_matches(name, codes, n=3, cutoff=0.5))
        remedy = f"did you mean {near}?" if near else "mrdamper explain lists all codes"
        raise UnknownNameError(f"no code is called {name!r}", remedy=remedy)
    entry = codes[name]
    print(f"{name}\n\n{entry['meaning']}\n\nExample: {entry['example']}\n\nWhat to do: {entry['remedy']}")


def load_codes() -> dict[str, dict[str, str]]:
    """Return meaning, example and remedy by code, errors (E_) first."""
    return tomllib.loads(files("mrdamper").joinpath("codes.toml").read_text(encoding="utf-8"))


def codes_page() -> str:
    """Return the page of all codes in Markdown."""
    parts = [
        "# Error and warning codes\n",
        "Every message ends with a code in brackets. `mrdamper explain E_LIMITS` prints one of the entries below. "
        "An error (E_) ends the command or excludes a file or run; a warning (W_) is reported with the result.\n",
    ]
    for title, prefix in (("Errors", "E_"), ("Warnings", "W_")):
        parts.append(f"## {title}\n")
        for name, entry in load_codes().items():
            if name.startswith(prefix):
                parts.append(f"### {name}\n\n{entry['meaning']}\n")
                parts.append(f"Example: `` {entry['example']} ``\n\nWhat to do: {entry['remedy']}\n")
    return "\n".join(parts)
