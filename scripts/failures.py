#!/usr/bin/env python3
"""Draws pictures in which no star field can be identified, and tables the reasons that starpipe gives.

    python3 scripts/failures.py target/release/starpipe [--keep DIRECTORY] [--kind KIND...] [--seed NUMBER]

Needs numpy and Pillow. Each kind is drawn several times, at other sizes, colors and bit depths, with noise and
JPEG artifacts, by code of its own: none of it is starpipe's simulator. Exits with 1 if a reason is not one of those
that are right for its kind.
"""

import argparse
import collections
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from PIL import Image, ImageDraw, ImageFont

SEED = 20260715
FONTS = ("DejaVuSans.ttf", "DejaVuSerif.ttf", "DejaVuSansMono.ttf", "LiberationSans-Regular.ttf", "Arial.ttf")

# The codes that are right for a kind. What no picture tells is not asked for: a narrow field without a header looks as
# random dots do.
RIGHT = {
    "moon": {"bright_disc"},
    # Behind clouds, the disc may have no edge, and the clouds no patches beside it.
    "veiled-moon": {"bright_disc", "clouds", "too_few_stars"},
    "sun": {"bright_disc", "daylight"},
    "lamp": {"bright_disc"},
    "startrails": {"star_trails"},
    "drift": {"trails"},
    "drawing": {"drawing"},
    "text": {"drawing"},
    "planetarium": {"labels"},
    "clouds": {"clouds", "too_few_stars"},
    "day": {"daylight"},
    "black": {"black"},
    "empty": {"no_variation"},
    "defocus": {"out_of_focus"},
    "aurora": {"aurora"},
    "few": {"too_few_stars"},
    "narrow": {"no_match"},
    "narrow-stated": {"too_narrow"},
    "mosaic": {"mosaic"},
    "overexposed": {"saturated"},
    "random": {"no_match"},
    "negative": {"negative"},
}


class Canvas:
    """A picture as light in each of three colors, 1 at full scale."""

    def __init__(self, rng, width, height, sky=(0.05, 0.05, 0.06)):
        self.rng, self.width, self.height = rng, width, height
        self.y, self.x = np.mgrid[0:height, 0:width].astype(np.float32)
        self.light = np.empty((height, width, 3), np.float32)
        self.light[:] = sky

    def add(self, layer, color=(1, 1, 1)):
        """Adds light with a color."""
        self.light += layer[..., None].astype(np.float32) * np.array(color, np.float32)

    def spot(self, x, y, peak, sigma, color=(1, 1, 1)):
        """Adds a round Gaussian."""
        reach = int(5 * sigma + 2)
        left, top = max(0, int(x) - reach), max(0, int(y) - reach)
        part = (slice(top, int(y) + reach + 1), slice(left, int(x) + reach + 1))
        squared = (self.x[part] - x) ** 2 + (self.y[part] - y) ** 2
        layer = peak * np.exp(-squared / (2 * sigma**2))
        self.light[part] += layer[..., None] * np.array(color, np.float32)

    def stars(self, count, faintest=0.02, sigma=1.2, slope=0.4, border=5):
        """Adds stars at random places, many faint ones and few bright ones."""
        for _ in range(count):
            x = self.rng.uniform(border, self.width - border)
            y = self.rng.uniform(border, self.height - border)
            peak = min(faintest * self.rng.uniform(1e-4, 1) ** (-slope), 3.0)
            self.spot(x, y, peak, sigma, self.rng.uniform(0.8, 1.2, 3))

    def noise(self, read=0.004, shot=0.004):
        """Adds the noise of a detector."""
        sigma = np.sqrt(read**2 + shot**2 * np.clip(self.light, 0, None) * 10)
        self.light += self.rng.normal(0, 1, self.light.shape).astype(np.float32) * sigma.astype(np.float32)

    def turbulence(self, coarsest, roughness=0.55, stretch=1.0):
        """Smooth random structure with a mean of 0 and a standard deviation of 1."""
        total = np.zeros((self.height, self.width), np.float32)
        cell, gain = float(coarsest), 1.0
        while cell > 3:
            size = (int(self.width / cell) + 3, int(self.height / (cell / stretch)) + 3)
            layer = Image.fromarray(self.rng.normal(0, 1, size[::-1]).astype(np.float32))
            layer = layer.resize((self.width, self.height), Image.Resampling.BICUBIC)
            total += gain * np.asarray(layer)
            cell, gain = cell / 2, gain * roughness
        return (total - total.mean()) / total.std()


