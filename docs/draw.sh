#!/usr/bin/env bash
# Draws docs/architecture.svg from docs/architecture.dot. The drawing carries the checksum of what it was drawn from, by which
# test/docs_test.py sees whether it is up to date: other versions of graphviz place things a little differently.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")"
sum=$(sha256sum <architecture.dot | cut -d ' ' -f 1)
dot -Tsvg architecture.dot | sed "2i <!-- Drawn by ./run drawing from docs/architecture.dot, whose SHA-256 is $sum -->" >architecture.svg.new
mv architecture.svg.new architecture.svg
