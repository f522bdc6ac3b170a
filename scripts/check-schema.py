#!/usr/bin/env python3
"""Checks what starpipe prints as JSON against docs/schema/starpipe.schema.json.

    python3 scripts/check-schema.py target/release/starpipe

Needs jsonschema 4. Runs every command that prints JSON, on fixtures and on frames that it simulates,
and exits with 1 if

- an object does not fit the schema, which is made strict: fields that are not in it are errors;
- a field of the schema was in no object;
- docs/json.md has a field or a code that is not in the schema, or lacks one that is.
"""

import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

import jsonschema

ROOT = pathlib.Path(__file__).resolve().parent.parent
SCHEMA = json.loads((ROOT / "docs/schema/starpipe.schema.json").read_text())
CAMERA = "docs/validation/camera.toml"

ALL_SKY = "docs/start/all-sky.toml --exposure 20 --by-altitude 1 --site 47,8,500"


def night_frame(number):
    """The command that draws a frame of the evening: one each ten minutes, and a knock before the last three."""
    hours, minutes = divmod(17 * 60 + 40 + 10 * number, 60)
    zenith_deg = 27.709 + 2.5068 * number + (4 if number >= 5 else 0)
    date = f"2026-01-15T{hours}:{minutes:02}Z"
    return f"simulate: simulate --camera {ALL_SKY} --date {date} --ra {zenith_deg:.3f} --dec 46.929 --first {number} --out OUT/allsky"


# Definition in the schema, and the command; OUT is a directory. Later commands read what earlier ones
# wrote. None: only what is written matters.
# Fields of frames for which the repository has no catalog: tests/it/deep draws its own.
UNSEEN = {"process.match.catalog"}