class Drawn:
    """A picture, and how it is to be written."""

    def __init__(self, kind, name, picture, suffix=".png", **how):
        self.kind, self.name, self.picture, self.suffix, self.how = kind, name, picture, suffix, how

    def save(self, directory):
        """Writes it, and returns its path."""
        path = directory / f"{self.name}{self.suffix}"
        picture = self.picture
        if isinstance(picture, Canvas):
            picture = develop(picture.light, self.how.pop("mode", "RGB"), self.how.pop("gamma", 1.0))
        options = {"quality": self.how["quality"]} if "quality" in self.how else {}
        picture.save(path, **options)
        return path


def develop(light, mode, gamma):
    """Light as a picture of 8 or 16 bits."""
    light = np.clip(light, 0, 1) ** (1 / gamma)
    if mode == "RGB":
        return Image.fromarray((255 * light + 0.5).astype(np.uint8))
    gray = light @ np.array([0.3, 0.59, 0.11], np.float32)
    if mode == "L":
        return Image.fromarray((255 * gray + 0.5).astype(np.uint8))
    return Image.fromarray((65535 * gray + 0.5).astype(np.uint16))


def font(size, which=0):
    """A font that this machine has."""
    for name in FONTS[which:] + FONTS[:which]:
        try:
            return ImageFont.truetype(name, size)
        except OSError:
            continue
    return ImageFont.load_default(size)


def smooth_step(distance, width):
    """1 inside, 0 outside, with an edge of this width."""
    return np.clip(0.5 - distance / width, 0, 1)


def moon_disc(canvas, x, y, radius, phase_deg, turn_deg, brightness, maria=True):
    """Light of a Moon: a sphere lit from one side. Phase 0 is new, 180 full."""
    u, v = (canvas.x - x) / radius, (canvas.y - y) / radius
    turn = math.radians(turn_deg)
    along, across = u * math.cos(turn) + v * math.sin(turn), -u * math.sin(turn) + v * math.cos(turn)
    depth = np.sqrt(np.clip(1 - along**2 - across**2, 0, None))
    phase = math.radians(phase_deg)
    lit = np.clip(along * math.sin(phase) - depth * math.cos(phase), 0, None)
    lit = np.where(lit > 0, 0.35 + 0.65 * lit, 0)
    if maria:
        lit = lit * (1 + 0.15 * np.clip(canvas.turbulence(radius / 1.5), -2, 2))
    return brightness * lit * smooth_step(radius * (np.hypot(along, across) - 1), 1.5)


def glow(canvas, x, y, peak, size, power=2.0):
    """Light scattered around a lamp or the Moon."""
    return peak / (1 + (np.hypot(canvas.x - x, canvas.y - y) / size) ** power)


def moons(rng):
    """Moons of several phases, the Sun, and lamps."""
    canvas = Canvas(rng, 1000, 750, (0.02, 0.02, 0.03))
    canvas.add(moon_disc(canvas, 520, 330, 150, 50, 20, 0.8))
    canvas.add(glow(canvas, 560, 330, 0.05, 80))
    canvas.noise()
    yield Drawn("moon", "moon-crescent", canvas, ".jpg", quality=88)
    canvas = Canvas(rng, 1280, 960, (0.01, 0.01, 0.01))
    canvas.add(moon_disc(canvas, 600, 480, 330, 95, -30, 0.75))
    canvas.noise(0.01)
    yield Drawn("moon", "moon-half", canvas, mode="L")
    canvas = Canvas(rng, 900, 900, (0.004, 0.004, 0.004))
    canvas.add(moon_disc(canvas, 450, 450, 360, 176, 0, 0.7))
    canvas.noise(0.003)
    yield Drawn("moon", "moon-full", canvas, ".tif", mode="I;16")
    canvas = Canvas(rng, 1500, 1000, (0.06, 0.07, 0.1))
    canvas.add(glow(canvas, 1010, 300, 1.6, 28, 1.8), (1, 0.97, 0.9))
    canvas.stars(20, 0.05)
    canvas.noise(0.008)
    yield Drawn("moon", "moon-glow", canvas, ".jpg", quality=80)
    canvas = Canvas(rng, 1100, 800, (0.05, 0.05, 0.06))
    veil = np.clip(1 + 0.5 * canvas.turbulence(300), 0.1, None)
    canvas.add(veil * glow(canvas, 400, 420, 0.6, 120, 2.2), (1, 0.95, 0.85))
    canvas.add(moon_disc(canvas, 400, 420, 36, 150, 10, 2.0, maria=False))
    canvas.noise(0.01)
    yield Drawn("veiled-moon", "moon-clouds", canvas, ".jpg", quality=85)
    canvas = Canvas(rng, 800, 600, (0.01, 0.005, 0.0))
    disc = smooth_step(np.hypot(canvas.x - 380, canvas.y - 310) - 170, 2)
    limb = np.sqrt(np.clip(1 - ((canvas.x - 380) ** 2 + (canvas.y - 310) ** 2) / 172**2, 0, 1))
    canvas.add(disc * (0.4 + 0.4 * limb), (1, 0.6, 0.2))
    canvas.noise(0.004)
    yield Drawn("sun", "sun-filter", canvas, ".jpg", quality=92)
    canvas = Canvas(rng, 1200, 800, (0.25, 0.4, 0.7))
    canvas.add(glow(canvas, 900, 200, 2.5, 60, 1.6), (1, 0.95, 0.8))
    canvas.noise(0.004)
    yield Drawn("sun", "sun-sky", canvas, ".jpg", quality=90)
    canvas = Canvas(rng, 1200, 900, (0.02, 0.02, 0.03))
    canvas.add(glow(canvas, 300, 250, 3.0, 30, 2.0), (1, 0.75, 0.35))
    for angle in (0.3, 0.3 + math.pi / 3, 0.3 + 2 * math.pi / 3):
        across = (canvas.x - 300) * math.sin(angle) - (canvas.y - 250) * math.cos(angle)
        along = (canvas.x - 300) * math.cos(angle) + (canvas.y - 250) * math.sin(angle)
        canvas.add(0.8 * np.exp(-np.abs(across) / 2) * np.exp(-np.abs(along) / 90), (1, 0.8, 0.5))
    canvas.light[600:, :] *= 0.3
    canvas.light[520:, 700:760] = 0.03
    canvas.noise(0.006)
    yield Drawn("lamp", "street-lamp", canvas, ".jpg", quality=85)
    canvas = Canvas(rng, 1000, 700, (0.03, 0.025, 0.02))
    for x, y, size in ((200, 350, 26), (520, 330, 18), (790, 318, 12)):
        canvas.add(glow(canvas, x, y, 3.0, size, 2.2), (1, 0.8, 0.5))
    canvas.noise(0.006)
    yield Drawn("lamp", "street-lamps", canvas, mode="L")


