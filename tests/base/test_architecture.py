"""The laws of the house that no single room can hold: who imports whom, how long modules are, what names mean."""

import ast
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "prnav"
LONGEST = 450
"""Most lines of a module."""


def _modules() -> dict[str, Path]:
    result = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        result[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return result


MODULES = _modules()
TREES = {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in MODULES.items()}


def imports(tree: ast.AST, known: set[str]) -> set[str]:
    """Modules among ``known`` that a module imports, at its top or in a function; for type checkers alone does not
    count."""
    found: set[str] = set()

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            for child in node.orelse:
                visit(child)
            return
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                found.update({inner} if inner in known else {node.module} & known)
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(tree)
    return found


def circles(graph: dict[str, set[str]]) -> list[set[str]]:
    """Groups of modules that reach each other: what is left when modules that import or are imported by none left are
    taken away, one after the other."""
    left = {name: set(others) - {name} for name, others in graph.items()}
    while True:
        imported = set().union(*left.values()) if left else set()
        free = {name for name, others in left.items() if not others or name not in imported}
        if not free:
            return [{name, *others} for name, others in left.items()]
        left = {name: others - free for name, others in left.items() if name not in free}


def test_circles_are_found():
    assert circles({"a": {"b"}, "b": {"c"}, "c": set()}) == []
    assert set().union(*circles({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"a"}})) == {"b", "c"}


def test_imports_are_found_wherever_they_stand():
    text = "import a\nif TYPE_CHECKING:\n    import b\ndef f():\n    from p import c\n    from p.c import thing\n"
    assert imports(ast.parse(text), {"a", "b", "p", "p.c"}) == {"a", "p.c"}


def test_modules_form_no_circle():
    known = set(MODULES)
    assert circles({name: imports(tree, known) for name, tree in TREES.items()}) == []


def test_the_import_contracts_hold():
    run = subprocess.run(
        [sys.executable, "-c", "from importlinter.cli import lint_imports_command as main; main()"],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    if "No module named" in run.stderr:
        pytest.skip("import-linter is not installed (pip install -e '.[dev]')")
    assert run.returncode == 0, run.stdout + run.stderr


def test_no_module_is_longer_than_can_be_read_at_once():
    lengths = {name: len(path.read_text(encoding="utf-8").splitlines()) for name, path in MODULES.items()}
    assert {name: length for name, length in lengths.items() if length > LONGEST} == {}


def test_a_class_name_means_one_thing():
    names = Counter(node.name for tree in TREES.values() for node in ast.walk(tree) if isinstance(node, ast.ClassDef))
    assert [name for name, count in names.items() if count > 1] == []


def test_seams_are_protocols():
    found = [
        f"{name}:{node.lineno}"
        for name, tree in TREES.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "hasattr"
    ]
    assert found == []


def test_a_task_is_known_to_its_domain_and_the_catalogue():
    naming = [name for name, path in MODULES.items() if re.search("targetnav", path.read_text("utf-8"), re.IGNORECASE)]
    assert naming == ["prnav.catalog", "prnav.domains.navigation.targetnav", "prnav.scene.houses.manifest"]


def test_any_stays_rare():
    count = sum(
        bool(re.search(r"\bAny\b", line))
        for path in MODULES.values()
        for line in path.read_text(encoding="utf-8").splitlines()
    )
    assert count <= 152
