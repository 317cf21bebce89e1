#!/usr/bin/env bash
# Installs the wheel in FOLDER alone, in a fresh environment, and runs the main job: .ci/try_wheel.sh FOLDER
# The interpreter is that of $PYTHON (python3).
set -euo pipefail
wheel=$(realpath "${1:?give the folder with the wheel}"/cdtool-*.whl)
cd "$(dirname "$0")/.."
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cp -r sample_logs "$folder"
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet "$wheel"
"$folder/venv/bin/pip" uninstall --quiet --yes pip setuptools
du -sm "$folder/venv/lib"
cd "$folder" # the installed package is run, not this folder's
venv/bin/cdtool --version
venv/bin/cdtool benchmark sample_logs/gate/benchmark.toml -o report/ > benchmark.txt
tail -n 2 benchmark.txt
test -s report/report.html
