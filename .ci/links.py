#!/usr/bin/env python3
"""Checks that links between the pages of the repository lead to files that exist, and to headings in them.

    python3 .ci/links.py
"""

import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
FENCE = re.compile(r"^```.*?^```$", re.M | re.S)
LINK = re.compile(r"\]\(([^()\s]+)\)")
HEADING = re.compile(r"^#+ (.*)$", re.M)


def anchors(text):
    """The names that a page's headings have in links, as GitHub makes them; a repeated one has a number after it."""
    seen, found = {}, set()
    for heading in HEADING.findall(text):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
        name = re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")
        found.add(f"{name}-{seen[name]}" if name in seen else name)
        seen[name] = seen.get(name, 0) + 1
    return found


def dead(pages):
    """Each link that leads nowhere, with its page."""
    for page, text in pages.items():
        for link in LINK.findall(re.sub(r"`[^`\n]*`", "", text)):
            # Formulas have brackets, too, but neither dots, slashes nor number signs in them.
            if "://" in link or not re.search(r"[./#]", link):
                continue
            file, _, anchor = link.partition("#")
            target = (page.parent / file).resolve() if file else page
            if not target.exists() or (anchor and anchor not in anchors(pages.get(target, ""))):
                yield f"{page.relative_to(ROOT)}: {link}"


def main():
    listed = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True)
    pages = {ROOT / name: FENCE.sub("", (ROOT / name).read_text()) for name in listed.stdout.split()}
    first = ROOT / "README.md"
    planted = "[a](docs/none.md) [b](docs/scenes.md#none) [c](#none) [d](docs/scenes.md#bsdf) [e](docs)"
    caught = len(list(dead({**pages, first: planted})))
    others = len(list(dead({**pages, first: ""})))
    if caught - others != 3:
        sys.exit("planted links that lead nowhere are not found")
    found = list(dead(pages))
    sys.exit("\n".join(found) or None)


if __name__ == "__main__":
    main()
