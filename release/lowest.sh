#!/usr/bin/env bash
# The oldest versions pyproject.toml admits, as release/lowest.txt lists them, serve: lowest.sh UV [WHEEL]
set -euo pipefail
uv=$1 package=$(realpath "${2:-.}")
cd "$(dirname "$0")/.."
rm -rf .venv-lowest && "$uv" venv --quiet --python python3 .venv-lowest
"$uv" pip install --quiet --python .venv-lowest -r release/lowest.txt
"$uv" pip install --quiet --python .venv-lowest --no-deps "$package"
.venv-lowest/bin/python -m pytest -m "not slow" -n auto -W ignore \
  tests/{data,files,functions,hysteresis,identification,models,motion,dampers,export,cli}
rm -rf .venv-lowest
