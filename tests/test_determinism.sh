#!/usr/bin/env bash
# The number of threads, the processor's instructions and the build type change no byte of a picture: every scene of Assets, small.
cd "$(dirname "$0")/.." && . tests/support/shell.sh
# draws PROGRAM THREADS SCENE [OPTION...]: the sum of all pictures that the scene writes, its own file names below the test's folder.
draws() {
    local folder=$TMP/out
    rm -rf "$folder" && mkdir -p "$folder"
    "$1" -q -t "$2" --size 128x128 -o "$folder/picture.png" "${@:4}" "$3" >/dev/null || return
    [ -e "$folder/picture.png" ] && cat "$folder"/*.png | sha256sum
}
same() {
    local first other
    first=$(draws "$RT" 1 "$1") || { echo "it doesn't render"; return 1; }
    for threads in 2 7 16; do
        other=$(draws "$RT" $threads "$1") || { echo "it doesn't render with -t $threads"; return 1; }
        [ "$first" = "$other" ] || { echo "-t $threads isn't -t 1"; return 1; }
    done
    for cpu in scalar sse2 avx2 avx512; do
        other=$(draws "$RT" 2 "$1" --cpu $cpu) || { echo "it doesn't render with --cpu $cpu"; return 1; }
        [ "$first" = "$other" ] || { echo "--cpu $cpu isn't the widest"; return 1; }
    done
    other=$(draws build/debug/rt 2 "$1") || { echo "BUILD=debug doesn't render it"; return 1; }
    [ "$first" = "$other" ] || { echo "BUILD=debug isn't BUILD=release"; return 1; }
    first=$(draws "$RT" 1 "$1" --error 0.02) || { echo "it doesn't render to an error"; return 1; }
    other=$(draws "$RT" 7 "$1" --error 0.02) || { echo "it doesn't render to an error with -t 7"; return 1; }
    [ "$first" = "$other" ] || { echo "with --error -t 7 isn't -t 1"; return 1; }
}
# A scene has the picture that it gives beside it.
scenes=$(for scene in Assets/*/*.lua; do [ ! -e "${scene%.lua}.png" ] || echo "$scene"; done)
[ -n "$scenes" ] || not_ok "scenes" "Assets has none with its picture beside it"
for scene in $scenes; do check "$scene" same "$scene"; done
finish
