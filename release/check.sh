#!/usr/bin/env bash
# All that must hold before a release: make release-check. Results in dist/: sdist, wheel, SBOM, SHA256SUMS.
set -euo pipefail
cd "$(dirname "$0")/.."
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH PIP_CONSTRAINT=constraints.txt PIP_DISABLE_PIP_VERSION_CHECK=1
bin=.venv-release/bin
[ -x $bin/python ] || python3 -m venv .venv-release
$bin/python -m pip install --quiet -e '.[release]'

rm -rf dist build
for turn in first second; do
  $bin/python -m build --quiet --outdir "dist/$turn" .
done
diff <(cd dist/first && sha256sum ./*) <(cd dist/second && sha256sum ./*) || { echo "two builds differ" >&2; exit 1; }
mv dist/first/* dist/ && rm -r dist/first dist/second
$bin/python -m zipfile --list dist/*.whl | grep -q 'mrdamper/py.typed' || { echo "py.typed is missing" >&2; exit 1; }
echo "wheel and sdist, built twice, have the same bytes"

unset PIP_CONSTRAINT
bash release/bare.sh dist/*.whl

# The lock: installs by hash, and holds what pyproject.toml asks for.
rm -rf .venv-locked && python3 -m venv .venv-locked
.venv-locked/bin/python -m pip install --quiet --require-hashes --only-binary :all: -r release/lock.txt
.venv-locked/bin/python -m pip install --quiet --no-deps dist/*.whl
.venv-locked/bin/python -m pip check
! grep -nE 'https?:|--index|--find-links' release/lock.txt constraints.txt || { echo "a lock names a host" >&2; exit 1; }
echo "the lock installs, hash by hash"

# What is inside, for those who have to know.
$bin/cyclonedx-py environment .venv-locked --output-reproducible --pyproject pyproject.toml \
  --mc-type library --output-format JSON --output-file dist/mrdamper.cdx.json
rm -rf .venv-locked
echo "SBOM: $($bin/python -c 'import json; print(len(json.load(open("dist/mrdamper.cdx.json"))["components"]))') components"

# The oldest versions pyproject.toml admits; `make test` runs with the newest.
rm -rf .venv-lowest && python3 -m venv .venv-lowest
.venv-lowest/bin/python -m pip install --quiet -r release/lowest.txt
.venv-lowest/bin/python -m pip install --quiet --no-deps dist/*.whl
.venv-lowest/bin/python -m pytest -m "not slow" -W ignore \
  tests/{data,files,functions,hysteresis,identification,models,motion,dampers,export,cli}
rm -rf .venv-lowest
echo "the oldest admitted versions serve"

(cd dist && sha256sum ./*.whl ./*.tar.gz ./*.json > SHA256SUMS && cat SHA256SUMS)
