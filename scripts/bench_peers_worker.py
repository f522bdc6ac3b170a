"""The peers' side of bench-peers: reads orders as lines of JSON, answers each with a line.

usage: bench_peers_worker.py FROM:TO CACHE_DIR
"""

import json
import sys
import time
from pathlib import Path

import numpy
from PIL import Image

FROM, TO = (float(degrees) for degrees in sys.argv[1].split(":"))
# The solvers are given at most this many stars, the brightest.
MOST = 60
TETRA3RS_SIGMA = 5.0
SEP_SIGMA = {"sep": 1.5, "sep-5-sigma": 5.0}
# Pixels above the threshold, and parts of one source. The defaults are too few for a city, and more
# than needed take time.
SEP_PIXELS, SEP_PARTS = (300_000, 10_000_000), (1024, 100_000)


def clocked(work):
    start = time.perf_counter()
    result = work()
    return (time.perf_counter() - start) * 1e3, result


class Tetra3rs:
    def __init__(self):
        import sep
        import tetra3rs

        self.tetra3rs, self.sep = tetra3rs, sep
        cache = Path(sys.argv[2]) / f"tetra3rs_{FROM:g}_{TO:g}.bin"
        if cache.exists():
            self.database = tetra3rs.SolverDatabase.load_from_file(str(cache))
        else:
            self.database = tetra3rs.SolverDatabase.generate_from_gaia(max_fov_deg=TO, min_fov_deg=FROM)
            self.database.save_to_file(str(cache))
        self.extractor = tetra3rs.CentroidExtractor()

    def load(self, image):
        self.image = image
        self.floats = image.astype(numpy.float32)
        self.centroids = self.extract().centroids
        for pixels, parts in zip(SEP_PIXELS, SEP_PARTS):
            self.sep.set_extract_pixstack(pixels)
            self.sep.set_sub_object_limit(parts)
            try:
                self.of_sep(min(SEP_SIGMA.values()))
                break
            except Exception as error:
                if "overflow" not in str(error) and "full" not in str(error):
                    raise

    def extract(self):
        return self.extractor.extract(self.image, sigma_threshold=TETRA3RS_SIGMA)

    def solve(self, centroids):
        return self.database.solve_from_centroids(
            centroids[:MOST],
            fov_estimate_deg=(FROM + TO) / 2,
            fov_max_error_deg=(TO - FROM) / 2,
            image_shape=self.image.shape,
        )

    def as_centroids(self, stars):
        """Stars [x, y, flux] in pixels from the top-left one; tetra3rs counts from the centre."""
        height, width = self.image.shape
        centre = (width - 1) / 2, (height - 1) / 2
        return [self.tetra3rs.Centroid(x - centre[0], y - centre[1], flux) for x, y, flux in stars]

    def of_sep(self, sigma):
        background = self.sep.Background(self.floats)
        return self.sep.extract(self.floats - background.back(), sigma, err=background.globalrms)

    def do(self, order):
        what, program = order["do"], order["program"]
        if program in SEP_SIGMA:
            ms, found = clocked(lambda: self.of_sep(SEP_SIGMA[program]))
            return {"ms": ms, "found": len(found)}
        if program == "tetra3rs-fast":
            if what == "point":
                return self.solved(lambda: self.solve(self.extract_fast()))
            ms, found = clocked(self.extract_fast)
            return {"ms": ms, "found": len(found)}
        if what == "extract":
            ms, found = clocked(self.extract)
            return {"ms": ms, "found": len(found.centroids)}
        if what == "give":
            self.given = self.as_centroids(order["stars"])
            return {}
        if what in ("solve", "pointing"):
            centroids = self.centroids if what == "solve" else self.given
            return self.solved(lambda: self.solve(centroids))
        return self.solved(lambda: self.solve(self.extract().centroids))

    def extract_fast(self):
        found = self.tetra3rs.extract_centroids_fast(self.image)
        return getattr(found, "centroids", found)

    def solved(self, work):
        ms, solution = clocked(work)
        matches = getattr(solution, "num_matches", None)
        return {
            "ms": ms,
            "matches": matches,
            "rms_arcsec": getattr(solution, "rmse_arcsec", None),
            "solved": matches is not None,
        }


class CedarSolve:
    def __init__(self):
        import tetra3

        self.tetra3 = tetra3
        self.solver = tetra3.Tetra3()

    def load(self, image):
        self.image = image.astype(numpy.float32)
        self.centroids = self.extract()

    def extract(self):
        found = self.tetra3.get_centroids_from_image(self.image)
        return found[0] if isinstance(found, tuple) else found

    def do(self, order):
        if order["do"] == "extract":
            ms, found = clocked(self.extract)
            return {"ms": ms, "found": len(found)}
        stars = self.centroids[:30]
        ms, solution = clocked(
            lambda: self.solver.solve_from_centroids(stars, self.image.shape, solve_timeout=10000)
        )
        return {
            "ms": ms,
            "matches": solution.get("Matches"),
            "rms_arcsec": solution.get("RMSE"),
            "solved": solution.get("RA") is not None,
        }


def main():
    try:
        peer = Tetra3rs()
    except ImportError:
        peer = CedarSolve()
    for line in sys.stdin:
        order = json.loads(line)
        if order["do"] == "load":
            image = Image.open(order["path"])
            pixels = numpy.asarray(image)
            peer.load(pixels if pixels.ndim == 2 else numpy.asarray(image.convert("L")))
            answer = {}
        else:
            answer = peer.do(order)
        print(json.dumps(answer), flush=True)


main()
