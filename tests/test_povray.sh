#!/usr/bin/env bash
# Agreement with POV-Ray on matte scenes, one sample at the pixel's centre: at most 0.5 % of the pixels differ by more than 3
# levels, and these only at edges. ../shared/oracle turns a scene into a POV-Ray file; without it nothing is compared.
cd "$(dirname "$0")/.." && . tests/support/shell.sh
oracle=../shared/oracle
for needed in "$oracle/gr2pov.lua" "$(command -v povray)" "$(command -v lua5.4)"; do
    [ -e "$needed" ] || { skip "agreement with POV-Ray" "needs $oracle, povray and lua5.4"; exit 0; }
done
root=$PWD size=512

# agrees SCENE NAME: the scene's folder is the working directory of both, for its meshes; plain Lua is told where else
# the scenes' modules are.
agrees() {
    local folder file ours=$root/$TMP/$2-ours.png theirs=$root/$TMP/$2-povray
    folder=$(dirname "$1") file=$(basename "$1")
    (cd "$folder" && LUA_PATH="?.lua;../final/?.lua;;" lua5.4 "$root/$oracle/gr2pov.lua" "$file" "$theirs.pov" matte $size $size) || return
    povray -D +WT2 "+I$theirs.pov" "+O$theirs.png" +W$size +H$size -A File_Gamma=1.0 >"$theirs.log" 2>&1 || { tail -n 1 "$theirs.log"; return 1; }
    (cd "$folder" && "$(realpath "$root/$RT")" -q -I . -o "$ours" -s 1 --size ${size}x$size "$root/$oracle/matte.lua" -- "$file") || return
    "$RT" compare --tolerance 3 --max-share 0.5 --edges 2 "$ours" "$theirs.png"
}
for scene in Assets/{csg/csg_simple,csg/csg_complex,umbrella/umbrella,primitives/primitives}.lua \
    tests/golden/{prim_sphere,prim_cube,prim_cylinder,prim_cone,prim_torus,prim_torus_spindle,mesh_flat,mesh_table}.lua \
    tests/golden/{csg_union,csg_diff,csg_intersect,csg_nested,csg_mesh,hierarchy,camera}.lua; do
    check "povray $(basename "$scene" .lua)" agrees "$scene" "$(basename "$scene" .lua)"
done
finish
