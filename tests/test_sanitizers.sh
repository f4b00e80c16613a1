#!/usr/bin/env bash
# Whole renders under the sanitizers and under valgrind: nothing of theirs may be reported.
cd "$(dirname "$0")/.." && . tests/support/shell.sh
export TSAN_OPTIONS=halt_on_error=1
# Thread sanitizer needs the address space laid out as it expects.
tsan() { setarch "$(uname -m)" -R build/tsan/rt -q -t 4 -s 2 --size 64x64 -o "$TMP/tsan.png" "$1"; }
asan() { build/asan/rt -q -t 2 $(sed -n '1s/^-- rt: //p' "$1") -s 1 --size 40x40 -o "$TMP/asan.png" "$1"; }
memcheck() {
    valgrind -q --error-exitcode=9 --leak-check=full --errors-for-leak-kinds=definite,indirect,possible \
        "$RT" -q -t 2 -s 1 --size 32x32 -o "$TMP/valgrind.png" "$1"
}
for scene in csg_nested texture_mesh mirrors; do check "tsan $scene" tsan tests/golden/$scene.lua; done
for scene in tests/golden/*.lua; do
    grep -q -e '^-- rt: .*--crop' "$scene" || check "asan $(basename "$scene" .lua)" asan "$scene"
done
check "valgrind csg_mesh" memcheck tests/golden/csg_mesh.lua
finish
