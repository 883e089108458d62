"""Paper A's Table 3: how fast the nets are, side by side in one run on this machine.

Times of machines that others use too are no result that could come back: they go to `timing.csv` and `timing.md` only.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from baselines.benchmark.files import Value, write_csv, write_text
from baselines.benchmark.markdown import markdown_table
from baselines.papers.zhang2018.sequences import Sequence as Film
from baselines.papers.zhang2018.sequences import play
from baselines.papers.zhang2018.table2 import NETS, OURS, SSD
from baselines.speed.timing import Cost, measure
from follow_env.camera import RGBDFrame
from follow_env.geometry import XTION_PRO
from tracker.detection.detector import PersonDetector, network_input, predict
from tracker.detection.networks import MultiBoxNet, count_macs, make_network
from tracker.person_tracker import PersonTracker, TrackerSettings

FULL = {SSD: "ssd300", OURS: "paper"}
"""The nets on the paper's own trunk (VGG-16), by what stands for them here; there are no weights for them."""
STAGES = {
    "network": "the network alone",
    "detector": "from a picture to boxes",
    "tracker": "detector and tracker",
}
COLUMNS = (
    *("net", "trained", "stage", "macs", "frames", "median_s", "fastest_s", "cpu_median_s", "frames_per_s"),
    "of_ssd",
)
REPEATS, FULL_REPEATS = 60, 5
"""Frames of each net, and of each net that takes half a second."""
_PICTURES = 20


@dataclass(frozen=True)
class Speed:
    """Cost of a frame.

    Attributes:
        net: Name of the net.
        trained: Whether it has weights; the time of a convolution does not depend on them.
        stage: One of `STAGES`.
        macs: Multiplications in the network's convolutions.
        frames: How many were timed.
        cost: Of one, on one thread.
        ssd_cost: The same of the SSD on the same trunk, in the same run; None without its weights.
    """

    net: str
    trained: bool
    stage: str
    macs: int
    frames: int
    cost: Cost
    ssd_cost: Cost | None


def measure_speeds(detectors: Mapping[str, PersonDetector], repeats: int = REPEATS) -> list[Speed]:
    """Return what each stage of each net costs; the frames are those of Table 2, the renderer's time is not in it.

    Args:
        detectors: The trained ones.
        repeats: Frames timed of each; at most `FULL_REPEATS` of the full nets.
    """
    frames = list(play(Film("blue", 1, 8 * _PICTURES), range(_PICTURES)))
    pictures = [network_input(frame.rgb, None) for frame in frames]
    operations: dict[tuple[str, str], Callable[[], object]] = {}
    networks = {net: detectors[net].network if net in detectors else make_network(net).eval() for net in NETS}
    for net, network in networks.items():
        operations[net, "network"] = _forward(network, pictures)
        if net in detectors:
            operations[net, "detector"] = _detecting(detectors[net], frames)
            operations[net, "tracker"] = _tracking(detectors[net], frames)
    speeds = _speeds(operations, networks, repeats, detectors, ssd=SSD)
    networks = {net: make_network(net).eval() for net in FULL.values()}
    operations = {(net, "network"): _forward(network, pictures) for net, network in networks.items()}
    return speeds + _speeds(operations, networks, min(repeats, FULL_REPEATS), detectors, ssd=FULL[SSD])


def write(speeds: Sequence[Speed], done: str, folder: Path) -> None:
    """Write `timing.csv` and `timing.md`.

    Args:
        speeds: What was measured.
        done: A sentence about what playing the experiments took.
        folder: Results folder.
    """
    records: list[dict[str, Value]] = [
        {
            "net": speed.net,
            "trained": int(speed.trained),
            "stage": speed.stage,
            "macs": speed.macs,
            "frames": speed.frames,
            "median_s": speed.cost.median,
            "fastest_s": speed.cost.fastest,
            "cpu_median_s": speed.cost.cpu_median,
            "frames_per_s": 1.0 / speed.cost.median,
            "of_ssd": None if speed.ssd_cost is None else speed.ssd_cost.median / speed.cost.median,
        }
        for speed in speeds
    ]
    write_csv(folder / "timing.csv", COLUMNS, records, 6)
    write_text(folder / "timing.md", f"{done}\n\n{table(speeds)}\n")


def table(speeds: Sequence[Speed]) -> str:
    """Return the speeds as Markdown, with the paper's below."""
    header = ["net", "stage", "GMAC", "frames", "median (ms)", "fastest (ms)", "CPU median (ms)", "frames/s"]
    header += ["speed over the SSD's", "by CPU time"]
    lines = []
    for speed in speeds:
        cost, ssd = speed.cost, speed.ssd_cost
        times = [f"{1e3 * value:.1f}" for value in (cost.median, cost.fastest, cost.cpu_median)]
        ratios = ["–", "–"]
        if ssd is not None and ssd is not cost:
            ratios = [f"{ssd.median / cost.median:.2f} x", f"{ssd.cpu_median / cost.cpu_median:.2f} x"]
        net = speed.net if speed.trained else f"{speed.net} (untrained)"
        lines.append(
            [
                *(net, STAGES[speed.stage], f"{speed.macs / 1e9:.2f}", str(speed.frames), *times),
                *(f"{1.0 / cost.median:.1f}", *ratios),
            ]
        )
    return (
        "# Table 3, measured here\n\n"
        f"One thread, pictures of 320 x 240 px that are rendered before. `{SSD}` and `{OURS}` have the same light "
        f"trunk,\n`{FULL[SSD]}` and `{FULL[OURS]}` the paper's. The trackers process every frame.\n\n"
        f"{markdown_table(header, lines, left=2)}\n\n"
        "The paper's: SSD 60 and theirs 66 frames/s on a Titan X (1.10 x), 10 to 11 and 11 to 12 on a Jetson TX2."
    )


def _speeds(
    operations: Mapping[tuple[str, str], Callable[[], object]],
    networks: Mapping[str, MultiBoxNet],
    repeats: int,
    detectors: Mapping[str, PersonDetector],
    ssd: str,
) -> list[Speed]:
    macs = {net: count_macs(network) for net, network in networks.items()}
    costs = measure({f"{net} {stage}": operation for (net, stage), operation in operations.items()}, repeats)
    return [
        Speed(net, net in detectors, stage, macs[net], repeats, costs[f"{net} {stage}"], costs.get(f"{ssd} {stage}"))
        for net, stage in operations
    ]


def _forward(network: torch.nn.Module, pictures: Sequence[np.ndarray]) -> Callable[[], object]:
    following = itertools.cycle(pictures)
    return lambda: predict(network, next(following)[None])  # type: ignore[arg-type]


def _detecting(detector: PersonDetector, frames: Sequence[RGBDFrame]) -> Callable[[], object]:
    following = itertools.cycle(frames)

    def detect() -> object:
        frame = next(following)
        return detector.detect(frame.rgb, frame.depth)

    return detect


def _tracking(detector: PersonDetector, frames: Sequence[RGBDFrame]) -> Callable[[], object]:
    following: Iterator[RGBDFrame] = itertools.cycle(frames)
    height, width = frames[0].depth.shape
    tracker = PersonTracker(detector, XTION_PRO.scaled(width, height), settings=TrackerSettings(rate=10.0, every=1))

    def track() -> object:
        frame = next(following)
        seen = tracker.update(frame.rgb, frame.depth)
        if seen.alarm:
            tracker.confirm()  # a tracker that has stopped would cost nothing
        return seen

    return track
