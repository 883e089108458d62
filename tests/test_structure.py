"""The house: which floor knows which, no circles, one place for each name, and light imports."""

import ast
import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

from baselines.cli.listing import REGISTRIES
from follow_env.registry import Registry, load

ROOT = Path(__file__).parents[1]
FLOORS = ("follow_env", "tracker", "baselines")
VOCABULARIES = "ESTIMATORS|SCENES|ROUTES|CONTROLLERS|PERCEPTIONS|SUITES|BODIES|OUTFITS|SENSORS|RENDERERS|RECIPES"


def modules(package):
    return sorted((ROOT / package).rglob("*.py"))


def imports(path):
    """Return the dotted names that a module imports anywhere in it, `from a import b` as a and a.b."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return found


def within(name, package):
    return name == package or name.startswith(f"{package}.")


@pytest.mark.parametrize(
    ("package", "unknown"),
    [
        ("follow_env", ("tracker", "baselines", "torch", "stable_baselines3", "matplotlib")),
        ("tracker", ("baselines", "pybullet", "gymnasium", "stable_baselines3", "follow_env.envs", "follow_env.world")),
        ("baselines/benchmark", ("baselines.papers", "baselines.suites")),
        ("baselines/followers", ("baselines.papers", "baselines.suites", "baselines.benchmark", "baselines.learned")),
        ("baselines/controllers", ("baselines.followers", "baselines.benchmark", "torch")),
        ("follow_env/world", ("gymnasium", "follow_env.envs")),
        ("follow_env/camera", ("gymnasium", "follow_env.envs")),
    ],
)
def test_a_floor_knows_only_what_lies_below(package, unknown):
    for path in modules(package):
        wrong = [name for name in imports(path) for other in unknown if within(name, other)]
        assert not wrong, f"{path.relative_to(ROOT)} imports {wrong}"


def test_the_files_have_no_circle():
    """Of imports at the top of a module; those inside functions wait until they are needed."""
    graph = {}
    for package in FLOORS:
        for path in modules(package):
            name = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
            graph[name] = set()
            for node in ast.parse(path.read_text(encoding="utf-8")).body:
                if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] in FLOORS:
                    graph[name] |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    graph = {name: {other for other in others if other in graph and other != name} for name, others in graph.items()}
    done, path = set(), []

    def visit(name):
        if name in done:
            return
        assert name not in path, f"a circle: {' -> '.join([*path[path.index(name) :], name])}"
        path.append(name)
        for other in graph[name]:
            if not name.startswith(f"{other}."):  # a package's own __init__ comes first anyway
                visit(other)
        path.pop()
        done.add(name)

    for name in graph:
        visit(name)


@pytest.mark.parametrize(
    ("package", "heavy"),
    [
        ("follow_env", ("pybullet", "torch", "numba", "pydantic", "cv2", "matplotlib", "moderngl")),
        ("tracker", ("gymnasium", "pybullet", "torch", "numba", "pydantic", "cv2", "matplotlib")),
        ("baselines", ("gymnasium", "pybullet", "torch", "numba", "pydantic", "cv2", "matplotlib")),
    ],
)
def test_importing_a_package_loads_nothing_heavy(package, heavy):
    code = f"import sys, {package}; print([name for name in {heavy!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("package", FLOORS)
def test_the_public_names_are_there_and_few(package):
    module = importlib.import_module(package)
    for name in module._PUBLIC:
        assert getattr(module, name).__doc__, name
        assert name in dir(module)
    assert len(module._PUBLIC) <= 16
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        module.nothing  # noqa: B018


def test_every_registry_is_listed_once_and_full():
    registries = {kind: load(path) for kind, path in REGISTRIES.items()}
    assert len({registry.kind for registry in registries.values()}) == len(registries)
    for registry in registries.values():
        assert isinstance(registry, Registry)
        assert len({*registry}) == len(registry) > 0


def test_a_name_is_registered_once():
    for path in {path for package in FLOORS for path in modules(package)}:
        text = path.read_text(encoding="utf-8")
        names = re.findall(r"^@?(?:\w+ = )?([A-Z]+)\.register\(\"(\w+)\"\)", text, re.M)
        assert len(names) == len({*names}), path
    with pytest.raises(ValueError, match="is registered already"):
        load(REGISTRIES["estimators"]).register("kf")(int)


def test_no_vocabulary_stands_beside_its_registry():
    """A tuple of names that a registry holds grows old; what training pictures and papers draw from says so itself."""
    for package in FLOORS:
        for path in modules(package):
            if within(".".join(path.relative_to(ROOT).parts), "baselines.papers") or path.name == "cells.py":
                continue
            found = re.findall(
                rf"^(?:{VOCABULARIES}) *(?::[^=]*)?= *[({{\[]",
                path.read_text(encoding="utf-8"),
                re.M,
            )
            assert not found, f"{path.relative_to(ROOT)}: {found}"


def test_a_component_of_another_package_is_found_by_its_entry_point(monkeypatch):
    import importlib.metadata

    point = importlib.metadata.EntryPoint("scene.lab", "tests_lab:lab", "follow_env.components")
    monkeypatch.setattr(
        importlib.metadata, "entry_points", lambda group: [point] if group == "follow_env.components" else []
    )
    registry = Registry("scene")
    assert registry.names() == ("lab",)
    with pytest.raises(ValueError, match="did you mean 'lab'"):
        registry.get("labb")
