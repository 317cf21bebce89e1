#!/usr/bin/env bash
# Builds the source distribution, the wheel from it, and checks both: .ci/build_release.sh FOLDER
# What is built from the source distribution needs neither git nor the files that are not in it.
set -euo pipefail
target=$(realpath -m "${1:?give the folder for the files}")
cd "$(dirname "$0")/.."
tools=$(mktemp -d)
trap 'rm -rf "$tools"' EXIT
"${PYTHON:-python3}" -m venv "$tools"
"$tools/bin/pip" install --quiet 'build>=1.2' 'twine>=6.1' 'check-wheel-contents>=0.6.1'
"$tools/bin/python" -m build --outdir "$target" .
"$tools/bin/twine" check --strict "$target"/cdtool-*
"$tools/bin/check-wheel-contents" "$target"/cdtool-*.whl
ls -l "$target"
