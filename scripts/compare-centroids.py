#!/usr/bin/env python3
"""Centroids and limits of starpipe, sep and tetra3rs on the same simulated frames.

Needs numpy, Pillow, sep and tetra3rs. The frames and their truth come from starpipe's tests:

    STARPIPE_PEER_FRAMES=DIR cargo test --release --test it -- --ignored frames_for_peers
    python3 scripts/compare-centroids.py DIR target/release/starpipe

Prints the RMS error over the Cramér-Rao bound by spot size and signal-to-noise ratio, and the
signal-to-noise ratio at which half of the stars are detected at one false detection per megapixel.
Thresholds of the peers are tuned to that rate on frames of noise.
"""
import csv
import json
import math
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
import sep
import tetra3rs
from PIL import Image

MATCH_PX = 2.0
FAINT = (2.0, 9.0)
CLASSES = ["5-7", "10", "20", "50", "100", "300"]
SPOTS = ["0.50", "0.70", "1.00", "1.25", "1.50"]


def pixels(path):
    return np.asarray(Image.open(path)).astype(np.uint16)


def truth(path):
    with open(path) as lines:
        return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(lines)]


def with_sep(frame, threshold, spot=None):
    data = frame.astype(np.float32)
    background = sep.Background(data)
    data -= background.back()
    found = sep.extract(data, threshold, err=background.globalrms)
    x, y = found["x"], found["y"]
    if spot is not None:
        x, y, _ = sep.winpos(data, x, y, np.full(len(x), math.sqrt(spot**2 + 1 / 12)))
    return list(zip(x, y))


def centred(result, frame):
    # tetra3rs counts from the middle of the frame.
    height, width = frame.shape
    return [(c.x + (width - 1) / 2, c.y + (height - 1) / 2) for c in result.centroids]


def with_tetra3rs(frame, threshold, spot=None):
    return centred(tetra3rs.extract_centroids(frame, sigma_threshold=threshold), frame)


def with_tetra3rs_fast(frame, threshold, spot=None):
    return centred(tetra3rs.extract_centroids_fast(frame, sigma_threshold=threshold), frame)


def with_starpipe(program, path, *options):
    command = [program, "process", "--format", "json", *options, str(path)]
    out = subprocess.run(command, capture_output=True, text=True, check=False).stdout
    return [(star["x"], star["y"]) for star in json.loads(out)["stars"]]


def tuned(detector, frames):
    """The threshold that gives one false detection per megapixel."""
    wanted = sum(frame.size for frame in frames) / 1e6
    low, high = 0.8, 12.0
    for _ in range(14):
        middle = math.sqrt(low * high)
        try:
            count = sum(len(detector(frame, middle)) for frame in frames)
        except Exception:  # noqa: BLE001  (sep refuses frames that are nothing but sources)
            count = math.inf
        low, high = (middle, high) if count > wanted else (low, middle)
    return high


def matched(stars, places):
    places = np.array(places).reshape(-1, 2)
    for star in stars:
        if len(places) == 0:
            yield star, None
            continue
        offset = places - (star["x"], star["y"])
        nearest = offset[np.argmin((offset**2).sum(axis=1))]
        yield star, nearest if math.hypot(*nearest) < MATCH_PX else None


def main(directory, program):
    directory = Path(directory)
    peers = {"sep, winpos": with_sep, "tetra3rs": with_tetra3rs, "tetra3rs, single pass": with_tetra3rs_fast}
    print("sep", sep.__version__, "tetra3rs", version("tetra3rs"))
    for spot in SPOTS:
        noise = [pixels(path) for path in sorted(directory.glob(f"noise-{spot}-*.tiff"))]
        thresholds = {name: tuned(detector, noise) for name, detector in peers.items()}
        rows = {
            name: lambda path, n=name, s=float(spot), t=thresholds[name]: peers[n](pixels(path), t, s)
            for name in peers
        }
        rows["starpipe"] = lambda path: with_starpipe(program, path, "--false-alarms", "1")
        for name, places_in in rows.items():
            errors = {c: [] for c in range(len(CLASSES))}
            bounds = {c: [] for c in range(len(CLASSES))}
            for path in sorted(directory.glob(f"centroids-{spot}-*.tiff")):
                for star, offset in matched(truth(path.with_suffix(".csv")), places_in(path)):
                    if offset is not None:
                        errors[int(star["class"])] += list(offset**2)
                        bounds[int(star["class"])] += [star["bound_x_px"] ** 2, star["bound_y_px"] ** 2]
            ratios = [math.sqrt(sum(errors[c]) / sum(bounds[c])) if errors[c] else math.nan for c in errors]
            stars = found = 0
            for path in sorted(directory.glob(f"detection-{spot}-*.tiff")):
                faint = [star for star in truth(path.with_suffix(".csv")) if star["snr"] <= FAINT[1]]
                stars += len(faint)
                found += sum(offset is not None for _, offset in matched(faint, places_in(path)))
            snr_50 = FAINT[1] - (FAINT[1] - FAINT[0]) * found / stars
            threshold = thresholds.get(name)
            tuned_to = "" if threshold is None else f"threshold {threshold:.2f}"
            print(f"{spot} {name:<22}", *(f"{r:6.2f}" for r in ratios), f"  SNR at 50 % {snr_50:.2f}  {tuned_to}", flush=True)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
