"""`follow export`: store episodes as a Minari dataset, for offline learning."""

from __future__ import annotations

import argparse

from baselines.benchmark.cells import SCENES
from baselines.cli.arguments import Commands, add_trial, positive, trial_of
from baselines.cli.exits import bad_input


def add(commands: Commands) -> None:
    """Add the command to ``follow``."""
    export = commands.add_parser("export", help="store episodes as a Minari dataset, for offline learning")
    export.add_argument("--policy", default="akf", metavar="NAME", help="estimator, floor or agent (default: akf)")
    export.add_argument("--scene", choices=SCENES, default="corridor", help="default: %(default)s")
    add_trial(export)
    export.add_argument("--episodes", type=positive, default=100, metavar="N", help="seeds 0 to N-1; default: 100")
    export.add_argument("--id", metavar="ID", help="default: follow_env/SCENE/NAME-v0")
    export.set_defaults(run=_run)


def _run(parsed: argparse.Namespace) -> None:
    from baselines.benchmark.build import cell_of
    from baselines.learned.offline import export

    with bad_input(ValueError):
        trial = trial_of(parsed)
        names = (parsed.scene, parsed.policy) if trial is None else (trial.scenario.name, trial.follower.name)
        dataset_id = parsed.id or "follow_env/{}/{}-v0".format(*(name.replace(" ", "") for name in names))
        played = cell_of(parsed.policy, parsed.scene) if trial is None else trial
        dataset = export(played, range(parsed.episodes), dataset_id)
    print(f"{dataset_id}: {dataset.total_episodes} episodes, {dataset.total_steps} steps in {dataset.spec.data_path}")
