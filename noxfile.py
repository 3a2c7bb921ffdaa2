#!/usr/bin/env -S uv run --script

# /// script
# dependencies = ["nox>=2025.10.14"]
# ///

"""Tests on other Python versions and the checks of `make lint`, each in an environment of its own."""

import nox

nox.needs_version = ">=2025.10.14"
nox.options.default_venv_backend = "uv|virtualenv"
DEVELOPMENT = nox.project.dependency_groups(nox.project.load_toml("pyproject.toml"), "dev")


@nox.session(python=["3.11", "3.12", "3.13", "3.14"])
def tests(session: nox.Session) -> None:
    """Run the fast tests."""
    session.install("-c", "constraints.txt", "-e", ".[all,fleet,fmu,compiler]", *DEVELOPMENT)
    session.run("pytest", "-m", "not slow", "-n", "auto", *session.posargs)


@nox.session(python="3.13")
def newest(session: nox.Session) -> None:
    """Run the fast tests with the newest release of every dependency, which is what users install."""
    session.install("-e", ".[all,fleet,fmu,compiler]", *DEVELOPMENT)
    session.run("pytest", "-m", "not slow", "-n", "auto", *session.posargs)


@nox.session(python="3.11")
def lint(session: nox.Session) -> None:
    """Check format, style, types and the order of imports."""
    session.install("-c", "constraints.txt", "-e", ".[all,fleet,fmu,compiler]", *DEVELOPMENT)
    session.run("ruff", "format", "--check", ".")
    session.run("ruff", "check", ".")
    session.run("pyright")
    session.run("lint-imports")


if __name__ == "__main__":
    nox.main()