def arcs(canvas, pole, turn_deg, count, faintest, sigma=1.1, far=None):
    """Star trails around a pole, each brighter or fainter than another."""
    far = far or math.hypot(canvas.width, canvas.height)
    picture = np.zeros((canvas.height, canvas.width), np.float32)
    for _ in range(count):
        radius, start = far * math.sqrt(canvas.rng.uniform(0.0003, 1)), canvas.rng.uniform(0, 360)
        peak = min(faintest * canvas.rng.uniform(1e-3, 1) ** -0.5, 0.9)
        steps = max(int(radius * math.radians(turn_deg) * 2), 2)
        angles = np.radians(start + np.linspace(0, turn_deg, steps))
        x, y = pole[0] + radius * np.cos(angles), pole[1] + radius * np.sin(angles)
        inside = (x > 0) & (x < canvas.width - 1) & (y > 0) & (y < canvas.height - 1)
        x, y = x[inside], y[inside]
        left, top = x.astype(int), y.astype(int)
        right, below = x - left, y - top
        for dx, dy, share in (
            (0, 0, (1 - right) * (1 - below)), (1, 0, right * (1 - below)),
            (0, 1, (1 - right) * below), (1, 1, right * below),
        ):
            np.add.at(picture, (top + dy, left + dx), peak * share)
    blurred = picture
    kernel = np.exp(-np.arange(-4, 5) ** 2 / (2 * sigma**2))
    for axis in (0, 1):
        blurred = sum(k * np.roll(blurred, i - 4, axis) for i, k in enumerate(kernel / kernel.sum()))
    canvas.add(blurred)


def startrails(rng):
    """Trails around a pole, and of a camera that drifts."""
    for name, size, pole, turn, count, how in (
        ("05", (1200, 900), (600, 450), 5, 260, {"suffix": ".jpg", "quality": 92}),
        ("10", (1000, 800), (300, 640), 10, 220, {"mode": "L"}),
        ("15-off", (1100, 800), (1500, -300), 15, 500, {"suffix": ".tif", "mode": "I;16"}),
        ("20", (1600, 1200), (900, 500), 20, 300, {"suffix": ".jpg", "quality": 80}),
        ("40", (900, 900), (450, 300), 40, 120, {}),
        ("60", (1400, 900), (700, 820), 60, 150, {"suffix": ".jpg", "quality": 85}),
    ):
        canvas = Canvas(rng, *size, (0.04, 0.045, 0.06))
        canvas.light *= (1 + 0.4 * canvas.y / canvas.height)[..., None]
        far = math.hypot(*size) if "off" not in name else 2000
        arcs(canvas, pole, turn, count, 0.06, far=far)
        if name in ("20", "60"):
            trees = canvas.y > size[1] * 0.85 + 30 * canvas.turbulence(120)[0][None, :]
            canvas.light[trees] = 0.01
        canvas.noise(0.006)
        yield Drawn("startrails", f"startrails-{name}", canvas, **how)
    for name, size, angle, length, how in (
        ("level", (1000, 700), 4, 60, {"suffix": ".jpg", "quality": 85}),
        ("slant", (800, 800), 62, 110, {"mode": "L"}),
        ("wiggle", (1200, 800), -35, 45, {"suffix": ".tif", "mode": "I;16"}),
    ):
        canvas = Canvas(rng, *size, (0.05, 0.05, 0.06))
        path = np.linspace(-0.5, 0.5, 3 * length)
        dx, dy = length * path * math.cos(math.radians(angle)), -length * path * math.sin(math.radians(angle))
        if name == "wiggle":
            dx, dy = dx + 2 * np.sin(9 * path), dy + 2 * np.cos(9 * path)
        for _ in range(45):
            x, y = rng.uniform(80, size[0] - 80), rng.uniform(80, size[1] - 80)
            peak = 0.05 * rng.uniform(1e-2, 1) ** -0.5 * 1.2
            for step_x, step_y in zip(dx, dy):
                canvas.spot(x + step_x, y + step_y, peak / 3, 1.2)
        canvas.noise(0.006)
        yield Drawn("drift", f"drift-{name}", canvas, **how)


