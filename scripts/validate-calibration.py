#!/usr/bin/env python3
"""Measures whether the errors of `calibrate` are true for frames of one direction, on simulated ones.

    scripts/validate-calibration.py PROGRAM [--sets 60] [--frames 8] [--response-sigma 0.02]

Needs numpy. Each set has its own direction, and its frames have the same stars on the same pixels. The lens is a
pinhole with a distortion of the third order; nothing is given. The error of a lens is the distance of the measured
from the true image of a direction, after the small turn that brings the two closest. The stated one is that of its
covariance. Their ratio is 1, RMS, if errors are as stated.
"""

import argparse
import pathlib
import subprocess
import tempfile
import tomllib

import numpy as np

CAMERA = pathlib.Path(__file__).parent.parent / "docs/validation/camera.toml"
WIDTH, FOCAL_PX, DISTORTION_PX = 1024, 26.79e3 / 5.5, 18.0
RADIUS_PX = WIDTH / 2**0.5


def rays():
    side = np.linspace(-0.5, 0.5, 21) * WIDTH / FOCAL_PX
    u, v = (grid.ravel() for grid in np.meshgrid(side, side))
    return np.stack([u, v, np.ones_like(u)], axis=1)


def image(parameters, rays):
    """Pixels from the centre; the parameters are ln f and the terms in pixels (docs/conventions.md)."""
    k3, k5, k7, axis_x, axis_y, p, q, *_ = [*parameters[1:], *[0] * 9]
    u, v = (rays[:, :2] / rays[:, 2:] * np.exp(parameters[0]) / RADIUS_PX).T
    uu, uv, vv = u * u, u * v, v * v
    r2 = uu + vv
    radial = RADIUS_PX + r2 * (k3 + r2 * (k5 + r2 * k7))
    x = u * radial + axis_x + p * (uu + vv / 3) + q * uv * 2 / 3
    y = v * radial + axis_y + p * uv * 2 / 3 + q * (uu / 3 + vv)
    return np.stack([x, y], axis=1)


def measured(program, directory, frames, response_sigma, pick, seed):
    """The parameters of a lens and their covariance."""
    ra, dec, roll = pick.uniform(0, 360), np.degrees(np.arcsin(pick.uniform(-1, 1))), pick.uniform(0, 360)
    view = [f"--camera={CAMERA}", f"--ra={ra}", f"--dec={dec}", f"--roll={roll}", f"--distortion-px={DISTORTION_PX}"]
    out = [f"--count={frames}", f"--seed={seed}", f"--out={directory}", f"--response-sigma={response_sigma}"]
    lens = f"{directory}/lens.toml"
    for command in (["simulate", *view, *out], ["calibrate", directory, "--out", lens]):
        subprocess.run([program, *command], check=True, capture_output=True)
    lens = tomllib.loads(pathlib.Path(lens).read_text())["lens"]
    return np.array([np.log(lens["focal_length_px"]), *lens.get("terms_px", [])]), np.array(lens["covariance"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("--sets", type=int, default=60)
    parser.add_argument("--frames", type=int, default=8)
    parser.add_argument("--response-sigma", type=float, default=0.02, help="scatter of the pixels' response")
    options = parser.parse_args()
    seen, truth = rays(), np.array([np.log(FOCAL_PX), DISTORTION_PX])
    turns = [image(truth, seen + np.cross(1e-5 * axis, seen)) for axis in np.eye(3)]
    basis, _ = np.linalg.qr(np.stack([(turned - image(truth, seen)).ravel() for turned in turns], axis=1))
    without_turn = lambda off: off.ravel() - basis @ (basis.T @ off.ravel())
    pick, errors = np.random.default_rng(7), []
    for number in range(options.sets):
        with tempfile.TemporaryDirectory() as place:
            directory = f"{place}/set"
            lens, covariance = measured(options.program, directory, options.frames, options.response_sigma, pick, 100 + number)
        steps = np.diag([1e-6, *[1e-3] * (len(lens) - 1)])
        slopes = [without_turn(image(lens + step, seen) - image(lens, seen)) / step.sum() for step in steps]
        stated = np.einsum("ip,pq,iq->i", np.transpose(slopes), covariance, np.transpose(slopes))
        errors.append((np.mean(without_turn(image(lens, seen) - image(truth, seen)) ** 2), np.mean(stated)))
    found, stated = np.transpose(errors)
    ratio, spread = np.mean(found / stated), np.std(found / stated) / len(found) ** 0.5
    print(f"{len(found)} sets of {options.frames} frames of one direction")
    print(f"error over stated error {ratio**0.5:.2f} ± {spread / 2 / ratio**0.5:.2f}, largest {np.max(found / stated) ** 0.5:.1f}")
    print(f"error of a pixel {np.mean(2 * found) ** 0.5:.4f} px, RMS")


if __name__ == "__main__":
    main()
