#!/usr/bin/env bash
# What a wheel must do in an environment of its own, without any extra: bare.sh WHEEL
set -euo pipefail
wheel=$(realpath "$1") constraints=$(realpath "$(dirname "$0")/../constraints.txt")
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
bin=$place/venv/bin
empty=$(du -sm "$place/venv" | cut -f1)
"$bin/python" -m pip install --quiet --disable-pip-version-check -c "$constraints" "$wheel"
"$bin/python" -m pip check >/dev/null
cd "$place"

size=$(($(du -sm "$place/venv" | cut -f1) - empty))
[ "$size" -le 560 ] || { echo "the base install takes $size MB, more than 560" >&2; exit 1; }

"$bin/python" -c 'import mrdamper; [getattr(mrdamper, n) for n in mrdamper.__all__]; mrdamper.load_dataset()'
"$bin/python" - <<'EOF'
import subprocess, sys
clock = "import time; t = time.perf_counter(); import mrdamper; print(time.perf_counter() - t)"
took = sorted(float(subprocess.check_output([sys.executable, "-c", clock])) for _ in range(5))[2]
assert took <= 0.1, f"import mrdamper takes {took:.3f} s"
EOF
"$bin/mrdamper" --help >/dev/null
"$bin/mrdamper" identify --run utf_5mm4Hz_1A >/dev/null
"$bin/mrdamper" study --out study >/dev/null 2>&1
model=study/model-utfsm.json
"$bin/mrdamper" predict $model --current 0.5 --frequency 2 --amplitude 10 --out force.csv
for format in c page latex markdown table adams tydex dyna4; do
  "$bin/mrdamper" export $model --to $format --out "$format" >/dev/null 2>&1
done
refused() {  # what needs an extra says which, in one line, and ends with 2
  local rc=0
  "$bin/mrdamper" "$@" >/dev/null 2>said || rc=$?
  [ $rc = 2 ] && grep -q 'pip install .mrdamper\[' said || { cat said >&2; echo "rc $rc: mrdamper $*" >&2; exit 1; }
}
refused serve
echo "a bare wheel installs in $size MB, imports, studies, predicts and exports; what needs an extra says which"