def paper(rng, picture, level, contrast, noise, turn=0.0):
    """A picture as a scanner or a telephone sees it on paper."""
    ink = np.asarray(picture.rotate(turn, fillcolor=255, resample=Image.Resampling.BICUBIC).convert("L")) / 255
    canvas = Canvas(rng, ink.shape[1], ink.shape[0])
    shade = level * (1 - 0.12 * canvas.x / canvas.width + 0.05 * canvas.y / canvas.height)
    canvas.light[:] = (shade * (1 - contrast * (1 - ink)))[..., None]
    canvas.light += rng.normal(0, noise, canvas.light.shape[:2])[..., None]
    return canvas


def drawings(rng):
    """Drawings of lines."""
    picture = Image.new("RGB", (900, 700), "white")
    draw = ImageDraw.Draw(picture)
    draw.rectangle((200, 300, 520, 600), outline="black", width=3)
    draw.line((180, 300, 360, 160, 540, 300), fill="black", width=3)
    draw.rectangle((320, 450, 400, 600), outline="black", width=2)
    draw.ellipse((650, 60, 780, 190), outline="orange", width=4)
    for x in range(620, 860, 60):
        draw.line((x, 600, x, 470), fill="brown", width=3)
        draw.ellipse((x - 35, 380, x + 35, 480), outline="green", width=3)
    yield Drawn("drawing", "drawing-house", picture)
    picture = Image.new("L", (1200, 900), 255)
    draw = ImageDraw.Draw(picture)
    for _ in range(14):
        points = np.cumsum(rng.normal(0, 60, (12, 2)), axis=0) + rng.uniform((200, 200), (1000, 700))
        draw.line([tuple(p) for p in points], fill=20, width=4, joint="curve")
    yield Drawn("drawing", "drawing-pen", paper(rng, picture, 0.85, 0.75, 0.012, 1.5), ".jpg", quality=85)
    picture = Image.new("RGB", (1000, 800), (245, 240, 225))
    draw = ImageDraw.Draw(picture)
    places = rng.uniform((60, 60), (940, 740), (30, 2))
    for a, b in zip(places[:-1:2], places[1::2]):
        draw.line((*a, *b), fill=(60, 60, 140), width=2)
    for x, y in places:
        size = rng.uniform(2, 7)
        draw.ellipse((x - size, y - size, x + size, y + size), fill=(20, 20, 60))
    yield Drawn("drawing", "drawing-figures", picture, ".jpg", quality=75)
    picture = Image.new("L", (1100, 800), 12)
    draw = ImageDraw.Draw(picture)
    for step in range(9):
        draw.line((100 + 110 * step, 80, 100 + 110 * step, 720), fill=70)
        draw.line((100, 80 + 80 * step, 980, 80 + 80 * step), fill=70)
    for phase in (0.0, 1.0, 2.2):
        points = [(100 + x, 400 - 250 * math.sin(x / 90 + phase)) for x in range(0, 881, 4)]
        draw.line(points, fill=230, width=3)
    yield Drawn("drawing", "drawing-plot", picture)


WORDS = ["the", "night", "sky", "of", "winter", "shows", "many", "bright", "stars", "and", "their", "names", "are", "old", "in", "most", "of", "the", "languages", "that", "people", "speak", "while", "a", "camera", "on", "a", "fixed", "mount", "sees", "them", "drift", "across", "its", "detector", "at", "a", "quarter", "of", "a", "degree", "a", "minute"]


def write_lines(draw, rng, left, top, lines, step, letters, color, columns):
    """Lines of words."""
    for line in range(lines):
        words = ""
        while len(words) < columns * rng.uniform(0.6, 1):
            words += rng.choice(WORDS) + " "
        fill = color[line % len(color)] if isinstance(color, list) else color
        draw.text((left, top + line * step), words, font=letters, fill=fill)


