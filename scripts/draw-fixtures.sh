#!/usr/bin/env bash
# Redraws the frames in fixtures/; with --check, only compares them with the existing files.
set -euo pipefail
cd "$(dirname "$0")/.."

out=fixtures
if [ "${1:-}" = --check ]; then
    out=$(mktemp -d)
    trap 'rm -rf "$out"' EXIT
fi

draw() { # NAME FILE RA DEC UP FOV WIDTH HEIGHT SEED
    local name=$1 file=$2
    shift 2
    mkdir -p "$out/$name"
    cargo run --quiet --example draw_frame -- "$out/$name/$file" "$@"
    if [ "$out" = fixtures ]; then
        sed -i "s/^sha256 = .*/sha256 = \"$(sha256sum <"$out/$name/$file" | cut -d' ' -f1)\"/" "fixtures/$name/PROVENANCE.toml"
    else
        cmp "$out/$name/$file" "fixtures/$name/$file"
        grep -q "$(sha256sum <"$out/$name/$file" | cut -d' ' -f1)" "fixtures/$name/PROVENANCE.toml"
    fi
}

draw orion orion.png 83.7 -0.4 -50 20 640 480 1
draw cygnus cygnus.tif 306.0 41.0 -100 12 512 384 2
