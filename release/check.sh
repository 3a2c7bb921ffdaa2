#!/usr/bin/env bash
# All that must hold before a release: make release-check. Results in dist/: sdist, wheel, SBOM, SHA256SUMS.
set -euo pipefail
cd "$(dirname "$0")/.."
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH PIP_CONSTRAINT=constraints.txt PIP_DISABLE_PIP_VERSION_CHECK=1
bin=.venv-release/bin
table=$(mktemp)
trap 'rm -f "$table"*; rm -rf .venv-locked' EXIT
started=$SECONDS
row() {  # CHECK RESULT: one line of the table, with the seconds since the last one
  printf '%-34s %6d s  %s\n' "$1" $((SECONDS - started)) "$2" | tee -a "$table"
  started=$SECONDS
}

[ -x $bin/python ] || python3 -m venv .venv-release
$bin/python -m pip install --quiet uv
uv=$PWD/$bin/uv
$uv pip install --quiet --python .venv-release -c constraints.txt --group release
row "tools" "installed"

$bin/repo-review --format json . >"$table.review" || true
$bin/python release/review.py "$table.review"
row "scientific Python repo-review" "no failure but those release/review.py explains"
$bin/zizmor --quiet --offline .github
row "workflows (zizmor)" "no finding"

rm -rf dist build
for turn in first second; do
  $bin/python -m build --quiet --installer uv --outdir "dist/$turn" .
done
diff <(cd dist/first && sha256sum ./*) <(cd dist/second && sha256sum ./*) || { echo "two builds differ" >&2; exit 1; }
mv dist/first/* dist/ && rm -r dist/first dist/second
$bin/python -m zipfile --list dist/*.whl >"$table.wheel"  # a file, as grep -q would close a pipe early
grep -q 'mrdamper/py.typed' "$table.wheel" || { echo "py.typed is missing" >&2; exit 1; }
row "wheel and sdist, built twice" "the same bytes"
$bin/twine check --strict dist/*.whl dist/*.tar.gz >/dev/null
row "twine check" "passed"

unset PIP_CONSTRAINT
bash release/bare.sh dist/*.whl
row "bare wheel" "installs, imports, studies, predicts, exports"

# The lock: installs by hash, and holds what pyproject.toml asks for.
rm -rf .venv-locked && $uv venv --quiet --python python3 .venv-locked
$uv pip install --quiet --python .venv-locked --require-hashes --only-binary :all: -r release/lock.txt
$uv pip install --quiet --python .venv-locked --no-deps dist/*.whl
$uv pip check --quiet --python .venv-locked
! grep -nE 'https?:|--index|--find-links' release/lock.txt constraints.txt || { echo "a lock names a host" >&2; exit 1; }
row "lock" "installs, hash by hash"

# What is inside, for those who have to know.
$bin/cyclonedx-py environment .venv-locked --output-reproducible --pyproject pyproject.toml \
  --mc-type library --output-format JSON --output-file dist/mrdamper.cdx.json
row "SBOM" "$($bin/python -c 'import json; print(len(json.load(open("dist/mrdamper.cdx.json"))["components"]))') components"

bash release/lowest.sh $uv dist/*.whl
row "lowest versions" "tests pass"

(cd dist && sha256sum ./*.whl ./*.tar.gz ./*.json > SHA256SUMS)
echo && cat "$table" dist/SHA256SUMS