def texts(rng):
    """Pages and screens of text."""
    picture = Image.new("L", (1000, 1300), 255)
    write_lines(ImageDraw.Draw(picture), rng, 90, 90, 36, 31, font(20, 1), 15, 70)
    yield Drawn("text", "text-scan", paper(rng, picture, 0.9, 0.85, 0.015, 0.8), ".jpg", quality=80)
    picture = Image.new("L", (800, 1000), 255)
    write_lines(ImageDraw.Draw(picture), rng, 60, 60, 45, 19, font(13), 0, 80)
    yield Drawn("text", "text-page", picture)
    picture = Image.new("RGB", (1280, 800), (30, 30, 36))
    draw = ImageDraw.Draw(picture)
    draw.rectangle((0, 0, 220, 800), fill=(40, 40, 48))
    draw.rectangle((0, 770, 1280, 800), fill=(0, 100, 180))
    colors = [(210, 210, 210), (120, 180, 250), (220, 150, 110), (110, 160, 90)]
    write_lines(draw, rng, 260, 20, 36, 20, font(15, 2), colors, 75)
    write_lines(draw, rng, 15, 40, 20, 24, font(13), (190, 190, 190), 15)
    yield Drawn("text", "text-editor-dark", picture)
    picture = Image.new("RGB", (1440, 900), "white")
    draw = ImageDraw.Draw(picture)
    draw.rectangle((0, 0, 1440, 40), fill=(225, 225, 228))
    write_lines(draw, rng, 80, 60, 32, 25, font(17, 2), [(20, 20, 20), (130, 0, 130), (0, 0, 200)], 90)
    yield Drawn("text", "text-editor-light", picture, ".jpg", quality=70)


NAMES = ["Sirius", "Canopus", "Arcturus", "Vega", "Capella", "Rigel", "Procyon", "Achernar", "Betelgeuse", "Hadar", "Altair", "Aldebaran", "Antares", "Spica", "Pollux", "Fomalhaut", "Deneb", "Mimosa", "Regulus", "Adhara", "Castor", "Shaula", "Bellatrix", "Elnath", "Alnilam", "Alnair", "Alioth", "Dubhe"]


def planetariums(rng):
    """Screens of a planetarium program: stars, lines, a grid and labels."""
    for name, size, sky, has_grid, letters, how in (
        ("grid", (1280, 800), (4, 6, 20), True, 14, {}),
        ("figures", (1600, 900), (0, 0, 0), False, 16, {"suffix": ".jpg", "quality": 85}),
        ("gradient", (1000, 750), (10, 15, 40), True, 13, {"suffix": ".jpg", "quality": 92}),
        ("gray", (900, 700), (20, 20, 20), False, 15, {}),
    ):
        level = np.zeros((size[1], size[0], 3), np.float32) + sky
        if name == "gradient":
            level *= (1 + 2 * np.linspace(0, 1, size[1]) ** 2)[:, None, None]
        picture = Image.fromarray(level.astype(np.uint8))
        draw = ImageDraw.Draw(picture)
        if has_grid:
            for radius in range(150, 1500, 170):
                x, y = size[0] * 0.4, -80
                draw.ellipse((x - radius, y - radius, x + radius, y + radius), outline=(50, 70, 110))
            for angle in np.linspace(0, math.pi, 17):
                draw.line((x, y, x + 1600 * math.cos(angle), y + 1600 * math.sin(angle)), fill=(50, 70, 110))
        bright = rng.uniform((30, 30), (size[0] - 110, size[1] - 30), (26, 2))
        for a, b in zip(bright[:-1:2], bright[1::2]):
            if math.dist(a, b) < 400:
                draw.line((*a, *b), fill=(70, 90, 130))
        for x, y in rng.uniform((0, 0), size, (350, 2)):
            peak, radius = int(rng.uniform(60, 200)), rng.uniform(0.4, 1.2)
            draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=(peak, peak, peak))
        for (x, y), star in zip(bright, NAMES):
            radius = rng.uniform(2, 4.5)
            draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=(255, 255, 245))
            draw.text((x + 7, y - 6), star, font=font(letters), fill=(150, 170, 210))
        if name == "gray":
            picture = picture.convert("L")
        yield Drawn("planetarium", f"planetarium-{name}", picture, **how)


