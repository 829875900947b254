#!/usr/bin/env python3
"""Finds private words in the code of drt-estimators and in the docs: python3 .ci/words.py"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
# What a library calls so.
FOREIGN = re.compile(r"sync::mpsc|finished: &Receiver")


def lists():
    found, name = {}, None
    for line in (ROOT / ".ci/words.txt").read_text().splitlines():
        if line.startswith("["):
            name = line.strip("[]")
            found[name] = []
        elif line and not line.startswith("#"):
            found[name].append(line)
    return {name: re.compile(rf"\b(?:{'|'.join(words)})\b") for name, words in found.items()}


def code_of(line):
    """A line without its strings and comment."""
    return re.sub(r'"(?:[^"\\]|\\.)*"', '""', line).split("//")[0]


def main():
    words = lists()
    faults = []
    for file in sorted(ROOT.glob("drt-estimators/src/**/*.rs")):
        for n, line in enumerate(file.read_text().splitlines(), 1):
            if (m := words["code"].search(code_of(line))) and not FOREIGN.search(line):
                faults.append(f"{file.relative_to(ROOT)}:{n}: {m[0]}")
    docs = [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("docs/*/*.md"), *ROOT.glob("drt-*/README.md")]
    for file in sorted(docs):
        for n, line in enumerate(file.read_text().splitlines(), 1):
            if m := words["docs"].search(line):
                faults.append(f"{file.relative_to(ROOT)}:{n}: {m[0]}")
    print("\n".join(faults) or "no private words")
    return 1 if faults else 0


sys.exit(main())
