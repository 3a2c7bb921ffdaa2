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
