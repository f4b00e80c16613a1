#!/usr/bin/env bash
# Wall seconds of whole runs (script to PNG), the best of three: each scene of Assets that has its picture beside it, at
# 512 x 512 with 9 samples.
# tests/bench/run.sh [SCENE...]
cd "$(dirname "$0")/../.." || exit 1
RT=${RT:-./rt}
out=build/bench
mkdir -p $out
scenes=("$@")
[ $# -gt 0 ] || mapfile -t scenes < <(for scene in Assets/*/*.lua; do [ ! -e "${scene%.lua}.png" ] || echo "$scene"; done)

printf '%-44s %10s\n' "scene" "seconds"
for scene in "${scenes[@]}"; do
    best=
    for _ in 1 2 3; do
        begin=$EPOCHREALTIME
        "$RT" -q -o $out/picture.png --size 512x512 -s 9 "$scene" || { echo "$scene doesn't render" >&2; exit 1; }
        seconds=$(awk "BEGIN { printf \"%.2f\", $EPOCHREALTIME - $begin }")
        best=$(printf '%s\n' $best $seconds | sort -n | head -n 1)
    done
    printf '%-44s %10s\n' "$scene" "$best"
done
