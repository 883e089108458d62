"""`follow list`: what can be named, and what each is."""

from __future__ import annotations

import argparse
from collections.abc import Iterable

from baselines.cli.arguments import Commands

REGISTRIES = {
    "scenes": "follow_env.world.scenes:SCENES",
    "lights": "follow_env.world.scenes:LIGHTS",
    "routes": "follow_env.world.motion.base:MOTIONS",
    "robots": "follow_env.world.robots:ROBOTS",
    "sensors": "follow_env.sensors:SENSORS",
    "bodies": "follow_env.world.people.bodies:BODIES",
    "outfits": "follow_env.world.people.bodies:OUTFITS",
    "renderers": "follow_env.camera:RENDERERS",
    "engines": "follow_env.world:ENGINES",
    "perceptions": "baselines.followers.perception:PERCEPTIONS",
    "estimators": "tracker.estimators.base:ESTIMATORS",
    "controllers": "baselines.controllers:CONTROLLERS",
    "recoveries": "baselines.followers.recovery:RECOVERIES",
    "policies": "baselines.followers.references:POLICIES",
    "recipes": "baselines.learned.recipes:RECIPES",
    "suites": "baselines.benchmark.suite:SUITES",
    "metrics": "baselines.benchmark.metrics.base:METRICS",
}
"""Kind -> the registry that holds its names."""


def add(commands: Commands) -> None:
    """Add the command to ``follow``."""
    listing = commands.add_parser("list", help="what can be named: scenes, routes, estimators, suites, ...")
    listing.add_argument("kind", nargs="?", choices=(*REGISTRIES, "agents"), metavar="KIND", help="default: all kinds")
    listing.set_defaults(run=_run)


def _run(parsed: argparse.Namespace) -> None:
    from follow_env.registry import load

    kinds: Iterable[str] = (parsed.kind,) if parsed.kind else (*REGISTRIES, "agents")
    for kind in kinds:
        if kind == "agents":
            from baselines.followers.agents import shipped

            entries = {name: "" for name in shipped()}
        else:
            registry = load(REGISTRIES[kind])
            entries = {name: _about(registry.get(name)) for name in registry}
        print(f"{kind}:")
        width = max(map(len, entries), default=0)
        for name, about in entries.items():
            print(f"  {name.ljust(width)}  {about}".rstrip())


def _about(component: object) -> str:
    """Return the first sentence of what a component says of itself; values say nothing."""
    text = getattr(component, "doc", "") or getattr(component, "card", "")
    if not text and (callable(component) and hasattr(component, "__module__")):
        text = component.__doc__ or ""
    return text.strip().partition("\n")[0]
