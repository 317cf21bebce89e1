#!/usr/bin/env bash
# Makes a virtual environment with the S3 server of the tests in a folder. Its installation is slow, and is done beside
# the other tests, from a copy: a build writes into its source.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$1
mkdir -p "$folder/source"
git ls-files -z | tar --null --files-from=- -cf - | tar -xf - -C "$folder/source"
python3 -m venv "$folder/venv"
# One after the other: pip tries fewer versions.
"$folder/venv/bin/pip" install --quiet "$folder/source[test]"
"$folder/venv/bin/pip" install --quiet "$folder/source[s3test]"
