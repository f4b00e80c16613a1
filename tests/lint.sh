#!/usr/bin/env bash
# The rules of the code that a machine can check. Prints what breaks one, then "ok RULE" or "not ok RULE: how often".
cd "$(dirname "$0")/.." && . tests/support/shell.sh
mapfile -t program < <(ls Main.c scene_lua.c scene_lua.h 2>/dev/null; find src -name '*.[ch]' | sort)
mapfile -t all < <(printf '%s\n' "${program[@]}"; find tests -name '*.[ch]' | sort)
# The code without its comments, each line with its place in front: src/render.c:17:...
code() {
    awk 'FNR == 1 { comment = 0 }
    {
        line = $0; out = ""
        while (length(line)) {
            if (comment) {
                end = index(line, "*/")
                if (!end) break
                line = substr(line, end + 2); comment = 0
            } else {
                start = index(line, "/*")
                if (!start) { out = out line; break }
                out = out substr(line, 1, start - 1); line = substr(line, start + 2); comment = 1
            }
        }
        if (out ~ /[^ ]/) print FILENAME ":" FNR ":" out
    }' "$@"
}
# rule NAME: passes if standard input is empty, and shows it otherwise.
rule() {
    local found
    found=$(cat)
    if [ -z "$found" ]; then ok "$1"; else echo "$found"; not_ok "$1" "$(wc -l <<<"$found") places"; fi
}
# includes PATTERN_OF_FILES: the includes of these files, as FILE:LINE:#include...
includes() { code "${program[@]}" | grep -E "^($1):[0-9]+:# *include"; }
# layer FOLDER ALLOWED: project headers that files of a folder may include.
layer() { includes "$1" | grep '"' | grep -vE "include \"($2)\"" | rule "$3"; }

includes '.*' | grep -E '"(lua|lauxlib|lualib)|<(lua|lauxlib|lualib)' | grep -v '^scene_lua.c:' |
    rule "only scene_lua.c includes lua.h"
includes '.*' | grep -E '<([a-z]*mmintrin|x86intrin|arm_neon)\.h>' | grep -vE '^src/accel/kernel_[a-z0-9_]*\.c:' |
    rule "only src/accel/kernel_*.c include intrinsics"
includes '.*' | grep -E 'lodepng|libdeflate' | grep -v '^src/tools/png.c:' |
    rule "only src/tools/png.c includes lodepng and libdeflate"
code "${program[@]}" | grep -v '^Main.c:' |
    grep -E '[^A-Za-z0-9_](printf|vprintf|puts|putchar|perror|psignal|exit|_exit|_Exit|quick_exit|abort|stdout|stderr)\b' |
    grep -vE '__attribute__' | rule "only Main.c prints or exits"

layer 'src/common/.*' 'common/[^"]*' "src/common includes only itself"
layer 'src/tools/.*' '(common|tools)/[^"]*' "src/tools includes only common and itself"
layer 'src/compare/.*' '(common|tools|compare)/[^"]*' "src/compare includes only common, tools and itself"
layer 'src/node/.*' '(common|tools|node)/[^"]*' "src/node includes only common, tools and itself"
layer 'src/accel/.*' '(common|tools|node|accel)/[^"]*|scene/world\.h' "src/accel includes nothing above it but world.h"
layer 'src/scene/.*' '(common|tools|node|scene)/[^"]*|accel/(accel|bvh|mesh_prim)\.h' \
    "src/scene includes neither render nor what is private to accel"
layer 'src/render/.*|src/render\..*' '(common|tools|node|scene|render)/[^"]*|render\.h|accel/accel\.h' \
    "src/render includes nothing private to accel"
layer 'scene_lua\..*' '(common|tools|node)/[^"]*|scene/job\.h|scene_lua\.h' "scene_lua includes only the scene tree"

code "${program[@]}" | grep -E ':(static|_Thread_local) ' | grep -vE '\bconst\b|\(|inline|_Static_assert|static struct [A-Za-z]+;' |
    rule "no mutable statics"
code "${program[@]}" | grep -E '[^A-Za-z0-9_.](rand|srand|strtok|gets|strcpy|strcat|sprintf|alloca|asctime|ctime|localtime|gmtime)\(' |
    rule "no unsafe functions"
grep -nE '\b(TO''DO|FIX''ME|XX''X|HA''CK)\b' "${all[@]}" Makefile premake4.lua | rule "no unfinished marks"
grep -nP '\t' "${all[@]}" | rule "no tabs"
grep -nE ' +$' "${all[@]}" | rule "no trailing blanks"
# About 120 columns is the style; the messages that tests expect may be longer.
{ grep -nE '^.{125,}' "${program[@]}"; find tests -name '*.[ch]' | xargs grep -nE '^.{133,}'; } | rule "no line over 124 columns, 132 in tests"
code "${all[@]}" | sed 's|"[^"]*"||g' | grep '//' | rule "comments are /* */"
for file in "${all[@]}"; do [ -z "$(tail -c 1 "$file")" ] || echo "$file"; done | rule "every file ends with a newline"

# src/node/csg/csg.h: RT_NODE_CSG_CSG_H
for file in $(printf '%s\n' "${all[@]}" | grep '\.h$'); do
    path=${file#src/}
    guard="RT_(TESTS_)?$(tr 'a-z/.' 'A-Z__' <<<"${path#tests/}")"
    [ "$(grep -cxE "#(ifndef|define) $guard" "$file")" = 2 ] || echo "$file: no guard $guard"
done | rule "header guards are RT_PATH_H"
for file in "${all[@]}"; do
    own=${file#src/}
    own=${own#tests/}
    own=$(dirname "$own")/
    head -n 1 "$file" | grep -qE "^(/\*|#include \"${own#./}[a-z_]*\.h\")" || echo "$file:1: $(head -n 1 "$file")"
done | rule "every file begins with its purpose, or with a header of its folder that has it"

flags=(-std=c11 -D_GNU_SOURCE -Isrc -I. -Itests $(pkg-config --cflags lua5.4))
sources=($(printf '%s\n' "${program[@]}" | grep '\.c$'))
if command -v clang-tidy >/dev/null; then
    printf '%s\n' "${sources[@]}" | xargs -P 2 -n 4 sh -c 'f=$1; shift; clang-tidy --quiet "$@" -- $f 2>/dev/null' sh "${flags[*]}" |
        grep -E '(warning|error):' | sort -u |
        rule "clang-tidy"
else
    skip clang-tidy "not installed"
fi
if command -v cppcheck >/dev/null; then
    # Lua's errors don't return, which cppcheck can't know; &v.x is indexed as an array on purpose.
    cppcheck -q -j 2 --std=c11 --enable=warning,performance,portability --suppress=missingIncludeSystem \
        --suppress=nullPointerRedundantCheck --suppress=memleak --suppress=objectIndex \
        -D_GNU_SOURCE -Isrc -I. "${sources[@]}" 2>&1 | rule cppcheck
else
    skip cppcheck "not installed"
fi
finish
