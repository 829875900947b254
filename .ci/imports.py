#!/usr/bin/env python3
"""Imports run one way through every folder of the crates, and nowhere in a circle: python3 .ci/imports.py

At each level, from the top of a crate down to the files of its innermost folders, a node is a file together with the
folder of its parts, and an arrow says that something in one imports something in another. What a module passes on from
elsewhere counts as an import from where it is written. Tests and links in docs may look anywhere.
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
CRATES = ["drt-math", "drt-geom", "drt-medium", "drt-motion", "drt-estimators", "drt-cli"]
# A file may import from its own folder and from those before it.
ORDER = {
    "drt-estimators": ["model", "world", "sampling", "derivative", "discontinuities", "terms", "estimators", "run", "fit"],
    "drt-cli": ["testing", "wording", "error", "files", "scene_xml", "job", "prepared", "commands"],
}

TEST_MODULE = r"#\[cfg\((?:all\()?test\b[^\]]*\]\s*(?:pub(?:\(\w+\))? )?mod \w+ \{"
TEST_IMPORT = r"#\[cfg\((?:all\()?test\b[^\]]*\]\s*(?:pub(?:\(\w+\))? )?use [^;]*;"
INNER_MODULE = r"(?ms)^mod \w+ \{.*?^\}"
IMPORT = r"(?m)^\s*(?:pub(?:\([\w ]+\))? )?use ([^;]*);"
ITEM = r"\b(?:struct|enum|union|trait|type|fn|const|static|macro_rules!)\s+(\w+)"


def code(file):
    """A file without comments and without its tests, as if its modules within braces were not in braces."""
    text = re.sub(r"//[^\n]*", "", file.read_text())
    text = re.sub(TEST_IMPORT, "", re.split(TEST_MODULE, text)[0])
    return re.sub(INNER_MODULE, lambda inner: re.sub(r"\bsuper\b(?!::super)", "self", inner[0]), text)


def is_test(path):
    return any(part.removesuffix(".rs") == "tests" for part in path.parts)


def leaves(tree):
    """The paths of a tree of imports, with the names that they get."""
    tree = tree.strip()
    head, brace, rest = tree.partition("{")
    if not brace:
        path, _, name = tree.partition(" as ")
        path = [part.strip() for part in path.split("::") if part.strip()]
        if path:
            yield path, name.strip() or path[-1]
        return
    base = [part.strip() for part in head.split("::") if part.strip()]
    depth, start = 0, 0
    rest = rest[: rest.rindex("}")] + ","
    for n, c in enumerate(rest):
        depth += (c == "{") - (c == "}")
        if c == "," and depth == 0:
            for path, name in leaves(rest[start:n]):
                if path == ["self"]:
                    yield base, base[-1] if name == "self" else name
                else:
                    yield base + path, name
            start = n + 1


class Crate:
    def __init__(self, name):
        self.src = ROOT / name / "src"
        self.text = {}
        for file in sorted(self.src.rglob("*.rs")):
            parts = list(file.relative_to(self.src).with_suffix("").parts)
            if is_test(file.relative_to(self.src)) or parts == ["main"]:
                continue
            if parts[-1] in ("mod", "lib"):
                parts.pop()
            self.text[tuple(parts)] = code(file)
        self.items = {m: set(re.findall(ITEM, text)) for m, text in self.text.items()}
        self.names, self.globs, self.paths = {}, {}, {}
        for module in self.text:
            self.read(module)

    def read(self, module):
        """Notes what a module imports: names, whole modules, and paths in the midst of code."""
        self.names[module], self.globs[module], self.paths[module] = {}, [], set()
        for tree in re.findall(IMPORT, self.text[module]):
            for path, name in leaves(tree):
                path = self.absolute(module, path)
                if path and path[-1] == "*":
                    self.globs[module].append(path[:-1])
                else:
                    self.names[module][name] = path
        rest = re.sub(IMPORT, "", self.text[module])
        for path in re.findall(r"\b(?:crate|super|self)(?:\s*::\s*\w+)+", rest):
            self.paths[module].add(self.absolute(module, re.findall(r"\w+", path)))

    def absolute(self, module, path):
        """A path from the top of the crate, or none if it leads out of the crate."""
        if path[0] == "crate":
            return tuple(path[1:])
        if path[0] not in ("self", "super"):
            return module + tuple(path) if module + (path[0],) in self.text else None
        while path and path[0] in ("self", "super"):
            module = module if path[0] == "self" else module[:-1]
            path = path[1:]
        return module + tuple(path)

    def home(self, path, seen=()):
        """The module in which that is written to which a path leads, or none."""
        if path is None or path in seen:
            return None
        module = ()
        for n, part in enumerate(path):
            if module + (part,) in self.text:
                module += (part,)
            elif part in self.items[module]:
                return module
            elif part in self.names[module]:
                target = self.names[module][part]
                return target and self.home(target + path[n + 1 :], (*seen, path))
            else:
                passed_on = (self.home(base + path[n:], (*seen, path)) for base in self.globs[module])
                return next((m for m in passed_on if m and part in self.items[m]), None)
        return module

    def imports(self):
        """Each import as the module that has it and the module that it leads to."""
        for module in self.text:
            for path in [*self.names[module].values(), *self.globs[module], *self.paths[module]]:
                target = self.home(path)
                if target is not None:
                    yield module, target


def circles(graph):
    """One circle of each knot of nodes that import each other."""
    state, stack, found = {}, [], []

    def visit(node):
        state[node] = "open"
        stack.append(node)
        for other in sorted(graph.get(node, ())):
            if state.get(other) == "open":
                found.append(stack[stack.index(other) :] + [other])
            elif other not in state:
                visit(other)
        stack.pop()
        state[node] = "done"

    for node in sorted(graph):
        if node not in state:
            visit(node)
    return found


def show(crate, module):
    return "/".join((crate, *module))


def main():
    faults, levels, files = [], 0, 0
    for name in CRATES:
        crate = Crate(name)
        files += len(crate.text)
        order = ORDER.get(name, [])
        unknown = {m[0] for m in crate.text if m} - set(order)
        if order and unknown:
            faults.append(f"{name} has folders that no rule names: {', '.join(sorted(unknown))}")
        graphs = {}
        for module, target in crate.imports():
            same = 0
            while same < min(len(module), len(target)) and module[same] == target[same]:
                same += 1
            # A file and the folder of its parts are one room.
            if same == min(len(module), len(target)):
                continue
            graph = graphs.setdefault(module[:same], {})
            graph.setdefault(module[same], {}).setdefault(target[same], (module, target))
            if same == 0 and {module[0], target[0]} <= set(order) and order.index(target[0]) > order.index(module[0]):
                faults.append(f"{show(name, module)} imports {show(name, target)}, which comes after it")
        levels += len({module[:-1] for module in crate.text if module})
        for level, graph in graphs.items():
            for circle in circles(graph):
                line = f"a circle in {show(name, level)}: {' -> '.join(circle)}"
                for one, other in zip(circle, circle[1:]):
                    module, target = graph[one][other]
                    line += f"\n    {show(name, module)} imports {show(name, target)}"
                faults.append(line)
    print("\n".join(faults) or f"{files} files in {levels} folders, all imports one way")
    return 1 if faults else 0


sys.exit(main())