COMMANDS = f"""
simulate: simulate --camera {CAMERA} --site 47,8,500 --date 2026-01-15T20:00Z --ra 62.8 --dec 46.9 --first 0 --out OUT/night
simulate: simulate --camera {CAMERA} --site 47,8,500 --date 2026-01-15T20:30Z --ra 70.3 --dec 46.9 --first 1 --out OUT/night
simulate: simulate --camera {CAMERA} --site 47,8,500 --date 2026-01-15T21:00Z --ra 77.8 --dec 46.9 --first 2 --out OUT/night
simulate: simulate --camera {CAMERA} --ra 83.8 --dec -1.2 --count 4 --out OUT/still
simulate: simulate --camera {CAMERA} --date 2026-01-15T20:00Z --ra 108 --dec 22 --image fits --out OUT/jupiter
simulate: simulate --camera {CAMERA} --dark --count 2 --out OUT/short
simulate: simulate --camera {CAMERA} --dark --exposure 1 --count 2 --out OUT/long
simulate: simulate --camera {CAMERA} --flat 5000 --count 2 --out OUT/flats
darks: darks --camera {CAMERA} --out OUT/calibration OUT/short OUT/long
darks: darks OUT/short/dark-00000.tif
flats: flats --camera {CAMERA} --out OUT/calibration OUT/flats
process: process fixtures/orion/orion.png fixtures/formats/astropy.fits.gz
process: process --camera fixtures/cygnus/camera.toml --exposure 1 --date 2019-12-29T22:00Z --site 52.22,4.42 fixtures/cygnus/cygnus.tif
process: process fixtures/regression
process: process --near 0,0 --radius 1 --fov 9 fixtures/regression/clean.tif
process: process --camera {CAMERA} --dark OUT/calibration/master-dark-0.1s.fits --flat OUT/calibration/master-flat.fits OUT/jupiter
process: process --only pointing --frame-of apparent --date 2026-01-01 fixtures/regression/distorted.tif
None: process --format csv --out OUT/tables fixtures/orion/orion.png
process: identify --pixel-scale 113.7 OUT/tables/orion.csv
process: identify --pixel-scale 10 OUT/tables/orion.csv
simulate: simulate --camera {ALL_SKY} --date 2026-01-15T20:00Z --ra 62.805 --dec 46.929 --out OUT/sky.tif
process: sky --camera docs/start/all-sky.toml --site 47,8,500 OUT/sky.tif
process: sky fixtures/orion/orion.png
simulate: simulate --camera {ALL_SKY} --bits 8 --gain-e-per-adu 60 --date 2026-01-15T20:00Z --ra 62.805 --dec 46.929 --out OUT/curve.tif
process: sky --site 47,8,500 OUT/curve.tif
process: process --max-stars 20 fixtures/orion/orion.png
process: process --date 2020-03-01T20:00Z --site 50,10,300 fixtures/cygnus/cygnus.tif
simulate: simulate --preset imx174-35mm --ra 84 --dec 3 --date 2024-01-05T21:00Z --exposure 1 --seed 2 --trails 2 --trail-rate-deg-s 2 --trail-vmag 4 --out OUT/crossed.tif
process: process --trails --site 50,10,300 OUT/crossed.tif
{chr(10).join(night_frame(number) for number in range(8))}
night: night --camera docs/start/all-sky.toml --site 47,8,500 --out OUT/a-night OUT/allsky
night_frame: file OUT/a-night/night.jsonl
calibrate: calibrate --site 47,8,500 OUT/night fixtures/regression/no-stars.tif -o OUT/lens.toml
process: process --camera OUT/lens.toml --site 47,8,500 OUT/night/frame-00000.tif
track: track --interval 0.1 OUT/still
track: track OUT/still OUT/night fixtures/regression/no-stars.tif
limit: limit --preset experiment-1
limit: limit --camera {CAMERA} --sweep exposure_s=0.1:1:2
experiment: experiment 1 --count 2
robustness: validate --suite robustness --count 2 --sweep centroid-error=0:1:2
robustness: validate --suite robustness --count 2 --sweep centroid-error=0:1:2 --scale-unknown
clutter: validate --suite clutter --camera {CAMERA} --kinds clean,noise --count 1
validate: validate --camera {CAMERA} --count 2 --figures none --out OUT/validation
validate: validate --camera {CAMERA} --count 1 --exposure 0.0005 --figures none --out OUT/nothing
validate_sweep: validate --camera {CAMERA} --count 1 --sweep exposure_s=0.0005:0.1:2 --figures none --out OUT/study
validate_suite: validate --camera {CAMERA} --count 1 --width-px 400 --height-px 400 --suite hard --figures none --out OUT/suite
validate_skies: validate --camera docs/start/all-sky.toml --count 2 --seed 2 --suite sky --figures none --out OUT/skies
defocus: defocus --camera {CAMERA} --darks OUT/short --vmag 5 --count 20 --radius-px 0.2:1.6:5 --noise-e 3:27:2 --required-error 0.05,0.0001
defocus: defocus --normalisation peak --count 20 --radius-px 0.4:2.4:20 --required-error 0.02
None: process OUT/night/*.tif fixtures/regression/no-stars.tif fixtures/regression/wide.toml --out-parquet OUT/archive
archive_status: archive status OUT/archive
archive_report: archive report OUT/archive
"""