def clouds(rng):
    """Clouds, with few stars between them or none."""
    for name, size, level, depth, stars, color, how in (
        ("thick", (1200, 900), 0.2, 0.35, 0, (1, 0.9, 0.8), {"suffix": ".jpg", "quality": 88}),
        ("gaps", (1000, 800), 0.15, 0.6, 9, (1, 1, 1), {"mode": "L"}),
        ("streets", (1400, 800), 0.12, 0.45, 5, (1, 0.85, 0.7), {"suffix": ".jpg", "quality": 80}),
        ("dark", (900, 700), 0.06, 0.5, 4, (1, 1, 1), {"suffix": ".tif", "mode": "I;16"}),
        ("moonlit", (1300, 900), 0.3, 0.4, 6, (0.9, 0.97, 1.05), {"suffix": ".jpg", "quality": 92}),
    ):
        canvas = Canvas(rng, *size, (0, 0, 0))
        stretch = 3.0 if name == "streets" else 1.0
        cover = canvas.turbulence(size[0] / 3, 0.5, stretch)
        canvas.add(level * np.clip(1 + depth * cover, 0.15, None), color)
        for _ in range(stars):
            canvas.spot(rng.uniform(20, size[0] - 20), rng.uniform(20, size[1] - 20), rng.uniform(0.1, 0.5), 1.3)
        canvas.noise(0.006)
        yield Drawn("clouds", f"clouds-{name}", canvas, **how)


def days(rng):
    """Scenes by day."""
    def scene(width, height, top, bottom):
        canvas = Canvas(rng, width, height)
        share = (canvas.y / height)[..., None]
        canvas.light[:] = np.array(top, np.float32) * (1 - share) + np.array(bottom, np.float32) * share
        return canvas

    canvas = scene(1200, 900, (0.25, 0.45, 0.85), (0.6, 0.75, 0.95))
    canvas.noise(0.004)
    yield Drawn("day", "day-sky", canvas, ".jpg", quality=90)
    canvas = scene(1200, 800, (0.3, 0.5, 0.9), (0.7, 0.8, 0.95))
    cover = np.clip(canvas.turbulence(350) - 0.4, 0, 1)[..., None]
    canvas.light = canvas.light * (1 - cover) + cover * np.float32(0.93)
    canvas.noise(0.004)
    yield Drawn("day", "day-clouds", canvas, ".jpg", quality=85)
    canvas = scene(1000, 750, (0.3, 0.5, 0.85), (0.65, 0.78, 0.95))
    land = canvas.y > 480 + 50 * canvas.turbulence(250)[0][None, :]
    texture = np.clip(0.3 + 0.12 * canvas.turbulence(30, 0.8), 0.02, 1)
    canvas.light[land] = texture[land][:, None] * np.array((0.7, 1.0, 0.4), np.float32)
    canvas.noise(0.006)
    yield Drawn("day", "day-landscape", canvas, ".jpg", quality=88)
    canvas = scene(900, 1200, (0.15, 0.28, 0.55), (0.75, 0.6, 0.5))
    house = (canvas.y > 800) & (canvas.x > 250) & (canvas.x < 700)
    canvas.light[house] = (0.5, 0.35, 0.3)
    for x in range(290, 660, 90):
        canvas.light[880:960, x : x + 50] = (0.12, 0.12, 0.16)
    canvas.light[1050:] = (0.3, 0.3, 0.28)
    canvas.noise(0.008)
    yield Drawn("day", "day-house", canvas, ".jpg", quality=82)


def blacks(rng):
    """A covered lens."""
    canvas = Canvas(rng, 1000, 800, (0.008, 0.008, 0.008))
    canvas.noise(0.003, 0)
    yield Drawn("black", "black-noise", canvas, mode="L")
    canvas = Canvas(rng, 1200, 900, (0.015, 0.015, 0.015))
    for _ in range(300):
        x, y = rng.integers(0, 1200), rng.integers(0, 900)
        canvas.light[y, x] = rng.uniform(0.05, 1)
    canvas.noise(0.003, 0)
    yield Drawn("black", "black-hot-pixels", canvas, ".tif", mode="I;16")
    canvas = Canvas(rng, 1500, 1000, (0.0, 0.0, 0.0))
    canvas.noise(0.005, 0)
    yield Drawn("black", "black-cut-off", canvas, ".jpg", quality=85)
    canvas = Canvas(rng, 800, 600, (0.02, 0.02, 0.02))
    canvas.add(0.01 * np.exp(-canvas.x / 120))
    canvas.noise(0.002, 0)
    yield Drawn("black", "black-amplifier-glow", canvas, ".tif", mode="I;16")
    yield Drawn("empty", "black-zero", Image.new("L", (640, 480), 0))


