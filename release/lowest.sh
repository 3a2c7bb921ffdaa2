#!/usr/bin/env bash
# The oldest versions pyproject.toml admits, as release/lowest.txt lists them, serve: lowest.sh [WHEEL]
set -euo pipefail
cd "$(dirname "$0")/.."
rm -rf .venv-lowest && python3 -m venv .venv-lowest
.venv-lowest/bin/python -m pip install --quiet --disable-pip-version-check -r release/lowest.txt
.venv-lowest/bin/python -m pip install --quiet --disable-pip-version-check --no-deps "${1:-.}"
.venv-lowest/bin/python -m pytest -m "not slow" -W ignore \
  tests/{data,files,functions,hysteresis,identification,models,motion,dampers,export,cli}
rm -rf .venv-lowest
