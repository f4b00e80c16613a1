#!/usr/bin/env bash
# Wall seconds of whole runs (script to PNG): each scene of Assets at 512 x 512 with 9 samples, the best of three.
# tests/bench/run.sh [SCENE...]
cd "$(dirname "$0")/../.." || exit 1
RT=${RT:-./rt}
out=build/bench
mkdir -p $out
scenes=("$@")
[ $# -gt 0 ] || mapfile -t scenes < <(find Assets -name '*.lua' | sort | xargs grep -lE 'gr\.render|:render')

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
