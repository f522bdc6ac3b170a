#!/usr/bin/env python3
"""Runs the commands of the manual in a fresh clone.

    python3 scripts/check-manual.py target/release/starpipe [PAGE.md...]

Takes the program, and the pages to check (default: README.md, docs/ and docs/start/). Runs every line of
their `sh` blocks that uses starpipe, and in the README the commands within sentences, in order, page
by page in a new clone, with at most 20 frames or trials. Prints exit status and time of each, and
exits with 1 if one fails. A frame that is not identified (exit status 3) is no failure.
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
MOST = 20
# Of `validate`, which simulates and processes each.
MOST_OF_STUDIES = 3


def commands(page):
    """The command lines of a page's `sh` blocks, without comments."""
    for block in re.findall(r"```sh\n(.*?)```", page.read_text(), re.DOTALL):
        lines = re.sub(r"\\\n\s*", "", block).splitlines()
        lines = [line.replace("cargo run --release --", "starpipe") for line in lines]
        lines = [re.sub(r"\s+#.*", "", line).strip() for line in lines]
        if any(line.startswith("for ") for line in lines):
            lines = ["; ".join(lines).replace("do;", "do")]
        yield from (line for line in lines if "starpipe " in line and not line.startswith("python3"))
    if page.resolve() == ROOT / "README.md":
        yield from re.findall(r"`(starpipe [a-z][^`]*)`", page.read_text())


def shortened(command):
    """The command with few frames or trials."""
    most = MOST_OF_STUDIES if command.split()[1] == "validate" else MOST
    fewer = lambda found: f"{found[1]} {min(most, int(found[2]))}"
    command = re.sub(r"(--count) (\d+)", fewer, command)
    return command + f" --count {most}" if command.endswith("--suite robustness") else command


def run(page, program):
    """Runs the commands of a page; whether all succeeded."""
    good = True
    with tempfile.TemporaryDirectory() as directory:
        subprocess.run(["git", "clone", "--quiet", ROOT, f"{directory}/clone"], check=True)
        os.mkdir(f"{directory}/bin")
        os.symlink(program.resolve(), f"{directory}/bin/starpipe")
        environment = {**os.environ, "PATH": f"{directory}/bin:{os.environ['PATH']}"}
        for command in map(shortened, commands(page)):
            start = time.monotonic()
            ended = subprocess.run(
                ["bash", "-c", command],
                cwd=f"{directory}/clone",
                env=environment,
                capture_output=True,
                text=True,
                check=False,
            )
            status = ended.returncode
            good &= status in (0, 3)
            print(f"{page.name}: exit {status}, {time.monotonic() - start:.1f} s: {command}", flush=True)
            if status not in (0, 3):
                print(ended.stderr, flush=True)
    return good


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    docs = [*sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "docs/start").glob("*.md"))]
    pages = [pathlib.Path(page) for page in sys.argv[2:]] or [ROOT / "README.md", *docs]
    results = [run(page, pathlib.Path(sys.argv[1])) for page in pages]
    sys.exit(0 if all(results) else 1)


main()
