#!/usr/bin/env bash
# How far the error that rt reports can be trusted: scenes x seeds x budgets, each picture's reported RMSE and 95 % interval
# beside its true RMSE, which tests/bench/reference finds with plain random samples.
#   tests/bench/calibration.sh [SCENE...]     SEEDS=10 SIZE=256x256 SAMPLES=512 (of each half of the reference)
# Budgets are 9 and 25 samples a pixel, and --error with 0.7 of what 25 samples give in that scene. References are kept
# under build/calibration until the scene draws another picture. A table to standard output, a row for each run to
# build/calibration.csv. Fails if the interval holds the truth in fewer than 90 or more than 99 % of all runs or in fewer
# than 75 % of a scene's, if the reported RMSE is off by 5 % on average, or if the median of high / low is above 1.5.
#
# A run's figures are of the picture as PFM: linear, neither clamped nor rounded. The reference has noise too: where its
# standard error, the last column, isn't small beside the interval, SAMPLES is too small.
cd "$(dirname "$0")/../.." || exit 1
rt=${RT:-./rt} reference=build/release/tests/bench/reference
seeds=${SEEDS:-10} size=${SIZE:-256x256} samples=${SAMPLES:-512} out=build/calibration csv=build/calibration.csv
mkdir -p $out
scenes=("$@")
[ $# -gt 0 ] || scenes=(tests/golden/{phong,lights,light_inside,mirrors,mirror_depth,csg_union,csg_diff,csg_mesh,prim_torus}.lua
    tests/golden/{prim_cone,prim_nh,texture_sphere,texture_cube,texture_mesh,bumps,mountain,tree,hierarchy,mesh_normals}.lua
    Assets/{primitives/primitives_reflecting,reflection/reflection,umbrella/umbrella,temple/temple_floor_2}.lua
    Assets/{waves/waves_2,texture/art_gallery,mountain/mountain_2,tree/tree_1,rods/rods,final/temple}.lua)

die() { echo "$1" >&2; exit 1; }

# field NAME: of the report's outcome.
field() { sed -n "s/^  \"rmse\": {.*\"$1\": \([0-9.e+-]*\).*/\1/p" $out/report.json; }

# draw SCENE OPTION...: a picture and its report; sets value, low, high and spent, the samples a pixel.
draw() {
    local scene=$1
    shift
    "$rt" -q --size $size -o $out/picture.pfm --report $out/report.json "$@" "$scene" 2>$out/log || die "$scene $*: $(tail -n 1 $out/log)"
    value=$(field value) low=$(field low) high=$(field high)
    spent=$(awk -v area=${size/x/*} '/^  "samples":/ { split(area, side, "*"); printf "%.4g", $2 / (side[1] * side[2]) }' $out/report.json)
    [ -n "$value" ] && [ -n "$low" ] && [ -n "$high" ] || die "$scene $*: no RMSE with its interval in the report"
}

# make_reference SCENE NAME: sets truth, the reference's path without its ending. A picture of one sample a pixel tells
# whether the scene is still the same.
make_reference() {
    "$rt" -q -s 1 --no-audit --size $size -o $out/centre.pfm "$1" 2>$out/log || die "$1: $(tail -n 1 $out/log)"
    local state
    state=$(cksum <$out/centre.pfm)
    truth=$out/$2-$size-$samples-${state%% *}
    [ -e $truth-2.pfm ] && return
    rm -f $out/$2-$size-$samples-*.pfm
    $reference make "$1" $size $samples $truth || die "$1 has no reference"
}

# judge SCENE NAME BUDGET OPTION...: all seeds.
judge() {
    local scene=$1 name=$2 budget=$3 seed true_rmse noise
    shift 3
    for ((seed = 1; seed <= seeds; seed++)); do
        draw "$scene" --seed $seed "$@"
        read -r true_rmse noise < <($reference judge $out/picture.pfm $truth)
        [ -n "$noise" ] || die "$scene: no judgement"
        echo "$name,$budget,$seed,$spent,$value,$low,$high,$true_rmse,$noise" >>$csv
    done
}

echo "scene,budget,seed,samples_per_pixel,rmse,low,high,true_rmse,true_rmse_error" >$csv
for scene in "${scenes[@]}"; do
    name=$(basename "$scene" .lua)
    make_reference "$scene" "$name"
    judge "$scene" "$name" "9 samples" -s 9
    judge "$scene" "$name" "25 samples" -s 25
    goal=$(awk -F, -v name="$name" '$1 == name && $2 == "25 samples" { sum += $5; n++ } END { printf "%.2g", 0.7 * sum / n }' $csv)
    judge "$scene" "$name" "error goal" --error "$goal"
done

sort -s -t, -k1,1 $csv | awk -F, -v seeds="$seeds" '
    function median(list, n,  i, j, x) {
        for (i = 2; i <= n; i++) {
            x = list[i]
            for (j = i - 1; j > 0 && list[j] > x; j--) list[j + 1] = list[j]
            list[j + 1] = x
        }
        return (list[int((n + 1) / 2)] + list[int(n / 2) + 1]) / 2
    }
    function row(group,  i, ratios) {
        for (i = 1; i <= count[group]; i++) ratios[i] = ratio[group, i]
        printf "%-24s %5d %8.1f %% %+8.1f %% %8.2f %9.5f %9.1f %%\n", group, runs[group], 100 * held[group] / runs[group],
            100 * bias[group] / runs[group], median(ratios, count[group]), truth[group] / runs[group],
            100 * noise[group] / runs[group]
        return median(ratios, count[group])
    }
    function take(group) {
        runs[group]++
        held[group] += $6 <= $8 && $8 <= $7
        if ($8 > 0) { bias[group] += $5 / $8 - 1; noise[group] += $9 / $8 }
        truth[group] += $8
        ratio[group, ++count[group]] = $6 > 0 ? $7 / $6 : 1e9
    }
    $1 == "scene" { next }
    !($1 in seen) { seen[$1]; order[++scenes] = $1 }
    { take($1); take($2); take("all") }
    END {
        printf "%-24s %5s %10s %10s %8s %9s %11s\n", "scene", "runs", "covers", "bias", "high/low", "true RMSE", "its error"
        for (i = 1; i <= scenes; i++) row(order[i])
        print ""
        row("9 samples"); row("25 samples"); row("error goal")
        middle = row("all")
        for (i = 1; i <= scenes; i++)
            if (held[order[i]] < 0.75 * runs[order[i]]) { print "not held: 75 % of the runs of " order[i]; failed = 1 }
        share = held["all"] / runs["all"]
        off = bias["all"] / runs["all"]
        if (share < 0.90 || share > 0.99) { print "not held: the interval covers 90 to 99 %"; failed = 1 }
        if (off > 0.05 || off < -0.05) { print "not held: the bias is below 5 %"; failed = 1 }
        if (middle > 1.5) { print "not held: the median of high / low is at most 1.5"; failed = 1 }
        exit failed
    }'
status=$?
echo "The runs are $csv"
exit $status
