#!/usr/bin/env bash
# Error against seconds of whole runs, script to picture: every scene of Assets that has its picture beside it, rt with a
# fixed number of samples and with error goals, and POV-Ray 3.7 by both its methods where it can express the scene.
#   tests/bench/error_time.sh [SCENE...]     REPEAT=3 SIZE=256 SAMPLES=512 (of each half of rt's reference)
# A table to standard output, build/error-time.csv, build/error-time.svg and, for one scene, build/error-time-rods.svg.
#
# The error is RMSE in linear light against what the same program gives with many samples: for rt by the plain random
# samples of tests/bench/reference, for POV-Ray by its pictures 3 and 4 times as large, at 16 samples a pixel of each. Both
# references have two independent halves, so that their noise cancels. They are kept under build/error-time until the scene
# changes. rt's audit is on, its time counts. POV-Ray runs without jitter (-J), which is better on most of these scenes.
cd "$(dirname "$0")/../.." || exit 1
repeat=${REPEAT:-3} size=${SIZE:-256} samples=${SAMPLES:-512} out=build/error-time csv=build/error-time.csv
reference=build/release/tests/bench/reference
. tests/bench/runs.sh
scenes=("$@")
[ $# -gt 0 ] || for scene in Assets/*/*.lua; do [ ! -e "${scene%.lua}.png" ] || scenes+=("$scene"); done
fixed=(1 4 9 25 64 144 324)
goals=(1 0.6 0.36 0.22)    # of the error that 9 samples give
povray_options=("-A" "+AM1 +A0.3 +R3" "+AM1 +A0.1 +R3" "+AM1 +A0.0 +R2" "+AM1 +A0.0 +R3" "+AM1 +A0.0 +R5" "+AM1 +A0.0 +R9"
    "+AM2 +A0.3 +R3" "+AM2 +A0.1 +R3" "+AM2 +A0.03 +R4" "+AM2 +A0.0 +R2" "+AM2 +A0.0 +R3" "+AM2 +A0.0 +R4")

die() { echo "$1" >&2; exit 1; }

# make_reference SCENE NAME: sets truth. A picture of one sample a pixel tells whether the scene is still the same.
make_reference() {
    "$rt" -q -s 1 --no-audit --size ${size}x$size -o $out/centre.pfm "$1" || die "$1 doesn't render"
    local state
    state=$(cksum <$out/centre.pfm)
    truth=$out/${2//\//-}-$size-$samples-${state%% *}
    [ -e $truth-2.pfm ] && return
    rm -f "$out/${2//\//-}-$size-$samples"-*.pfm
    $reference make "$1" ${size}x$size $samples $truth || die "$1 has no reference"
}

# make_povray_reference NAME: of $out/scene.pov; sets truth.
make_povray_reference() {
    local state factor half=1
    state=$(cksum <$out/scene.pov)
    truth=$out/${1//\//-}-$size-povray-${state%% *}
    [ -e $truth-2.pfm ] && return
    rm -f "$out/${1//\//-}-$size-povray"-*.pfm
    for factor in 3 4; do
        run_povray $out/scene.pov $((factor * size)) $threads +FN16 +AM1 +A0.0 +R4 -J >$out/log 2>&1 &&
            $reference shrink $out/povray.png $factor $truth-$half.pfm || die "POV-Ray's $1 has no reference"
        half=$((half + 1))
    done
}

# measure SCENE PROGRAM SETTING PICTURE COMMAND...: the median time of several runs, the error of the last.
measure() {
    local scene=$1 program=$2 setting=$3 picture=$4 walls=() cpus=() i error error_of_it
    shift 4
    for ((i = 0; i < repeat; i++)); do
        timed "$@" || die "$program fails on $scene with $setting"
        walls+=($wall) cpus+=($cpu)
    done
    read -r error error_of_it < <($reference judge $picture $truth)
    [ -n "$error_of_it" ] || die "$scene: no judgement of $program with $setting"
    echo "$scene,$program,$setting,$(median "${walls[@]}"),$(median "${cpus[@]}"),$error,$error_of_it" >>$csv
}

rt_curves() {
    local count goal at_9 share
    make_reference "$1" "$2"
    for count in "${fixed[@]}"; do
        measure "$2" fixed "$count" $out/picture.pfm "$rt" -q --size ${size}x$size -s $count -o $out/picture.pfm "$1"
    done
    at_9=$(awk -F, -v name="$2" '$1 == name && $2 == "fixed" && $3 == 9 { print $6 }' $csv)
    for share in "${goals[@]}"; do
        goal=$(awk "BEGIN { printf \"%.2g\", $share * $at_9 }")
        measure "$2" adaptive "$goal" $out/picture.pfm "$rt" -q --size ${size}x$size --error $goal -o $out/picture.pfm "$1"
    done
}

povray_curves() {
    local options program
    agreement "$1" $size
    [ "$agreement" = agrees ] || return
    make_povray_reference "$2"
    for options in "${povray_options[@]}"; do
        case $options in *AM2*) program=povray-2 ;; *) program=povray-1 ;; esac
        measure "$2" $program "$options" $out/povray.png run_povray $out/scene.pov $size $threads +FN16 -J $options
    done
}

echo "scene,program,setting,wall_s,cpu_s,rmse,rmse_error" >$csv
for scene in "${scenes[@]}"; do
    name=$(basename "$(dirname "$scene")")/$(basename "$scene" .lua)
    echo "$name" >&2
    rt_curves "$scene" "$name"
    povray_curves "$scene" "$name"
done
awk -f tests/bench/error_time.awk $csv
echo "The runs are $csv"
gnuplot tests/bench/error_time.gnuplot && echo "The plots are build/error-time.svg and build/error-time-rods.svg"
