#!/usr/bin/env bash
# Golden pictures: each scene of tests/golden against the picture beside it. A pixel that is off by one level passes, by more
# fails. A scene's first line may give options: "-- rt: --legacy". `tests/test_golden.sh --accept NAME...` takes what the
# program draws now as the picture to expect: look at it first.
cd "$(dirname "$0")/.." && . tests/support/shell.sh
options() { sed -n '1s/^-- rt: //p' "$1"; }

if [ "$1" = --accept ]; then
    shift
    for name in "$@"; do "$RT" -q $(options "tests/golden/$name.lua") -o "tests/golden/$name.png" "tests/golden/$name.lua" || failures=1; done
    finish
fi
compare() {
    "$RT" -q $(options "$1") -o "$TMP/$2.png" "$1" && "$RT" compare --tolerance 1 "${1%.lua}.png" "$TMP/$2.png"
}
for scene in tests/golden/*.lua; do
    name=$(basename "$scene" .lua)
    check "golden $name" compare "$scene" "$name"
done
finish
