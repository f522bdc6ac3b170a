#!/usr/bin/env python3
"""Runs clients of nova.astrometry.net against `starpipe serve`; scripts/check-serve installs them.

    python3 scripts/check-serve.py PROGRAM [CLIENT.PY] [FRAME...]

Each client runs in a process of its own, told the address in the way that its users have: astroquery by its
configuration, client.py by its option, and astrometry-net-client, which has no option, by the variable http_proxy.
What they get must be within 0.01 pixels of what `starpipe process` says.
"""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
TOLERANCE_PX = 0.01

ASTROQUERY = """
import json, sys
from astroquery.astrometry_net import conf, AstrometryNet
conf.api_key = 'any'
assert AstrometryNet.URL.startswith('http://127.0.0.1:'), AstrometryNet.URL
header = AstrometryNet.solve_from_image({frame!r}, verbose=False, solve_timeout=100)
header.totextfile({out!r}, overwrite=True)
stars = json.load(open({report!r}))
header = AstrometryNet.solve_from_source_list(
    [star['x'] + 1 for star in stars['stars']], [star['y'] + 1 for star in stars['stars']],
    stars['width'], stars['height'], verbose=False, solve_timeout=100, center_ra=10.0, center_dec=80.0, radius=5.0)
header.totextfile({out!r} + '.list', overwrite=True)
"""

ASTROMETRY_NET_CLIENT = """
import json
from astrometry_net_client import Client
client = Client(api_key='any', scale_units='degwidth', scale_lower=0.5, scale_upper=120.0)
job = client.upload_file({frame!r})
assert job.success(), job
job.wcs_file().totextfile({out!r}, overwrite=True)
info = job.info()
assert job.objects_in_field and job.machine_tags and job.calibration['radius'] > 0, info
for name in ('new_fits_file', 'rdls_file', 'axy_file', 'corr_file'):
    assert getattr(job, name)() is not None
assert job.annotated_display()[:2] == b'\\xff\\xd8'
assert job.extraction_image_display()[:4] == b'\\x89PNG'
assert job.red_green_image_display()[:4] == b'\\x89PNG'
"""


def main():
    program, client = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else ""
    frames = sys.argv[3:] or [str(ROOT / "fixtures/orion/orion.png"), str(ROOT / "fixtures/cygnus/cygnus.tif")]
    failed = False
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        server, address = start(program, folder / "jobs")
        try:
            for frame in frames:
                failed |= not check(program, client, address, frame, folder)
        finally:
            server.terminate()
            assert server.wait(60) == 0, "the server did not end well"
    return failed


def start(program, folder):
    command = [program, "serve", "--listen", "127.0.0.1:0", "--folder", str(folder)]
    server = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    for line in server.stderr:
        if found := re.search(r"listening on (http://\S+)", line):
            # Its log must go on.
            subprocess.Popen(["cat"], stdin=server.stderr, stdout=subprocess.DEVNULL)
            return server, found[1]
    raise SystemExit("the server did not start")


def check(program, client, address, frame, folder):
    name = pathlib.Path(frame).stem
    done = subprocess.run(
        [program, "process", "--quiet", "--format", "json", "--out", str(folder), frame], capture_output=True, check=True
    )
    report = folder / "report.json"
    report.write_bytes(done.stdout)
    expected = folder / f"{name}.wcs"
    size = json.loads(done.stdout)
    home = folder / "home"
    (home / ".astropy/config").mkdir(parents=True, exist_ok=True)
    (home / ".astropy/config/astroquery.cfg").write_text(f"[astrometry_net]\nserver = {address}\n")
    out = str(folder / "out")
    runs = [
        ("astroquery", ASTROQUERY, {}, ["", ".list"]),
        ("astrometry-net-client", ASTROMETRY_NET_CLIENT, {"http_proxy": address}, [""]),
    ]
    if client:
        options = ["--server", f"{address}/api/", "--apikey", "any", "--upload", frame, "--wcs", out]
        more = ["--newfits", out + ".new", "--corr", out + ".corr", "--annotate", out + ".json"]
        runs.append(("client.py", [client, *options, *more], {}, [""]))
    else:
        print("client.py: left out, it is not there")
    good = True
    for label, code, variables, results in runs:
        words = code if isinstance(code, list) else ["-c", code.format(frame=frame, out=out, report=str(report))]
        environment = {**os.environ, "HOME": str(home), "no_proxy": "", **variables}
        run = subprocess.run([sys.executable, *words], check=False, env=environment, capture_output=True, text=True, cwd=folder)
        if run.returncode != 0:
            print(f"{label}, {name}: failed\n{run.stdout[-2000:]}\n{run.stderr[-2000:]}")
            good = False
            continue
        for result in results:
            worst = difference_px(expected, out + result, size["width"], size["height"])
            # A list has no widths and errors of spots, so its fit is a little different.
            tolerance = 1.0 if result else TOLERANCE_PX
            print(f"{label}{result}, {name}: {worst:.4f} px from process")
            good &= worst < tolerance
    return good


def difference_px(expected, found, width, height):
    """The largest distance of places of the frame by one solution from those by the other."""
    from astropy.io import fits
    from astropy.wcs import WCS

    def read(path):
        content = pathlib.Path(path).read_bytes().decode("ascii", "replace")
        is_cards = "\n" not in content
        header = fits.Header.fromstring(content) if is_cards else fits.Header.fromtextfile(str(path))
        return WCS(header)

    import numpy

    x, y = numpy.meshgrid(numpy.linspace(0, width - 1, 9), numpy.linspace(0, height - 1, 9))
    there = read(expected).all_pix2world(x, y, 0)
    back = read(found).all_world2pix(*there, 0)
    return float(numpy.hypot(back[0] - x, back[1] - y).max())


if __name__ == "__main__":
    sys.exit(main())
