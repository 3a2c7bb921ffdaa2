#!/usr/bin/env bash
# Renew the lock (newest, with hashes, no hosts) and the list of lowest versions: bash release/update.sh
set -euo pipefail
cd "$(dirname "$0")/.."
uv=.venv-release/bin/uv
common=(--quiet --no-header --no-emit-index-url --python-version 3.11)
# Windows, macOS and Linux, and every Python that is admitted; the tested versions where constraints.txt names one.
$uv pip compile "${common[@]}" pyproject.toml --universal --generate-hashes --no-annotate -c constraints.txt \
  -o release/lock.txt
# Without fmu: FMPy asks for a newer NumPy than this package does.
$uv pip compile "${common[@]}" pyproject.toml --extra all --extra fleet --group dev --no-annotate --resolution lowest-direct \
  -o release/lowest.txt
