#!/usr/bin/env bash
# Builds the wheel, installs it alone with the lower bound of each dependency on Python 3.11, and runs --help and every
# command of the README. Skipped, by name, where there is no Python 3.11.
set -euo pipefail
cd "$(dirname "$0")/.."
python=$(command -v python3.11 || true)
if [ -z "$python" ] || ! "$python" --version > /dev/null 2>&1; then
  echo "no Python 3.11: the lower bounds of the dependencies are not tried"
  exit 0
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
# Built from a copy: a build writes into its source, and the tests run beside it.
mkdir "$folder/source"
git ls-files -z | tar --null --files-from=- -cf - | tar -xf - -C "$folder/source"
"$python" -m venv "$folder/venv"
mapfile -t pins < <("$python" .ci/lowest_versions.py)
"$folder/venv/bin/pip" wheel --quiet --no-deps --wheel-dir "$folder" "$folder/source"
rm -r "$folder/source"
echo "+ pip install ${pins[*]} cdtool-*.whl"
"$folder/venv/bin/pip" install --quiet "${pins[@]}" "$folder"/cdtool-*.whl
cdtool="$folder/venv/bin/cdtool"
readme_commands=$PWD/.ci/readme_commands.py
cd "$folder" # the installed package is run, not this folder's
"$cdtool" --version
"$cdtool" --help > help.txt
"$cdtool" benchmark --help >> help.txt
"$python" "$readme_commands" "$folder/venv"
