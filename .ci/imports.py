#!/usr/bin/env python3
"""Imports run one way through the folders of drt-estimators/src, and nowhere in a circle: python3 .ci/imports.py

A file may import from its own folder and from those before it in FOLDERS. Tests and links in docs may look anywhere.
"""
import pathlib
import re
import sys

SRC = pathlib.Path(__file__).resolve().parent.parent / "drt-estimators" / "src"
FOLDERS = ["model", "world", "sampling", "derivative", "discontinuities", "terms", "estimators", "run", "fit"]


def code(file):
    """A file without comments and without its tests."""
    text = re.sub(r"//[^\n]*", "", file.read_text())
    return re.split(r"#\[cfg\((?:all\()?test\b[^\]]*\]\s*(?:pub\(crate\) )?mod \w+ \{", text)[0]


def is_test(path):
    return any(part.removesuffix(".rs") == "tests" for part in path.parts)


def modules(files):
    """Files by the path of their module."""
    named = {}
    for file in files:
        parts = list(file.relative_to(SRC).with_suffix("").parts)
        if parts[-1] == "mod":
            parts.pop()
        named[tuple(parts)] = file
    return named


def uses(text, module):
    """Absolute paths that a file names, as tuples."""
    for match in re.finditer(r"\b(crate|super)((?:\s*::\s*\w+)+)(?:\s*::\s*\{([^;]*?)\}\s*;)?", text):
        path = re.findall(r"\w+", match[2])
        base = []
        if match[1] == "super":
            base = list(module[:-1])
            while path and path[0] == "super":
                base, path = base[:-1], path[1:]
        yield tuple(base + path)
        for name in re.findall(r"(?:^|,)\s*([\w:]+)", match[3] or ""):
            yield tuple(base + path + name.split("::"))


def main():
    files = [f for f in sorted(SRC.rglob("*.rs")) if not is_test(f.relative_to(SRC))]
    named = modules(files)
    faults = []
    graph = {}
    unknown = {m[0] for m in named if len(m) > 1 or m[0] not in ("lib",)} - set(FOLDERS)
    if unknown:
        faults.append(f"folders that no rule names: {', '.join(sorted(unknown))}")
    for module, file in named.items():
        graph[module] = set()
        for path in uses(code(file), module):
            target = next((path[:n] for n in range(len(path), 0, -1) if path[:n] in named), None)
            # A file and the folder of its parts are one room.
            if target is None or target == module or target == module[: len(target)]:
                continue
            if module == target[: len(module)]:
                continue
            graph[module].add(target)
            if target[0] in FOLDERS and module[0] in FOLDERS:
                if FOLDERS.index(target[0]) > FOLDERS.index(module[0]):
                    faults.append(f"{'/'.join(module)} imports {'::'.join(path)}, which comes after it")
    for circle in circles(graph):
        faults.append("a circle: " + " -> ".join("/".join(m) for m in circle))
    print("\n".join(faults) or f"{len(named)} files in {len(FOLDERS)} folders, all imports one way")
    return 1 if faults else 0


def circles(graph):
    """One circle of each knot of modules that import each other."""
    state, stack, found = {}, [], []

    def visit(node):
        state[node] = "open"
        stack.append(node)
        for other in sorted(graph.get(node, ())):
            if state.get(other) == "open":
                found.append(stack[stack.index(other):] + [other])
            elif other not in state:
                visit(other)
        stack.pop()
        state[node] = "done"

    for node in sorted(graph):
        if node not in state:
            visit(node)
    return found


sys.exit(main())
