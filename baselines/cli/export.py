"""`follow export`: store episodes as a Minari dataset, for offline learning."""

from __future__ import annotations

import argparse

from baselines.benchmark.cells import SCENES
from baselines.cli.arguments import Commands, positive
from baselines.cli.exits import bad_input


def add(commands: Commands) -> None:
    """Add the command to ``follow``."""
    export = commands.add_parser("export", help="store episodes as a Minari dataset, for offline learning")
    export.add_argument("--policy", default="akf", metavar="NAME", help="estimator, floor or agent (default: akf)")
    export.add_argument("--scene", choices=SCENES, default="corridor", help="default: %(default)s")
    export.add_argument("--episodes", type=positive, default=100, metavar="N", help="seeds 0 to N-1; default: 100")
    export.add_argument("--id", metavar="ID", help="default: follow_env/SCENE/NAME-v0")
    export.set_defaults(run=_run)


def _run(parsed: argparse.Namespace) -> None:
    from baselines.benchmark.build import cell_of
    from baselines.learned.offline import export

    dataset_id = parsed.id or f"follow_env/{parsed.scene}/{parsed.policy}-v0"
    with bad_input(ValueError):
        dataset = export(cell_of(parsed.policy, parsed.scene), range(parsed.episodes), dataset_id)
    print(f"{dataset_id}: {dataset.total_episodes} episodes, {dataset.total_steps} steps in {dataset.spec.data_path}")