def defocused(rng):
    """Stars out of focus: discs, and rings where a mirror has a hole."""
    for name, size, radius, hole, count, soft, how in (
        ("discs", (1000, 800), 16, 0.0, 22, 2, {"mode": "L"}),
        ("rings", (1200, 900), 22, 0.4, 16, 2, {"suffix": ".tif", "mode": "I;16"}),
        ("large", (1600, 1200), 45, 0.0, 14, 4, {"suffix": ".jpg", "quality": 85}),
        ("small", (900, 700), 9, 0.0, 40, 2, {"suffix": ".jpg", "quality": 90}),
        ("soft", (1000, 700), 14, 0.0, 25, 9, {}),
    ):
        canvas = Canvas(rng, *size, (0.05, 0.05, 0.06))
        for _ in range(count):
            x, y = rng.uniform(radius, size[0] - radius), rng.uniform(radius, size[1] - radius)
            distance = np.hypot(canvas.x - x, canvas.y - y)
            disc = smooth_step(distance - radius, soft) * (1 - smooth_step(distance - hole * radius, soft) * (hole > 0))
            canvas.add(min(0.05 * rng.uniform(0.005, 1) ** -0.5, 0.8) * disc)
        canvas.noise(0.006)
        yield Drawn("defocus", f"defocus-{name}", canvas, **how)


def auroras(rng):
    """Curtains of green light."""
    for name, size, gain, red, stars, how in (
        ("curtain", (1200, 800), 0.5, 0.0, 8, {"suffix": ".jpg", "quality": 88}),
        ("bands", (1500, 1000), 0.35, 0.1, 0, {"suffix": ".jpg", "quality": 80}),
        ("strong", (1000, 1000), 0.9, 0.3, 4, {}),
        ("faint", (900, 600), 0.15, 0.0, 6, {"suffix": ".jpg", "quality": 92}),
    ):
        canvas = Canvas(rng, *size, (0.02, 0.03, 0.05))
        width, height = size
        for _ in range(3):
            base = height * rng.uniform(0.45, 0.75) + 0.1 * height * np.sin(canvas.x / width * rng.uniform(4, 9) + rng.uniform(0, 6))
            rays = np.clip(1 + 0.4 * canvas.turbulence(60)[:1], 0.2, None)
            above = np.clip(base - canvas.y, 0, None) / (0.25 * height)
            below = np.clip(canvas.y - base, 0, None) / (0.03 * height)
            curtain = gain * rays * np.exp(-above - below)
            canvas.add(curtain, (0.25, 1, 0.4))
            canvas.add(red * curtain * np.clip(above, 0, 1), (1, 0.1, 0.5))
        canvas.stars(stars, 0.1)
        canvas.noise(0.006)
        yield Drawn("aurora", f"aurora-{name}", canvas, **how)


def fews(rng):
    """Few stars on a sky that shows no more."""
    for name, size, count, how in (
        ("3", (800, 600), 3, {"mode": "L"}),
        ("4", (1000, 800), 4, {"suffix": ".jpg", "quality": 90}),
        ("5", (1200, 900), 5, {"suffix": ".tif", "mode": "I;16"}),
        ("6", (1000, 700), 6, {"suffix": ".jpg", "quality": 85}),
    ):
        canvas = Canvas(rng, *size, (0.06, 0.06, 0.07))
        for _ in range(count):
            x, y = rng.uniform(30, size[0] - 30), rng.uniform(30, size[1] - 30)
            canvas.spot(x, y, rng.uniform(0.15, 0.8), 1.4)
        canvas.noise(0.006)
        yield Drawn("few", f"few-{name}", canvas, **how)


def fields(rng):
    """Fields of 0.3° with faint stars only, and dots that are no sky."""
    for kind, name, size, count, slope, sigma, how in (
        ("narrow", "narrow-cluster", (1000, 800), 60, 0.25, 1.8, {"suffix": ".tif", "mode": "I;16"}),
        ("narrow", "narrow-sparse", (1200, 900), 25, 0.3, 2.2, {"mode": "L"}),
        ("narrow", "narrow-jpeg", (900, 900), 45, 0.3, 1.5, {"suffix": ".jpg", "quality": 85}),
        ("random", "random-gray", (800, 600), 50, 0.4, 1.2, {"mode": "L"}),
        ("random", "random-color", (1200, 800), 120, 0.45, 1.3, {"suffix": ".jpg", "quality": 88}),
        ("random", "random-deep", (1000, 1000), 300, 0.4, 1.1, {"suffix": ".tif", "mode": "I;16"}),
        ("random", "random-bright", (1500, 1000), 30, 0.6, 1.5, {}),
    ):
        canvas = Canvas(rng, *size, (0.05, 0.05, 0.06))
        canvas.stars(count, 0.06, sigma, slope)
        canvas.noise(0.005)
        yield Drawn(kind, name, canvas, **how)


