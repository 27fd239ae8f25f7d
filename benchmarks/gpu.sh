#!/usr/bin/env bash
# On a machine with a CUDA device: the tests that need one, and figures, in at most eight minutes.
# Without one: the same on the CPU with little work, to see that everything runs.
#
#     benchmarks/gpu.sh [FILE]
#
# writes the figures to FILE, default benchmarks/results/DATE-gpu.jsonl, without a device to build/gpu-dry-run.jsonl.
# PYTHON: the interpreter of an environment with fieldsim[test], default .venv/bin/python.
set -euo pipefail
cd "$(dirname "$0")/.."
python="${PYTHON:-.venv/bin/python}"

if "$python" -c 'import sys, warp as wp; sys.exit(not wp.is_cuda_available())'; then
    default="benchmarks/results/$(date +%F)-gpu.jsonl"
else
    default="build/gpu-dry-run.jsonl"
    echo "no CUDA device: a dry run on the CPU" >&2
fi
file="${1:-$default}"
mkdir -p "$(dirname "$file")"
part="$(mktemp "$file.XXXXXX")"
trap 'rm -f "$part"' EXIT

timeout 240 "$python" -m pytest -q -n 2 tests/potentials/test_fields.py tests/dynamics/test_simulation_cuda.py \
    tests/portable/test_lanes_functions.py -k "cuda or device or gpu"
timeout 240 "$python" -m benchmarks gpu --json >"$part"
chmod 644 "$part"
mv "$part" "$file"
cat "$file"
