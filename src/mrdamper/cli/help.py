"""Help texts: commands grouped by use, one line each; options grouped by purpose."""

from __future__ import annotations

from typing import Any

from typer import BadParameter
from typer.core import TyperCommand, TyperGroup

_GROUPS = {
    "Data": ("import", "check", "split", "init"),
    "Identify": ("study", "identify", "compare", "uncertainty", "validate", "plan"),
    "Use": ("predict", "simulate", "serve"),
    "Export": ("export", "report"),
}
_OTHERS = "More"
_OUTPUT = frozenset({"out", "png", "pdf", "as_json", "quiet", "verbose", "figure", "paper"})


class CommandGroups(TyperGroup):
    """The commands under one heading each, in the order in which they are used."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write one uncut line per command; commands without a group follow at the end."""
        names = set(self.list_commands(ctx))
        groups = {title: [name for name in members if name in names] for title, members in _GROUPS.items()}
        groups[_OTHERS] = sorted(names - {name for members in groups.values() for name in members})
        width = max(map(len, names))
        for title, members in groups.items():
            if members:
                with formatter.section(title):
                    for name in members:
                        command = self.get_command(ctx, name)
                        line = (command.help or "").strip().splitlines()[0] if command else ""
                        formatter.write(f"{'':{formatter.current_indent}}{name:{width}}  {line}\n")


class OptionGroups(TyperCommand):
    """A command whose options stand under "Required", "Options" (or a panel of their own) and "Output"."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments; the message of a text that is no number states how one is written."""
        try:
            return super().parse_args(ctx, args)
        except BadParameter as error:
            if "valid number" in error.message or "valid float" in error.message:  # of versions of typer
                error.message = "no number; write it with a decimal point and without a unit: 0.5"
            raise

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write arguments, then the options group by group."""
        groups: dict[str, list[tuple[str, str]]] = {"Arguments": [], "Required": [], "Options": []}
        for parameter in self.get_params(ctx):
            if record := parameter.get_help_record(ctx):
                groups.setdefault(_group(parameter), []).append(record)
        groups["Output"] = [*groups.pop("Output", []), *groups.pop("Help", [])]
        for title, records in groups.items():
            if records:
                with formatter.section(title):
                    formatter.write_dl(records)


def _group(parameter: Any) -> str:
    if parameter.param_type_name == "argument":
        return "Arguments"
    if parameter.required:
        return "Required"
    if panel := getattr(parameter, "rich_help_panel", None):
        return panel
    if parameter.name == "help":
        return "Help"
    return "Output" if parameter.name in _OUTPUT else "Options"
