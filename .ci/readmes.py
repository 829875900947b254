#!/usr/bin/env python3
"""Checks that each example of a README compiles with no more than the dependency that the README names.

    python3 .ci/readmes.py FOLDER

makes a workspace in FOLDER with a project for every README (and page of docs) that has examples in Rust: its one dependency is the one
that the page names below `[dependencies]`, with the path of the crate here in place of its version. `cargo check` compiles all of
them together.
"""

import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.M | re.S)
NAMED = re.compile(r"^\[dependencies\]\n([\w-]+) = (.+)$", re.M)
RESULT = re.compile(r"^Ok::<\(\), .*>\(\(\)\)$", re.M)


def examples(text, kinds):
    """The programs of a page, as rustdoc would have them: with hidden lines, in a `main` of their own."""
    for kind, body in BLOCK.findall(text):
        if kind not in kinds:
            continue
        body = re.sub(r"^#(?: |$)", "", body, flags=re.M)
        if re.search(r"^(pub )?fn main\(", body, re.M):
            yield body
        elif RESULT.search(body):
            yield f"fn main() -> Result<(), impl core::fmt::Debug> {{\n{body}}}\n"
        else:
            yield f"fn main() {{\n{body}}}\n"


def dependency(page, text):
    """The crate that a page names, and the rest of its entry."""
    named = {entry for kind, body in BLOCK.findall(text) if kind == "toml" for entry in NAMED.findall(body)}
    if len(named) != 1:
        sys.exit(f"{page}: it names {len(named)} dependencies; expected one, in a block that begins with [dependencies]")
    crate, entry = named.pop()
    features = re.search(r"version = \"[^\"]*\"(.*)\}", entry)
    rest = features.group(1) if features else " "
    folder = ROOT / crate
    if not folder.is_dir():
        sys.exit(f"{page}: there is no crate {crate}")
    return f'{crate} = {{ path = "{folder}"{rest}}}'


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    work = pathlib.Path(sys.argv[1])
    shutil.rmtree(work, ignore_errors=True)
    members = []
    for page in sorted([*ROOT.glob("drt-*/README.md"), *ROOT.glob("docs/**/*.md")]):
        text = page.read_text()
        # What has no language is Rust to rustdoc, which sees no other pages.
        programs = list(examples(text, ("rust", "") if page.name == "README.md" else ("rust",)))
        if not programs:
            continue
        name = f"example-of-{page.parent.name}-{page.stem.lower()}"
        sources = work / name / "src" / "bin"
        sources.mkdir(parents=True)
        for i, program in enumerate(programs, 1):
            (sources / f"{name}-{i}.rs").write_text(program)
        manifest = f'[package]\nname = "{name}"\nedition = "2024"\n\n[dependencies]\n{dependency(page.relative_to(ROOT), text)}\n'
        # Examples may ask for features of their crate.
        manifest += '\n[lints.rust]\nunexpected_cfgs = "allow"\n'
        (work / name / "Cargo.toml").write_text(manifest)
        members.append(name)
    (work / "Cargo.toml").write_text(f"[workspace]\nresolver = \"3\"\nmembers = {members!r}\n".replace("'", '"'))
    shutil.copy(ROOT / "Cargo.lock", work / "Cargo.lock")
    sys.exit(subprocess.run(["cargo", "check", "-q", "--workspace"], cwd=work).returncode)


if __name__ == "__main__":
    main()
