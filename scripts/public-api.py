#!/usr/bin/env python3
"""List the names of the public API, as `cargo doc` shows them, and compare them with
docs/public-api.txt; with --write, write that file.

A type is listed with its fields, variants and own methods. What is hidden in the documentation is
not part of the API.
"""

import difflib
import os
import re
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LISTING = ROOT / "docs/public-api.txt"
KINDS = {"struct", "enum", "trait", "fn", "constant", "static", "type"}
MEMBERS = re.compile(r'id="(structfield|variant|method|tymethod|associatedconstant)\.([^"]+)"')


def documentation():
    """Builds the documentation without private items, and returns its directory."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    # The directory may hold the documentation of private items. A flag that is new each time makes
    # rustdoc run, and nothing else.
    flags = {**os.environ, "RUSTDOCFLAGS": f"--cfg listed_at_{time.time_ns()}"}
    command = ["cargo", "doc", "--no-deps", "--lib", "--quiet"]
    subprocess.run(command, cwd=ROOT, check=True, env=flags)
    return target / "doc/starpipe"


def members(page):
    """Fields, variants and own methods on the page of a type."""
    own = page.read_text().split('id="trait-implementations"')[0]
    return [f"    {name}" for _, name in MEMBERS.findall(own) if "." not in name]


def listing(directory):
    """The lines of the listing: each item, then its members."""
    shown = re.findall(r'<li><a href="([^"]+)"', (directory / "all.html").read_text())
    items = []
    for link in set(shown):
        page = directory / link
        kind, _, name = page.stem.partition(".")
        if kind in KINDS:
            modules = Path(link).parent.parts
            items.append(("::".join(["starpipe", *modules, name]), kind, page))
    for path, kind, page in sorted(items):
        yield f"{kind} {path}"
        yield from members(page)


def main():
    lines = [line + "\n" for line in listing(documentation())]
    if "--write" in sys.argv:
        LISTING.write_text("".join(lines))
        return 0
    known = LISTING.read_text().splitlines(keepends=True)
    changes = list(difflib.unified_diff(known, lines, "docs/public-api.txt", "cargo doc", n=1))
    sys.stdout.writelines(changes)
    if changes:
        print("The public API has changed. If that is meant: scripts/public-api.py --write")
    return 1 if changes else 0


if __name__ == "__main__":
    sys.exit(main())
