#!/usr/bin/env bash
# All that a machine with a GPU can tell: adapters, parity with the CPU, a table of steps for scenes of every size, and the whole
# specimen pulled by 5 mm. Tables go to results/device.jsonl, a line per scene; the last lines say which goals are met.
#   benches/device.sh [PART OF AN ADAPTER'S NAME]        STEPS=64 and SCENES="2 4" make a short try of it
set -euo pipefail
cd "$(dirname "$0")/.."
adapter=${1:-}
steps=${STEPS:-2000}
scenes=${SCENES:-2 4;6 12;14 28;30 60;cases/bias_extension_small.json;cases/bias_extension.json}
tables=results/device.jsonl

cargo build --release
cargo bench --bench device --no-run
target/release/tricot devices
TRICOT_REQUIRE_ADAPTER=1 cargo test --release --test gpu

mkdir -p results
: > "$tables"
IFS=';' read -ra each <<< "$scenes"
for scene in "${each[@]}"; do
    # a scene is a case, or two numbers of yarns
    # shellcheck disable=SC2086
    cargo bench --bench device -- $scene --steps "$steps" --adapter "$adapter" | tee /dev/stderr | tail -n 1 >> "$tables"
done

goal() { # what, number, most or least, goal
    awk -v what="$1" -v number="$2" -v kind="$3" -v goal="$4" 'BEGIN {
        met = kind == "most" ? number <= goal : number >= goal
        printf "%-42s %12.4g, at %s %g: %s\n", what, number, kind, goal, met ? "met" : "missed"
    }'
}
number() { # scene, field
    { grep -F "\"scene\":\"$1\"" "$tables" || true; } | grep -oE "\"$2\":[0-9.e+-]+" | cut -d: -f2
}
check() { # what, scene, field, most or least, goal
    local found
    found=$(number "$2" "$3") && [ -n "$found" ] && goal "$1" "$found" "$4" "$5" || echo "$1: not measured"
}
check "cell, µs a step" "sheet of 2 × 4" us_per_step most 25
check "whole specimen, µs a step" cases/bias_extension.json us_per_step most 150
check "a million hexahedra, hexahedra a second" "sheet of 30 × 60" hexes_per_s least 2e9

if [[ $scenes == *bias_extension.json* ]]; then
    started=$(date +%s)
    target/release/tricot run cases/bias_extension.json --backend gpu --adapter "$adapter" --force -o results/device \
        --set domain.specimen.displacement_mm=5 --set steps.2.move.time_s=13.3e-3
    # its share of 60 s for the whole pull: 16.8 of 163.5 ms
    goal "whole specimen by 5 mm, s of wall time" $(($(date +%s) - started)) most 6.2
fi
