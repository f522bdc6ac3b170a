#!/usr/bin/env python3
"""Brightness in JPEG files: draws all-sky frames by scripts/all_sky.py with tone curves, and compares.

    scripts/validate-tone-curves.py target/release/starpipe SKYMAP_SKY2000_V5R4.gz DIR [--frames 100] [--seed 5000]

One frame in three has a power, the curve of sRGB, or the midtones transfer function; all have 8 bits, and are
compressed at a quality of 75 to 95. DIR keeps frames, truth, and answers; frames that are there are not drawn again.
Errors are measured minus true, in magnitudes, and over the stated ones.
"""

import all_sky
import all_sky_maps
import numpy as np

TONES = ("gamma", "srgb", "stretched")


def summary(errors):
    """Count, mean, standard deviation and typical stated error, and errors over stated ones."""
    if not errors:
        return "none"
    off, sigma = np.array(errors).T
    pull = np.sqrt(np.mean((off / sigma) ** 2))
    largest = np.max(np.abs(off / sigma))
    return f"{len(off)}: {off.mean():+.2f} ± {off.std():.2f}, stated {np.median(sigma):.2f}; error over stated {pull:.2f}, largest {largest:.1f}"


def main():
    parser = all_sky.comparison(__doc__, 5000)
    parser.add_argument("--draw", action="append", default=[], help="one more argument of scripts/all_sky.py")
    options = parser.parse_args()
    zeniths, cells, withheld, unknown = {}, {}, [], 0
    for seed in range(options.seed, options.seed + options.frames):
        words = ["--bits", "8", "--tone", TONES[seed % 3], "--jpeg", str(75 + 5 * (seed // 3 % 5)), *options.draw]
        frame, truth, maps = all_sky.frame_of(options, seed, words)
        found = all_sky.answer(options, frame, truth, f"--exposure={truth['exposure_s']}")
        sky = found.get("sky")
        if found["status"] != "identified" or sky is None:
            unknown += 1
            continue
        if sky["no_brightness"]:
            withheld.append((seed, sky["no_brightness"]))
            continue
        true = all_sky_maps.TrueSky(truth, maps)
        errors = all_sky_maps.brightness(sky, true)
        cells.setdefault(truth["tone"], []).extend(errors)
        text = f"{seed} {truth['tone']} {truth.get('tone_parameter')}, {truth['unlit_level']:.1f} unlit"
        if error := all_sky_maps.zenith(sky, true):
            zeniths.setdefault(truth["tone"], []).append(error)
            text += f", zenith {sky['zenith']['mag_arcsec2']:.2f}: {error[0]:+.3f} ± {error[1]:.3f}"
        if errors:
            text += f", cells {np.mean(errors, axis=0)[0]:+.3f} ± {np.std(errors, axis=0)[0]:.3f}, stated {np.median(errors, axis=0)[1]:.3f}"
        print(f"{text}; {sky.get('dark_level_source')} {sky.get('tone_curve')}", flush=True)
    print(f"{options.frames} frames; {unknown} not identified or without a sky, {len(withheld)} without brightness {withheld}")
    for name, found in (("zenith", zeniths), ("cells", cells)):
        for tone in TONES:
            print(f"{name} {tone}: {summary(found.get(tone, []))}")
        print(f"{name}: {summary([error for tone in TONES for error in found.get(tone, [])])}")


if __name__ == "__main__":
    main()
