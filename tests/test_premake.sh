#!/usr/bin/env bash
# The program that premake4.lua builds draws the same picture, byte for byte.
cd "$(dirname "$0")/.." && . tests/support/shell.sh
scene=tests/golden/csg_nested.lua
rm -rf build/premake
check "premake writes makefiles" premake4 gmake
check "they build a program" make -C build/premake config=release
check "the makefile's program renders" "$RT" -q -o "$TMP/make.png" $scene
check "premake's program renders" build/premake/rt -q -o "$TMP/premake.png" $scene
check "both pictures are the same" cmp "$TMP/make.png" "$TMP/premake.png"
finish
