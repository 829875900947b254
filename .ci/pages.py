#!/usr/bin/env python3
"""Runs the commands of the task pages, docs/tasks, as a reader would: each page in a folder of its own that has `examples`.

    python3 .ci/pages.py DRT FOLDER

DRT is the program, FOLDER a place for the files. A block whose first line is a comment with the name of a file is that file, and blocks of
`sh` are run, up to the first that fails. Commands of cargo are left to other checks. Prints the seconds of each page.
"""

import os
import pathlib
import re
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.M | re.S)
NAME = re.compile(r"^(?:# |<!-- )([\w-]+\.\w+)(?: -->)?\n")


def run(page, folder, environment):
    folder.mkdir(parents=True)
    (folder / "examples").symlink_to(ROOT / "examples")
    for kind, body in BLOCK.findall(page.read_text()):
        named = NAME.match(body)
        if named:
            # What begins an XML file must stand on its first line.
            (folder / named.group(1)).write_text(body if kind != "xml" else body[named.end():])
        elif kind == "sh" and not body.startswith("cargo "):
            subprocess.run(["bash", "-euo", "pipefail", "-c", body], cwd=folder, env=environment, check=True)


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    program, work = (pathlib.Path(a).resolve() for a in sys.argv[1:])
    environment = dict(os.environ, PATH=f"{program.parent}{os.pathsep}{os.environ['PATH']}")
    pages = sorted(ROOT.glob("docs/tasks/*.md"))
    for page in pages:
        words = len(page.read_text().split())
        if words > 600:
            sys.exit(f"{page.relative_to(ROOT)}: {words} words; expected at most 600")
        start = time.monotonic()
        try:
            run(page, work / page.stem, environment)
        except subprocess.CalledProcessError as error:
            sys.exit(f"{page.relative_to(ROOT)}: exit code {error.returncode} of\n{error.cmd[-1]}")
        print(f"{page.stem}: {time.monotonic() - start:.1f} s")


if __name__ == "__main__":
    main()