def strict(schema):
    """The schema without the freedom to add fields."""
    if isinstance(schema, list):
        return [strict(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    closed = {key: strict(item) for key, item in schema.items()}
    if isinstance(schema.get("properties"), dict) and "required" in schema:
        closed.setdefault("additionalProperties", False)
    return closed


def objects(program, arguments, is_json):
    """The objects that a command prints, or that are in a file."""
    if arguments.startswith("file "):
        lines = pathlib.Path(arguments.removeprefix("file ")).read_text().splitlines()
        return [json.loads(line) for line in lines]
    command = [program, *shlex.split(arguments), *(["--format", "json"] if is_json else [])]
    command = " ".join(word if "*" in word else shlex.quote(word) for word in command)
    ran = subprocess.run(command, shell=True, cwd=ROOT, capture_output=True, text=True, check=False)
    # 1: an archive has a file that is no frame; 3: a frame is not identified.
    if ran.returncode not in ((0, 3) if is_json else (0, 1, 3)):
        sys.exit(f"{arguments}: exit status {ran.returncode}\n{ran.stderr}")
    return [json.loads(line) for line in ran.stdout.splitlines()] if is_json else []


def note_fields(schema, value, path, seen):
    """Adds the fields of the schema that the value has, by their place in the schema."""
    if "$ref" in schema:
        path = schema["$ref"].rsplit("/", 1)[1]
        return note_fields(SCHEMA["$defs"][path], value, path, seen)
    for choice in schema.get("anyOf", []):
        if value is not None and "$ref" in choice:
            note_fields(choice, value, path, seen)
    if isinstance(value, list) and isinstance(schema.get("items"), dict):
        for item in value:
            note_fields(schema["items"], item, path, seen)
    for name, field in schema.get("properties", {}).items():
        if isinstance(value, dict) and name in value:
            seen.add(f"{path}.{name}")
            note_fields(field, value[name], f"{path}.{name}", seen)
    return None


def fields(schema, path):
    """All fields of a schema, by their place in it."""
    if isinstance(schema.get("items"), dict):
        yield from fields(schema["items"], path)
    for name, field in schema.get("properties", {}).items():
        yield f"{path}.{name}"
        yield from fields(field, f"{path}.{name}")


def check_documentation(names):
    """The fields that only one of the schema and docs/json.md has."""
    page = re.sub(r"```.*?```", "", (ROOT / "docs/json.md").read_text(), flags=re.DOTALL)
    words = set(re.findall(r"`([^`]+)`", page))
    faults = [f"docs/json.md does not have the field {name}" for name in sorted(names - words)]
    # First cells of the tables of fields; tables of columns and codes have another head.
    for table in re.findall(r"\| field \| meaning \|\n\|---\|---\|\n((?:\|.*\n)+)", page):
        cells = " ".join(row.split("|")[1] for row in table.splitlines())
        listed = set(re.findall(r"`([^`]+)`", cells))
        faults += [f"the schema does not have the field {name}" for name in sorted(listed - names)]
    not_tracked = SCHEMA["$defs"]["track"]["properties"]["not_tracked"]["properties"]["code"]
    for head, schema in (
        ("reason_code", SCHEMA["$defs"]["reason_code"]),
        ("code", SCHEMA["$defs"]["note_code"]),
        ("not_tracked.code", not_tracked),
    ):
        rows = page.split(f"| `{head}` | meaning |")[1].split("\n\n")[0]
        different = set(re.findall(r"^\| `([^`]+)` \|", rows, re.MULTILINE)) ^ set(schema["enum"])
        faults += [f"the code {code} is in the schema or in docs/json.md only" for code in sorted(different)]
    return faults


def main():
    """Runs everything, and says what does not fit."""
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    program = os.path.abspath(sys.argv[1])
    closed = strict(SCHEMA)
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    faults, seen, count = [], set(), 0
    with tempfile.TemporaryDirectory() as directory:
        for line in COMMANDS.strip().splitlines():
            name, arguments = line.replace("OUT", directory).split(": ", 1)
            reference = {"$ref": f"#/$defs/{name}"}
            validator = jsonschema.Draft202012Validator({**closed, **reference})
            for found in objects(program, arguments, name != "None"):
                count += 1
                note_fields(reference, found, name, seen)
                for error in validator.iter_errors(found):
                    faults.append(f"{line}: {error.json_path}: {error.message[:200]}")
    known = {path for name, schema in SCHEMA["$defs"].items() for path in fields(schema, name)}
    faults += [f"no object has the schema's field {path}" for path in sorted(known - seen - UNSEEN)]
    faults += check_documentation({path.rsplit(".", 1)[1] for path in known})
    print(*faults[:40], f"{count} objects checked, {len(faults)} faults", sep="\n")
    sys.exit(1 if faults else 0)


main()
