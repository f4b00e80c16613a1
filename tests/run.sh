#!/usr/bin/env bash
# Builds and runs all tests: tests/run.sh [PATTERN] runs those whose name matches. At most JOBS (2) at a time.
#   tests/test_*.c   cmocka programs, as release and as ASan+UBSan builds, some as TSan builds
#   tests/test_*.sh  scripts that print "ok NAME", "not ok NAME: why" or "skip NAME: why"; RT is the program
# One line per program, its output if it failed; the last line is the sum: "N passed, N failed".
cd "$(dirname "$0")/.." || exit 1
pattern=${1:-.}
slots=${JOBS:-2}
logs=build/test-logs
rm -rf $logs && mkdir -p $logs build/test-tmp
export RT=${RT:-./rt}
export ASAN_OPTIONS=allocator_may_return_null=1:detect_stack_use_after_return=1 UBSAN_OPTIONS=print_stacktrace=1

# job LABEL COMMAND...: runs it, counts what passed and failed, says so in one go.
job() {
    local label=$1 log=$logs/${1//[\/ ]/-} begin=$EPOCHREALTIME status passed failed
    shift
    timeout -k 10 540 "$@" >$log.log 2>&1 </dev/null
    status=$?
    read -r passed failed < <(awk '
        /^\[  PASSED  \] [0-9]+ test/ { p += $4 }
        /^\[  FAILED  \] [0-9]+ test\(s\), listed/ { f += $4 }
        /^ok / { p++ }
        /^not ok / { f++ }
        END { print p + 0, f + 0 }' $log.log)
    [ $status = 0 ] || [ "$failed" -gt 0 ] || failed=1
    [ $((passed + failed)) -gt 0 ] || grep -q '^skip ' $log.log || failed=1
    echo "$passed $failed" >$log.count
    {
        printf '%s %-34s %4d passed %3d failed %7.1f s\n' "$([ "$failed" = 0 ] && echo 'ok  ' || echo FAIL)" "$label" \
            "$passed" "$failed" "$(awk "BEGIN { print $EPOCHREALTIME - $begin }")"
        grep '^skip ' $log.log | sed 's/^/     /'
        if [ "$failed" != 0 ]; then
            [ $status = 0 ] || echo "     exit status $status$([ $status = 124 ] && echo ': took too long')"
            grep -vE '^ok |^skip |^\[ RUN  |^\[       OK' $log.log | tail -n 60 | sed 's/^/     /'
        fi
    } >$log.report
    flock $logs cat $log.report
}

# start LABEL COMMAND...: a job in the background, when there is room for it.
start() {
    [[ $1 =~ $pattern ]] || return
    while [ "$(jobs -rp | wc -l)" -ge "$slots" ]; do wait -n; done
    job "$@" &
}

# Tests of what starts threads run as TSan builds too.
threaded="render bvh mesh_split parallel"

# Building is a job too: what can't be built counts as failed, and the others run all the same.
build() { job "build-$1" sh -c 'make -k CC=gcc BUILD="$1" $2 && echo "ok built"' sh "$1" "$2"; }
build release tests
build asan tests
build tsan "all $(printf 'build/tsan/tests/test_%s ' $threaded)"
build debug all

for test in $threaded; do start "tsan/test_$test" setarch "$(uname -m)" -R "build/tsan/tests/test_$test"; done
for test in tests/test_*.sh; do start "$(basename "$test" .sh)" "$test"; done
start lint tests/lint.sh
for kind in asan release; do
    for test in tests/test_*.c; do
        name=$(basename "$test" .c)
        start $kind/$name build/$kind/tests/$name
    done
done
wait

cat $logs/*.count | awk -v s=$SECONDS '{ p += $1; f += $2 } END {
    printf "all tests: %d min %02d s\n%d passed, %d failed\n", s / 60, s % 60, p, f; exit f > 0 }'
