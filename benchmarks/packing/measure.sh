#!/bin/sh
# From a scene to a certified packing, on the cpu engine: processor time and most memory of every stage, as CSV.
# usage: measure.sh PACKSTONE GRAINS [OPTION OF THE LAST STAGE...], such as --steps 100; needs GNU time
set -eu
packstone=$1 grains=$2
shift 2
scene=$(dirname "$0")/packing.toml
out=$(mktemp -d)
trap 'rm -r "$out"' EXIT
# As much room for each grain.
edge=$(awk "BEGIN { print 0.0521 * ($grains / 10000) ^ (1 / 3) }")
size="--engine cpu --quiet --set population.0.count=$grains --set domain.upper=[$edge,$edge,$edge]"

# Name, and what is run. What packstone says goes to the standard error.
timed() {
    name=$1
    shift
    env time -f "%U %S %M" -o "$out/time" "$packstone" "$@" 1>&2 || echo "$name: failed" 1>&2
    summary=$out/run/stages/$name/summary.json
    steps=$(test -f "$summary" && grep -o '"steps": *[0-9]*' "$summary" | grep -o '[0-9]*$' || true)
    tail -n 1 "$out/time" | awk -v name="$name" -v n="$grains" -v steps="$steps" '{
        t = $1 + $2
        per_step = steps ? sprintf("%.0f", 1e9 * t / n / steps) : ""
        printf "%d,%s,%s,%.2f,%.2f,%s,%.0f,%.0f\n", n, name, steps, t, 1e6 * t / n, per_step, $3 / 1024, 1024 * $3 / n
    }'
}

echo "grains,stage,steps,processor_s,us_per_grain,ns_per_grain_and_step,MiB,bytes_per_grain"
# shellcheck disable=SC2086 # several words
{
    timed read describe "$scene" $size
    timed compress run "$scene" $size --only compress --out "$out/run"
    timed rest run "$scene" $size --only rest --out "$out/run" "$@"
    timed measure measure "$out/run" --tolerance 1e-2 --out "$out/measures"
}
