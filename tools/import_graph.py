"""Who imports whom in a package, read from its syntax trees."""

import ast
import collections
import pathlib


def graph_of(trees):
    """{module: modules of the package that it imports, be it within a function}; trees: {path: ast.Module}."""
    modules = {module_of(path): tree for path, tree in trees.items()}
    return {name: set(_imported(tree, modules)) - {name} for name, tree in modules.items()}


def module_of(path):
    """The dotted name of a module's path."""
    return path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def folder_arrows(trees):
    """(from, to): folders of which one's modules import from the other's."""
    folder = {module_of(path): str(pathlib.PurePath(path).parent) for path in trees}
    arrows = {(folder[a], folder[b]) for a, targets in graph_of(trees).items() for b in targets}
    return sorted((a, b) for a, b in arrows if a != b)


def parts_of(graph, package):
    """The graph of a package's parts: the folders and modules directly in it."""
    part = {name: ".".join(name.split(".")[:2]) for name in graph}
    parts = collections.defaultdict(set)
    for name, targets in graph.items():
        parts[part[name]] |= {part[target] for target in targets} - {part[name], package}
    return dict(parts)


def circles(graph):
    """The sets of two or more nodes of which each is reached from each."""
    reached = {}
    for start in graph:
        seen, todo = set(), [start]
        while todo:
            new = graph.get(todo.pop(), set()) - seen
            seen |= new
            todo += new
        reached[start] = seen
    found = {tuple(sorted(b for b in seen if a in reached[b])) for a, seen in reached.items() if a in seen}
    return sorted(found)


def _imported(tree, modules):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in modules)
        elif isinstance(node, ast.ImportFrom) and node.module in modules:
            for alias in node.names:
                name = f"{node.module}.{alias.name}"
                yield name if name in modules else node.module
