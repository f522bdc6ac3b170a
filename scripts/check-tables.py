#!/usr/bin/env python3
"""Compares the tables of `--stars` with the JSON, as astropy reads them.

    scripts/check-tables.py DIR

DIR has results of `starpipe process --stars fits,votable,ecsv,corr,rdls`. Needs astropy.
"""

import json
import pathlib
import sys

import numpy as np
from astropy.io import fits
from astropy.table import Table
from astropy.wcs import WCS


def same(column, values):
    """Whether a column has these values; None is masked, or NaN."""
    masked = np.ma.getmaskarray(np.ma.asarray(column))
    for found, is_masked, value in zip(column, masked, values, strict=True):
        if value is None:
            missing = is_masked or found == "" or (isinstance(found, float | np.floating) and np.isnan(found))
            if not missing:
                return False
        elif isinstance(value, list):
            if ("" if is_masked else str(found).strip()) != " ".join(value):
                return False
        elif isinstance(value, str):
            if str(found).strip() != value:
                return False
        elif not np.isclose(float(found), value, rtol=1e-12, atol=0):
            return False
    return True


def check_columns(path, kind, stars):
    table = Table.read(path, format=kind)
    assert len(table) == len(stars), (path, len(table), len(stars))
    names = {name for star in stars for name in star}
    for name in sorted(names):
        values = [star.get(name) for star in stars]
        assert same(table[name], values), (path, name)
    assert str(table["ra_deg"].unit) == "deg" and str(table["vmag"].unit) == "mag", path


def check_astrometry_net(directory, stem, report):
    named = [star for star in report["stars"] if star["id"]]
    rdls = Table.read(directory / f"{stem}.rdls", format="fits")
    assert np.allclose(rdls["RA"], [star["ra_deg"] for star in named], atol=1e-9)
    corr = Table.read(directory / f"{stem}.corr", format="fits")
    assert len(corr) == len(named), (stem, len(corr), len(named))
    off_px = np.hypot(corr["field_x"] - corr["index_x"], corr["field_y"] - corr["index_y"])
    expected = [star["residual_blend_px"] or star["residual_px"] for star in named]
    assert np.allclose(off_px, expected, atol=2e-4), (stem, np.abs(off_px - expected).max())
    header = fits.getheader(directory / f"{stem}.wcs")
    x, y = WCS(header).all_world2pix(corr["index_ra"], corr["index_dec"], 1)
    return float(np.median(np.hypot(x - corr["field_x"], y - corr["field_y"])))


def main():
    directory = pathlib.Path(sys.argv[1])
    checked = 0
    for path in sorted(directory.glob("*.json")):
        report = json.loads(path.read_text())
        stem = path.stem
        for ending, kind in [("fits", "fits"), ("vot", "votable"), ("ecsv", "ascii.ecsv")]:
            if report["stars"]:
                check_columns(directory / f"{stem}.stars.{ending}", kind, report["stars"])
        with fits.open(directory / f"{stem}.stars.fits") as opened:
            opened.verify("exception")
        if report["status"] == "identified":
            off_px = check_astrometry_net(directory, stem, report)
            rms_px = report["match"]["rms_px"]
            assert off_px < 3 * rms_px + 0.01, (stem, off_px, rms_px)
        checked += 1
    print(f"{checked} frames: tables agree with the JSON")


if __name__ == "__main__":
    main()
