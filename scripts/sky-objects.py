#!/usr/bin/env python3
"""Writes assets/constellations.csv and assets/deep-sky.csv.

    scripts/sky-objects.py D3_CELESTIAL_DATA

The argument is the directory `data` of the npm package d3-celestial. assets/README.md
says where its data come from, and describes the files.
"""

import csv
import json
import pathlib
import re
import sys

ASSETS = pathlib.Path(__file__).parent.parent / "assets"
OBJECTS = 300
KINDS = {
    "oc": "open cluster",
    "gc": "globular cluster",
    "pn": "planetary nebula",
    "snr": "supernova remnant",
    **dict.fromkeys(["g", "s", "s0", "sd", "i", "e", "gg"], "galaxy"),
    **dict.fromkeys(["bn", "sfr", "rn", "en", "n"], "nebula"),
}
# Names that people use; the package has few.
NAMES = {
    "LMC": "Large Magellanic Cloud",
    "SMC": "Small Magellanic Cloud",
    "NGC 3372": "Carina Nebula",
    "IC 2602": "Southern Pleiades",
    "IC 2391": "Omicron Velorum Cluster",
    "NGC 3532": "Wishing Well Cluster",
    "M 44": "Beehive Cluster",
    "M 7": "Ptolemy’s Cluster",
    "M 31": "Andromeda Galaxy",
    "IC 1396": "Elephant’s Trunk Nebula",
    "NGC 869": "Double Cluster",
    "NGC 884": "Double Cluster",
    "NGC 2264": "Christmas Tree Cluster",
    "M 42": "Orion Nebula",
    "NGC 7000": "North America Nebula",
    "NGC 104": "47 Tucanae",
    "M 6": "Butterfly Cluster",
    "NGC 4755": "Jewel Box",
    "M 24": "Sagittarius Star Cloud",
    "NGC 5139": "Omega Centauri",
    "M 8": "Lagoon Nebula",
    "M 20": "Trifid Nebula",
    "M 16": "Eagle Nebula",
    "M 17": "Omega Nebula",
    "M 27": "Dumbbell Nebula",
    "M 57": "Ring Nebula",
    "M 51": "Whirlpool Galaxy",
    "M 101": "Pinwheel Galaxy",
    "M 104": "Sombrero Galaxy",
    "M 81": "Bode’s Galaxy",
    "M 82": "Cigar Galaxy",
    "M 1": "Crab Nebula",
    "M 97": "Owl Nebula",
    "M 63": "Sunflower Galaxy",
    "M 64": "Black Eye Galaxy",
    "M 33": "Triangulum Galaxy",
    "M 13": "Hercules Cluster",
    "M 11": "Wild Duck Cluster",
    "NGC 2070": "Tarantula Nebula",
    "M 83": "Southern Pinwheel Galaxy",
    "NGC 5128": "Centaurus A",
    "NGC 2244": "Rosette Nebula",
    "M 76": "Little Dumbbell Nebula",
    "NGC 7293": "Helix Nebula",
    "M 87": "Virgo A",
    "IC 434": "Horsehead Nebula",
    "M 45": "Pleiades",
    "M 102": "Spindle Galaxy",
    "M 73": "",
    "M 94": "Cat’s Eye Galaxy",
    "M 77": "Cetus A",
}
# Longer sides in arcminutes that the package has much too large, as SIMBAD has them.
SIZES = {"NGC 1980": 14.0}
# What the package lacks, as SIMBAD has it.
OTHERS = [
    ["Mel 25", "Hyades", "open cluster", 0.5, 330.0, 66.75, 15.87],
    ["Cr 399", "Coathanger", "open cluster", 3.6, 60.0, 291.35, 20.18],
]
CATALOGS = re.compile(r"(NGC|IC) ?\d+[A-Z]?$")
CLOUDS = {"LMC", "SMC"}


def features(data, name):
    return json.loads((data / f"{name}.json").read_text())["features"]


def place(feature):
    ra_deg, dec_deg = feature["geometry"]["coordinates"]
    return round(ra_deg % 360, 4), round(dec_deg, 4)


def write(name, heading, rows):
    with open(ASSETS / name, "w", newline="", encoding="utf-8") as out:
        table = csv.writer(out, lineterminator="\n")
        table.writerow(heading)
        table.writerows(rows)
    print(name, len(rows))


def constellations(data):
    lines = {}
    for feature in features(data, "constellations.lines"):
        for line in feature["geometry"]["coordinates"]:
            points = (f"{ra_deg % 360:.3f} {dec_deg:.3f}" for ra_deg, dec_deg in line)
            lines.setdefault(feature["id"], []).append(" ".join(points))
    rows = [
        # Serpens has two parts.
        [feature["id"], feature["properties"]["name"], *place(feature), ";".join(lines.pop(feature["id"], []))]
        for feature in sorted(features(data, "constellations"), key=lambda feature: feature["id"])
    ]
    assert not lines, lines.keys()
    write("constellations.csv", ["abbreviation", "name", "ra_deg", "dec_deg", "lines"], rows)


def size_arcmin(text):
    """The longer side."""
    sides = [float(side) for side in re.findall(r"[\d.]+", str(text))]
    return round(max(sides, default=0), 1)


def deep_sky(data):
    rows, messier = [], set()
    for feature in features(data, "messier"):
        about = feature["properties"]
        messier.add(about["desig"].replace(" ", ""))
        rows.append([feature["id"].replace("M", "M "), about["alt"], about, feature])
    others = []
    for feature in features(data, "dsos.14"):
        about = feature["properties"]
        name = about["desig"]
        usual = CATALOGS.match(name) or name in CLOUDS
        known = name.replace(" ", "") in messier or feature["id"].startswith("M ")
        if usual and not known and about["type"] in KINDS and 0 < float(about["mag"]) < 99:
            others.append([name, "", about, feature])
    others.sort(key=lambda row: float(row[2]["mag"]))
    rows += others[: OBJECTS - len(rows)]
    rows.sort(key=lambda row: float(row[2]["mag"]))
    table = [
        [name, NAMES.get(name, alternative), KINDS.get(about["type"], "stars"), round(float(about["mag"]), 1), SIZES.get(name, size_arcmin(about["dim"])), *place(feature)]
        for name, alternative, about, feature in rows
    ]
    table = sorted(table + OTHERS, key=lambda row: row[3])
    heading = ["designation", "name", "kind", "vmag", "size_arcmin", "ra_deg", "dec_deg"]
    write("deep-sky.csv", heading, table)


def main():
    data = pathlib.Path(sys.argv[1])
    constellations(data)
    deep_sky(data)


if __name__ == "__main__":
    main()
