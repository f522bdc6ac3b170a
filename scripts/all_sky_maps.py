"""The sky that `starpipe sky` states for a frame of all_sky.py, and the truth, cell by cell.

`compared` gives a row for each cell above 10° of altitude and one for the frame, `summary` their errors over the
stated ones. Limits are compared with which of the drawn stars that are alone are detected.
"""

import math

import all_sky
import numpy as np
from scipy import ndimage, optimize, special
from scipy.spatial import cKDTree

LOWEST_DEG = 10
MIN_PIXELS = 4
RING_DEG = 5
CLEAR_MAG = 0.2
# Stars with less light, in the noise of a pixel, and farther from detections than this are part of the sky.
FAINTEST_SEEN, ALONE_PX = 20, 2.5
METER_DEG, METER_REACH_DEG, MOON_REACH_DEG = 20, 30, 10
# Least width of the fall of completeness, in magnitudes: noise at a threshold of 8 standard deviations.
LEAST_WIDTH_MAG = 0.13
BANDS_DEG, LEAST_STARS = [(10, 90), (10, 20), (20, 40), (40, 90)], 300


def normal(z):
    return 0.5 * special.erfc(-z / math.sqrt(2))


class TrueSky:
    """The drawn sky of a frame, pixel by pixel."""

    def __init__(self, truth, maps):
        self.truth, self.stars = truth, maps
        size = truth["size_px"]
        lens = all_sky.Lens(
            truth["lens"], truth["focal_length_px"], truth["axis_px"], truth["terms"], math.radians(truth["field_deg"]), truth["stretch"]
        )
        self.y, self.x = np.mgrid[0:size, 0:size].astype(float)
        self.shown = ~np.isnan(maps["mag_arcsec2"])
        self.altitude_deg, self.azimuth_deg = maps["altitude_deg"].astype(float), maps["azimuth_deg"].astype(float)
        self.cloud_mag = maps["cloud_mag"].astype(float)
        self.light = 10 ** (-0.4 * maps["mag_arcsec2"].astype(float))
        self.solid_angle = all_sky.pixel_solid_angles(lens, self.x, self.y)
        off_axis = np.hypot(self.x - lens.axis_px[0], self.y - lens.axis_px[1]) / lens.radii_px[-1]
        passed = 1 - truth["vignetting"] * off_axis**2
        rate = 10 ** (0.4 * truth["zero_point_e_s"]) * truth["exposure_s"]
        sky = rate * self.light * self.solid_angle * passed
        # The size of a gray level.
        step_e = truth["gain_e_adu"] * truth.get("full_adu", truth["largest_level"]) / truth["largest_level"]
        variance = sky + truth["stray"] * np.nanmedian(sky) + truth["read_noise_e"] ** 2 + step_e**2 / 12
        self.noise_e = np.sqrt(variance)
        self.airmass = all_sky.airmass(np.radians(self.altitude_deg))
        self.rate = rate * passed
        # V of a star of one standard deviation of a pixel's noise.
        self.noise_vmag = 2.5 * np.log10(rate * passed / self.noise_e) - truth["extinction_mag"] * self.airmass - self.cloud_mag
        ring = np.where(self.shown, np.clip(self.altitude_deg // RING_DEG, 0, 17), -1)
        self.rings = [np.nonzero(ring == number) for number in range(18)]
        self.azimuths_deg = [self.azimuth_deg[pixels] for pixels in self.rings]

    def brightness(self, cell):
        """Magnitude of the mean light of a cell; none for few pixels."""
        pixels = self.inside(cell)
        if len(pixels[0]) < MIN_PIXELS:
            return None
        return -2.5 * math.log10(np.average(self.light[pixels], weights=self.solid_angle[pixels]))

    def add_faint_stars(self, found):
        """Adds the light of stars that are not detected: it is in the sky that a camera or a meter sees."""
        size = len(self.shown)
        places = np.c_[self.stars["x"], self.stars["y"]]
        column, row = np.clip(np.round(places).astype(int), 0, size - 1).T
        faint = self.stars["electrons"] < FAINTEST_SEEN * self.noise_e[row, column]
        if found["stars"]:
            detected = cKDTree([[star["x"], star["y"]] for star in found["stars"]])
            faint &= detected.query(places)[0] > ALONE_PX
        row, column = row[faint], column[faint]
        np.add.at(self.light, (row, column), self.stars["electrons"][faint] / (self.rate * self.solid_angle)[row, column])

    def inside(self, cell):
        """The rows and columns of the pixels of a cell."""
        ring = round(cell["altitude_deg"][0] / RING_DEG)
        start, end = cell["azimuth_deg"]
        chosen = (self.azimuths_deg[ring] >= start) & (self.azimuths_deg[ring] < end)
        return tuple(along[chosen] for along in self.rings[ring])

    def single_stars(self, found):
        """Rows, columns, V magnitudes by their light, and whether a detection has the name, of stars that are alone."""
        bright = self.stars["electrons"] > 0.02 * np.nanmedian(self.noise_e)
        places = np.c_[self.stars["x"], self.stars["y"]][bright]
        tree, light, size = cKDTree(places), self.stars["electrons"][bright], len(self.shown)
        vmag = self.stars["vmag"][bright]
        named = np.zeros(len(places), bool)
        for star in found["stars"]:
            near = tree.query_ball_point([star["x"], star["y"]], 3) if star["id"] else []
            same = [index for index in near if abs(vmag[index] - star["vmag"]) < 0.012]
            named[same[:1]] = True
        column, row = np.clip(np.round(places).astype(int), 0, size - 1).T
        over_noise = 2.5 * np.log10(self.noise_e[row, column] / light)
        is_inside = ndimage.distance_transform_edt(self.shown)[row, column] > 6
        chosen = np.flatnonzero(is_inside & (over_noise < np.nanquantile(over_noise[named], 0.95) + 1))
        near = tree.query_ball_point(places[chosen], 6.5)
        single = [all(other == star or light[other] < 0.4 * light[star] for other in around) for star, around in zip(chosen, near)]
        chosen = chosen[np.array(single)]
        row, column = row[chosen], column[chosen]
        return row, column, self.noise_vmag[row, column] + over_noise[chosen], named[chosen]

    def limits(self, found):
        """Altitude, by how much a star is brighter than the limit of its cell, the error of that, and whether it is detected."""
        limit, sigma, inside = (np.full(self.shown.shape, np.nan) for _ in range(3))
        for cell in found["sky"]["cells"]:
            pixels = self.inside(cell)
            if cell["limit_vmag"] is not None and cell["altitude_deg"][0] >= LOWEST_DEG and len(pixels[0]) >= MIN_PIXELS:
                limit[pixels], sigma[pixels] = cell["limit_vmag"], cell["limit_sigma_mag"]
                # A cell's limit is that of its middle.
                inside[pixels] = self.noise_vmag[pixels] - self.noise_vmag[pixels].mean()
        row, column, vmag, is_detected = self.single_stars(found)
        rows = np.c_[self.altitude_deg[row, column], (limit + inside)[row, column] - vmag, sigma[row, column], is_detected]
        return rows[np.isfinite(rows[:, 1])]

    def zenith_mag_arcsec2(self):
        """What a meter sees, without what is by the Moon."""
        off_deg = 90 - self.altitude_deg
        weight = np.where(self.shown & (off_deg < METER_REACH_DEG), np.exp(-4 * math.log(2) * (off_deg / METER_DEG) ** 2), 0)
        if self.truth["moon_direction"] is not None:
            toward = all_sky.from_angles(np.radians(self.azimuth_deg), np.radians(self.altitude_deg)) @ np.array(self.truth["moon_direction"])
            weight = np.where(toward > math.cos(math.radians(MOON_REACH_DEG)), 0, weight)
        weight = weight * self.solid_angle
        return -2.5 * math.log10(np.nansum(weight * self.light) / weight.sum())


def pair(value, sigma, right):
    """The error, and the stated one, of what is known."""
    return None if None in (value, sigma, right) else (value - right, sigma)


def zenith(sky, true):
    """The same for the light of the zenith."""
    stated = sky["zenith"] or {"mag_arcsec2": None, "sigma_mag": None}
    return pair(stated["mag_arcsec2"], stated["sigma_mag"], true.zenith_mag_arcsec2())


def brightness(sky, true):
    """The same for that of cells."""
    cells = (cell for cell in sky["cells"] if cell["altitude_deg"] is not None and cell["altitude_deg"][0] >= LOWEST_DEG)
    pairs = (pair(cell["mag_arcsec2"], cell["sigma_mag"], true.brightness(cell)) for cell in cells)
    return [found for found in pairs if found is not None]


def compared(found, truth, maps):
    """Rows of the cells, and the row of the frame, with errors and stated errors."""
    sky = found["sky"]
    true = TrueSky(truth, maps)
    true.add_faint_stars(found)
    rows, behind_sr, known_sr = [], 0.0, 0.0
    for cell in sky["cells"]:
        pixels = true.inside(cell)
        if len(pixels[0]) < MIN_PIXELS:
            continue
        weights = true.solid_angle[pixels] / true.solid_angle[pixels].sum()
        share = weights @ (true.cloud_mag[pixels] > CLEAR_MAG)
        if cell["clear"] is not None:
            known_sr += cell["solid_angle_sr"]
            behind_sr += cell["solid_angle_sr"] * share
        if cell["altitude_deg"][0] < LOWEST_DEG:
            continue
        cloud_mag = weights @ true.cloud_mag[pixels]
        rows.append({
            "clouds": truth["cloud_cover"] > 0, "altitude_deg": np.mean(cell["altitude_deg"]),
            "brightness": pair(cell["mag_arcsec2"], cell["sigma_mag"], true.brightness(cell)),
            "extinction": pair(cell["extinction_mag"], cell["extinction_sigma_mag"], cloud_mag),
            "clear": (cell["clear"], cell.get("clear_low"), cell.get("clear_high")), "is_clear": cloud_mag < CLEAR_MAG,
        })
    is_known = known_sr > 0
    return rows, {
        "clouds": truth["cloud_cover"] > 0,
        "limits": true.limits(found),
        "zenith": zenith(sky, true),
        "share": pair(sky["cloud_share"], sky["cloud_share_sigma"], behind_sr / known_sr) if is_known else None,
        "air": pair(sky["extinction_mag_per_airmass"], sky["extinction_sigma_mag"], truth["extinction_mag"]) if sky["extinction_measured"] else None,
    }


def told(name, pairs):
    """One line: number, mean and root mean square of the errors, and the latter in units of the stated ones."""
    errors = np.array([pair for pair in pairs if pair is not None])
    if not len(errors):
        return f"{name:<28} –"
    pulls = errors[:, 0] / errors[:, 1]
    return f"{name:<28} {len(errors):>6} {np.mean(errors[:, 0]):+.3f} {np.sqrt(np.mean(errors[:, 0]**2)):.3f} {np.sqrt(np.mean(pulls**2)):.2f}"


def told_limits(name, stars):
    """One line: number of stars, and what makes their detections likeliest: by how much stated limits are too faint, and their
    errors in units of the stated ones. Completeness falls over a width that is fitted, too."""
    _, brighter, sigma, is_detected = stars.T

    def cost(unknowns):
        offset, ln_width, ln_pull, lost = unknowns
        width = np.maximum(np.exp(ln_width), LEAST_WIDTH_MAG)
        z = (brighter - offset) / np.hypot(width, np.exp(ln_pull) * sigma)
        chance = np.clip((1 - special.expit(lost)) * normal(z), 1e-9, 1 - 1e-9)
        return -np.log(np.where(is_detected > 0, chance, 1 - chance)).sum()

    if len(stars) < LEAST_STARS:
        return f"{name:<28} –"
    best = optimize.minimize(cost, [0, math.log(0.2), 0, -3], method="Nelder-Mead", options={"maxiter": 4000, "maxfev": 4000})
    return f"{name:<28} {len(stars):>6} {best.x[0]:+.3f} {'':>5} {math.exp(best.x[2]):.2f}"


def summary(cells, frames):
    """Lines for people."""
    lines = ["", f"{'sky':<28} {'number':>6} {'mean':>6} {'RMS':>5} RMS over stated error"]
    groups = {
        "": lambda row: True, " without clouds": lambda row: not row["clouds"], " with clouds": lambda row: row["clouds"],
        " 10 to 20°": lambda row: row["altitude_deg"] < 20, " without clouds, to 20°": lambda row: row["altitude_deg"] < 20 and not row["clouds"],
    }
    for quantity in ("brightness", "extinction"):
        lines += [told(quantity + name, [row[quantity] for row in cells if belongs(row)]) for name, belongs in groups.items()]
    for name, belongs in list(groups.items())[:3]:
        stars = np.concatenate([row["limits"] for row in frames if belongs(row)] or [np.empty((0, 4))])
        for start, end in BANDS_DEG:
            lines.append(told_limits(f"limit{name}, {start} to {end}°", stars[(stars[:, 0] >= start) & (stars[:, 0] < end)]))
    for quantity in ("zenith", "share", "air"):
        lines += [told(quantity + name, [row[quantity] for row in frames if belongs(row)]) for name, belongs in list(groups.items())[:3]]
    lines += ["", "clear          cells   mean   band           share that is"]
    for tenth in range(10):
        chosen = [row for row in cells if row["clouds"] and row["clear"][0] is not None and min(int(row["clear"][0] * 10), 9) == tenth]
        if chosen:
            clear, low, high = np.mean([[math.nan if part is None else part for part in row["clear"]] for row in chosen], axis=0)
            share = np.mean([row["is_clear"] for row in chosen])
            lines.append(f"{tenth / 10:.1f} to {(tenth + 1) / 10:.1f} {len(chosen):>8}  {clear:.3f}  {low:.3f} to {high:.3f}  {share:.3f}")
    return "\n".join(lines)
