#!/bin/sh
# write_texts.sh FOLDER TRESTLE...: what the program says of itself, as files: pages of the manual, completion, the schema.
set -e
folder=$1
shift
rm -rf "$folder"
mkdir -p "$folder"
"$@" man --output "$folder/man"
"$@" completion bash >"$folder/trestle"
"$@" completion zsh >"$folder/_trestle"
"$@" completion fish >"$folder/trestle.fish"
"$@" schema >"$folder/trestle.schema.json"
