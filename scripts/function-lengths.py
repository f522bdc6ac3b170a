#!/usr/bin/env python3
"""Prints the lengths of functions and the lines of code of a source tree, tests left out.

usage: scripts/function-lengths.py [DIRECTORY]        default: src

A function's length is counted from its signature to its closing brace, blank lines and comments
included. Unit tests (`mod tests`, files named tests.rs) do not count.
"""

import re
import sys
from pathlib import Path

FUNCTION = re.compile(r"^(\s*)(?:pub(?:\([^)]*\))? )?(?:const )?(?:unsafe )?fn (\w+)")


def without_tests(path):
    """The lines of a file up to its unit tests."""
    lines = path.read_text(encoding="utf-8").splitlines()
    for number, line in enumerate(lines[:-1]):
        if line == "#[cfg(test)]" and lines[number + 1].startswith("mod tests {"):
            return lines[:number]
    return lines


def functions(lines):
    """Names and lengths of the functions in `lines`, as rustfmt lays them out."""
    for number, line in enumerate(lines):
        found = FUNCTION.match(line)
        if not found:
            continue
        indent = found.group(1)
        for end in range(number, len(lines)):
            text = lines[end]
            if text == indent + "}" or (text.endswith((";", "}")) and end == number):
                yield found.group(2), end - number + 1
                break
            if text.startswith(indent + ")") and text.endswith(";"):
                break


def main():
    root = Path(sys.argv[1] if len(sys.argv) > 1 else "src")
    files = [path for path in sorted(root.rglob("*.rs")) if path.stem != "tests"]
    lengths, sizes, code, docs = [], [], 0, 0
    for path in files:
        lines = without_tests(path)
        filled = [line for line in lines if line.strip()]
        code += len(lines)
        docs += sum(line.lstrip().startswith(("///", "//!")) for line in filled)
        sizes.append((len(lines), str(path)))
        lengths += [(length, name, str(path)) for name, length in functions(lines)]
    lengths.sort()
    sizes.sort()
    at = lambda part: lengths[int(part * (len(lengths) - 1))][0]
    print(f"{len(files)} files, {code} lines without tests, {docs} of them documentation")
    print(f"{len(lengths)} functions: median {at(0.5)} lines, 90 % {at(0.9)}, 99 % {at(0.99)}")
    print("longest functions:", *(f"  {n:4} {f} ({p})" for n, f, p in lengths[:-6:-1]), sep="\n")
    print("longest files:", *(f"  {n:4} {p}" for n, p in sizes[:-6:-1]), sep="\n")


if __name__ == "__main__":
    main()