def mosaics(rng):
    """Several pictures in one."""
    for name, parts, size, gap, how in (
        ("2x2", (2, 2), (500, 400), 0, {"suffix": ".jpg", "quality": 88}),
        ("3x3", (3, 3), (360, 300), 0, {"mode": "L"}),
        ("2x2-frames", (2, 2), (600, 450), 8, {"suffix": ".jpg", "quality": 85}),
        ("3x2", (3, 2), (400, 500), 0, {"suffix": ".tif", "mode": "I;16"}),
    ):
        rows = []
        for _ in range(parts[1]):
            row = []
            for _ in range(parts[0]):
                canvas = Canvas(rng, *size, rng.uniform(0.03, 0.18, 3))
                canvas.light *= (1 + rng.uniform(-0.3, 0.3) * canvas.x / size[0])[..., None]
                canvas.stars(25, 0.06)
                canvas.noise(0.006)
                row.append(np.pad(canvas.light, ((gap, gap), (gap, gap), (0, 0)), constant_values=1.0))
            rows.append(np.concatenate(row, axis=1))
        light = np.concatenate(rows, axis=0)
        canvas = Canvas(rng, light.shape[1], light.shape[0])
        canvas.light = light
        yield Drawn("mosaic", f"mosaic-{name}", canvas, **how)


def overexposed(rng):
    """Too much light."""
    for name, size, level, how in (
        ("white", (800, 600), 1.2, {"mode": "L"}),
        ("bright", (1200, 800), 0.97, {"suffix": ".jpg", "quality": 90}),
        ("half", (1000, 800), 0.9, {"suffix": ".tif", "mode": "I;16"}),
    ):
        canvas = Canvas(rng, *size, (level, level, level))
        if name == "half":
            canvas.light *= (0.5 + canvas.x / size[0])[..., None]
        canvas.stars(30, 0.1)
        canvas.noise(0.02)
        yield Drawn("overexposed", f"overexposed-{name}", canvas, **how)


def negatives(rng):
    """A negative of a sky, with noise."""
    canvas = Canvas(rng, 1000, 800, (0.1, 0.1, 0.1))
    canvas.stars(60, 0.08)
    canvas.noise(0.006)
    canvas.light = 1 - canvas.light
    yield Drawn("negative", "negative", canvas, ".jpg", quality=92)


PARTS = (
    moons, startrails, drawings, texts, planetariums, clouds, days, blacks, defocused, auroras, fews, fields, mosaics,
    overexposed, negatives,
)


def draw_all(directory, kinds, seed=SEED):
    """Draws the pictures of these kinds, or all, and returns kind and path of each."""
    drawn = []
    for number, part in enumerate(PARTS):
        for picture in part(np.random.default_rng(seed + number)):
            if not kinds or picture.kind in kinds:
                drawn.append((picture.kind, picture.save(directory)))
    narrow = next((path for kind, path in drawn if path.stem == "narrow-sparse"), None)
    return drawn + ([("narrow-stated", narrow)] if narrow else [])


def reason_of(program, kind, path):
    """The code and the sentence that starpipe gives for a picture."""
    hints = ["--fov", "0.3"] if kind == "narrow-stated" else []
    command = [program, "process", "--format", "json", *hints, str(path)]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    if ran.returncode not in (0, 3):
        sys.exit(f"{path}: exit status {ran.returncode}\n{ran.stderr}")
    report = json.loads(ran.stdout.splitlines()[0])
    return report["reason_code"] or "identified", report["reason"] or ""


def print_confusion(results):
    """Kind against code."""
    codes = sorted({code for _, _, code, _ in results})
    counts = collections.Counter((kind, code) for kind, _, code, _ in results)
    print("\n| kind | " + " | ".join(codes) + " |\n|---|" + "---|" * len(codes))
    for kind in dict.fromkeys(kind for kind, *_ in results):
        print(f"| {kind} | " + " | ".join(str(counts[kind, code] or "") for code in codes) + " |")


def main():
    """Draws, runs, and tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--keep", type=pathlib.Path, help="where the pictures are written, and stay")
    parser.add_argument("--seed", type=int, default=SEED, help="other pictures of the same kinds")
    parser.add_argument("--kind", action="append", default=[], help="only this kind")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        directory = options.keep or pathlib.Path(temporary)
        directory.mkdir(parents=True, exist_ok=True)
        results = []
        print("| picture | code | reason |\n|---|---|---|")
        for kind, path in draw_all(directory, options.kind, options.seed):
            code, text = reason_of(options.program, kind, path)
            mark = "" if code in RIGHT[kind] else " (wrong)"
            print(f"| {path.stem}{' stated' if kind == 'narrow-stated' else ''} | `{code}`{mark} | {text} |", flush=True)
            results.append((kind, path, code, text))
    print_confusion(results)
    wrong = [path.stem for kind, path, code, _ in results if code not in RIGHT[kind]]
    probabilities = [path.stem for _, path, _, text in results if "log10" in text or "probab" in text]
    print(f"\n{len(results)} pictures, {len(wrong)} wrong: {' '.join(wrong)}")
    if probabilities:
        print("with a probability:", *probabilities)
    sys.exit(1 if wrong or probabilities else 0)


if __name__ == "__main__":
    main()
