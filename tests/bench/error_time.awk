# A table of build/error-time.csv, a row for each scene:
#   slope       of log RMSE against log samples, fixed, without the one sample at the pixel's centre
#   adaptive    its time over the fixed run's at the same error, median and greatest
#   povray      POV-Ray's time over rt's at the same error, median and least; rt's is the better of its two curves
# by processor time and, in brackets, by the clock. Times between two runs are interpolated, both axes logarithmic; beyond
# the last run there is none, and an error that rt's shortest run already beats is given that run's time. Runs whose error is
# known to no better than 10 % are left out: the reference is too noisy for them.
BEGIN { FS = "," }

FNR == 1 { next }

$7 < 0.1 * $6 {
    if (!($1 in seen)) { seen[$1]; order[++scenes] = $1 }
    key = $1 "," $2
    n = ++count[key]
    clock[key, n] = $4
    cpu[key, n] = $5 > 0.001 ? $5 : 0.001
    rmse[key, n] = $6
    setting[key, n] = $3
}

# Seconds of the curve at that error; 0: it doesn't reach it. Between the points that bracket it the shortest time counts.
function seconds_at(key, error, cpu_time,  i, a, b, t, share, best) {
    for (i = 1; i <= count[key]; i++) {
        t = cpu_time ? cpu[key, i] : clock[key, i]
        if (rmse[key, i] <= error && (!best || t < best)) best = t
        if (i == count[key]) continue
        a = rmse[key, i]
        b = rmse[key, i + 1]
        if (!(a > error && b < error)) continue
        share = log(a / error) / log(a / b)
        t = exp((1 - share) * log(t) + share * log(cpu_time ? cpu[key, i + 1] : clock[key, i + 1]))
        if (!best || t < best) best = t
    }
    return best
}

function median(list, n,  i, j, x) {
    if (n == 0) return ""
    for (i = 2; i <= n; i++) {
        x = list[i]
        for (j = i - 1; j > 0 && list[j] > x; j--) list[j + 1] = list[j]
        list[j + 1] = x
    }
    return (list[int((n + 1) / 2)] + list[int(n / 2) + 1]) / 2
}

function slope(key,  i, x, y, n, mx, my, xx, xy) {
    for (i = 1; i <= count[key]; i++) {
        if (setting[key, i] == 1) continue
        n++
        mx += log(setting[key, i])
        my += log(rmse[key, i])
    }
    if (n < 2) return ""
    mx /= n
    my /= n
    for (i = 1; i <= count[key]; i++) {
        if (setting[key, i] == 1) continue
        x = log(setting[key, i]) - mx
        xx += x * x
        xy += x * (log(rmse[key, i]) - my)
    }
    return sprintf("%.2f", xy / xx)
}

# Ratios of the adaptive curve to the fixed one: sets middle, most.
function adaptive_ratios(scene, cpu_time,  i, n, t, list) {
    most = 0
    for (i = 1; i <= count[scene ",adaptive"]; i++) {
        t = seconds_at(scene ",fixed", rmse[scene ",adaptive", i], cpu_time)
        if (!t) continue
        list[++n] = (cpu_time ? cpu[scene ",adaptive", i] : clock[scene ",adaptive", i]) / t
        if (list[n] > most) most = list[n]
    }
    middle = median(list, n)
}

# Ratios of both of POV-Ray's curves to rt's better one: sets middle, least and beyond, the runs better than all of rt's.
function povray_ratios(scene, cpu_time,  i, k, n, a, b, key, list) {
    least = 0
    beyond = 0
    for (k = 1; k <= 2; k++) {
        key = scene ",povray-" k
        for (i = 1; i <= count[key]; i++) {
            a = seconds_at(scene ",fixed", rmse[key, i], cpu_time)
            b = seconds_at(scene ",adaptive", rmse[key, i], cpu_time)
            if (!a || (b && b < a)) a = b
            if (!a) { beyond++; continue }
            list[++n] = (cpu_time ? cpu[key, i] : clock[key, i]) / a
            if (!least || list[n] < least) least = list[n]
        }
    }
    middle = median(list, n)
}

function pair(by_cpu, by_clock) { return by_cpu == "" ? "-" : sprintf("%.2f (%.2f)", by_cpu, by_clock) }

END {
    printf "%-34s %6s %17s %17s %17s %17s\n", "scene", "slope", "adaptive/fixed", "greatest", "POV-Ray/rt", "least"
    for (s = 1; s <= scenes; s++) {
        scene = order[s]
        adaptive_ratios(scene, 1); m = middle; g = m == "" ? "" : most
        adaptive_ratios(scene, 0); line = sprintf("%17s %17s", pair(m, middle), pair(g, most))
        povray_ratios(scene, 1); m = middle; g = m == "" ? "" : least
        povray_ratios(scene, 0); line = line sprintf(" %17s %17s", pair(m, middle), pair(g, least))
        if (beyond) line = line sprintf("  %d of POV-Ray's runs are better than all of rt's", beyond)
        printf "%-34s %6s %s\n", scene, slope(scene ",fixed"), line
    }
}
