"""Training: pictures made while they are needed, one cosine cycle of AdamW, and an average of the weights to keep.

A run writes `config.json`, `log.csv`, `evaluation.csv`, `curves.png`, `weights.safetensors` (the average, what
`PersonDetector` reads) with their `card.json`, and `state.pt`, from which it goes on to the weights that it would have
had without a break.
"""

import csv
import dataclasses
import hashlib
import json
import math
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
import torch
from torch.utils.data import DataLoader, Dataset

from baselines.learned.detector.data import DataConfig, SampleSource, without_augmentation
from baselines.learned.detector.evaluation import Score, evaluate
from baselines.learned.detector.loss import Loss, multibox_loss
from follow_env.registry import choose
from tracker.detection.detector import network_input, to_tensor
from tracker.detection.networks import NETS, count_macs, count_parameters, make_network
from tracker.detection.priors import match, prior_boxes
from tracker.detection.weights import load_network, save_weights

TEST_SEED = 1_000_000
"""Seed of the held-out pictures; training takes smaller ones."""
COUNTED = ("tp", "fp", "fn")


@dataclass(frozen=True)
class TrainConfig:
    """A training run; the same settings give the same weights on the same machine.

    Attributes:
        net: one of `NETS`.
        steps: batches.
        batch: pictures in each.
        rate: largest learning rate.
        warmup: share of the steps in which the rate rises from zero; then it falls to zero along a cosine.
        weight_decay: of AdamW, on kernels.
        clip: largest norm of the gradient.
        average: decay of the running average of the weights, a step; it starts faster.
        seed: of the weights and the pictures, below `TEST_SEED`.
        evaluate_every: steps.
        test_pictures: held-out pictures of an evaluation.
        start: weights to start from instead of random ones.
        data: what the pictures show.
    """

    net: str = "light"
    steps: int = 16_000
    batch: int = 16
    rate: float = 1.5e-3
    warmup: float = 0.06
    weight_decay: float = 0.02
    clip: float = 10.0
    average: float = 0.999
    seed: int = 0
    evaluate_every: int = 1000
    test_pictures: int = 200
    start: str | None = None
    data: DataConfig = field(default_factory=DataConfig)

    def __post_init__(self) -> None:
        choose("net", self.net, NETS)
        for name in ("steps", "batch", "evaluate_every", "test_pictures"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is {getattr(self, name)}; expected at least 1")
        if not 0.0 < self.rate < 0.1:
            raise ValueError(f"rate is {self.rate}; expected a learning rate above 0 and below 0.1")
        if not 0 <= self.seed < TEST_SEED:
            raise ValueError(f"seed is {self.seed}; expected 0 to {TEST_SEED - 1} (the others are for testing)")
        if NETS[self.net].depth != self.data.depth:
            raise ValueError(f"the net {self.net!r} and data.depth = {self.data.depth} do not go together")


def train(
    config: TrainConfig, out: Path, workers: int = 1, resume: bool = False, tell: Callable[[str], None] = print
) -> Score:
    """Train a network and return its score on held-out pictures; torch takes all cores but one, in the whole process.

    Args:
        config: the run.
        out: folder for what it writes.
        workers: processes that make pictures; 0 makes them in this one. They do not change the weights.
        resume: go on from the folder's last state.
        tell: takes a line at every evaluation.

    Raises:
        ValueError: if the folder holds a run already and is not to be resumed, or one of other settings.
    """
    said = json.loads(json.dumps(dataclasses.asdict(config)))
    record = out / "config.json"
    if record.exists() and not resume:
        raise ValueError(f"{out} holds a run already; go on with it by --resume, or name another folder with --out")
    if record.exists() and json.loads(record.read_text(encoding="utf-8")) != said:
        raise ValueError(f"{out} holds a run of other settings; repeat those of {record}, or name another folder")
    out.mkdir(parents=True, exist_ok=True)
    record.write_text(json.dumps(said, indent=1) + "\n", encoding="utf-8")
    run = _Run(config, out, workers, tell)
    score = run.go()
    _write_card(out, run.precision)
    return score


def _write_card(out: Path, precision: str) -> None:
    """Write `card.json` beside the weights of a run: what they are and how they came about.

    Weights that the run started from are named by their SHA-256; if a card lies beside them, it becomes part of this.
    """
    settings = json.loads((out / "config.json").read_text(encoding="utf-8"))
    with (out / "evaluation.csv").open(encoding="utf-8", newline="") as file:
        *_, last = csv.DictReader(file)
    start = None if settings["start"] is None else Path(settings["start"])
    before = None
    if start is not None:
        card = start.with_name("card.json")
        before = json.loads(card.read_text(encoding="utf-8")) if card.exists() else {"weights_sha256": _digest(start)}
    network = make_network(settings["net"])
    card_of_run = {
        "net": settings["net"],
        "weights_sha256": _digest(out / "weights.safetensors"),
        "parameters": count_parameters(network),
        "macs": count_macs(network),
        "steps": int(last["step"]),
        "pictures": int(last["step"]) * settings["batch"],
        "training_s": float(last["seconds"]),
        "torch": torch.__version__,
        "precision": precision,
        "held_out": {key: float(last[key]) if key == "ap" else int(last[key]) for key in ("pictures", "ap", *COUNTED)},
        "settings": settings,
        "started_from": before,
    }
    (out / "card.json").write_text(json.dumps(card_of_run, indent=1) + "\n", encoding="utf-8")


def choose_precision(device: torch.device) -> str:
    """Return in which numbers a device convolves while training: bfloat16 on GPUs and on CPUs with AMX."""
    halves = device.type == "cuda" or torch.cpu.get_capabilities().get("amx_bf16", False)
    return "bfloat16" if halves else "float32"


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


class _Run:
    """The state of a training run."""

    def __init__(self, config: TrainConfig, out: Path, workers: int, tell: Callable[[str], None]) -> None:
        self.config, self.out, self.workers, self.tell = config, out, workers, tell
        torch.set_num_threads(max(1, (os.cpu_count() or 1) - 1))  # on a core shared with a worker one holds up all
        self.device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        self.precision = choose_precision(self.device)
        torch.manual_seed(config.seed)
        fresh = make_network(config.net) if config.start is None else load_network(config.net, Path(config.start))
        self.network = fresh.train().to(self.device)
        self.averaged = make_network(config.net).to(self.device)
        self.averaged.load_state_dict(self.network.state_dict())
        kernels = [p for p in self.network.parameters() if p.ndim > 1]
        others = [p for p in self.network.parameters() if p.ndim <= 1]
        groups = [{"params": kernels, "weight_decay": config.weight_decay}, {"params": others, "weight_decay": 0.0}]
        self.optimizer = torch.optim.AdamW(groups, lr=config.rate)
        self.step, self.seconds = 0, 0.0
        test = without_augmentation(dataclasses.replace(config.data, pictures_per_scene=2))
        self.test = SampleSource(TEST_SEED, test)
        state = out / "state.pt"
        if state.exists():
            self._restore(torch.load(state, map_location=self.device, weights_only=True))

    def go(self) -> Score:
        """Train until the last step; what is written is complete at every evaluation."""
        config = self.config
        rows: list[list[float]] = []
        result: Score | None = None
        for pictures, targets in self._batches():
            begun = time.perf_counter()
            loss = self._learn(pictures, targets)
            self.step += 1
            self.seconds += time.perf_counter() - begun
            rows.append([self.step, *(round(float(part), 5) for part in loss), self._rate(self.step - 1)])
            if self.step % config.evaluate_every == 0 or self.step == config.steps:
                result = self._save(rows)
                rows = []
        return result or evaluate(self.averaged, self.test, config.test_pictures)

    def _batches(self) -> Iterator[tuple[torch.Tensor, list[torch.Tensor]]]:
        loader = DataLoader(
            _Batches(self.config),
            batch_size=None,
            sampler=range(self.step, self.config.steps),
            num_workers=self.workers,
            worker_init_fn=_use_one_thread,
            multiprocessing_context="spawn" if self.workers else None,  # a fork would copy locked thread pools
        )
        yield from loader

    def _learn(self, pictures: torch.Tensor, targets: list[torch.Tensor]) -> Loss:
        for group in self.optimizer.param_groups:
            group["lr"] = self._rate(self.step)
        inputs = to_tensor(pictures.to(self.device, non_blocking=True))
        with torch.autocast(self.device.type, torch.bfloat16, enabled=self.precision == "bfloat16"):
            logits, coded = self.network(inputs)
        loss = multibox_loss(logits.float(), coded.float(), *(part.to(self.device) for part in targets))
        if not torch.isfinite(loss.total):
            raise FloatingPointError(f"the loss is {float(loss.total)} at step {self.step}; lower the rate")
        self.optimizer.zero_grad(set_to_none=True)
        loss.total.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), self.config.clip)
        self.optimizer.step()
        keep = min(self.config.average, (1 + self.step) / (10 + self.step))
        with torch.no_grad():
            for mean, now in zip(self.averaged.state_dict().values(), self.network.state_dict().values(), strict=True):
                if mean.is_floating_point():
                    mean.lerp_(now, 1.0 - keep)
        return Loss(*(part.detach() for part in loss))

    def _rate(self, step: int) -> float:
        rise = max(self.config.warmup * self.config.steps, 1.0)
        if step < rise:
            return self.config.rate * (step + 1) / (rise + 1)
        return 0.5 * self.config.rate * (1.0 + math.cos(math.pi * (step - rise) / (self.config.steps - rise)))

    def _save(self, rows: list[list[float]]) -> Score:
        result = evaluate(self.averaged, self.test, self.config.test_pictures)
        _append(self.out / "log.csv", ["step", "loss", "classification", "location", "rate"], rows)
        counts = [result.pictures, round(result.ap, 5), result.tp, result.fp, result.fn]
        header = ["step", "seconds", "pictures", "ap", "tp", "fp", "fn"]
        _append(self.out / "evaluation.csv", header, [[self.step, round(self.seconds, 1), *counts]])
        save_weights(self.averaged, self.out / "weights.safetensors")
        state = {
            "step": self.step,
            "seconds": self.seconds,
            "precision": self.precision,
            "network": self.network.state_dict(),
            "averaged": self.averaged.state_dict(),
            "optimizer": self.optimizer.state_dict(),
        }
        torch.save(state, self.out / "state.tmp")
        (self.out / "state.tmp").replace(self.out / "state.pt")
        draw_curves(self.out)
        mean = float(np.mean([row[1] for row in rows]))
        self.tell(
            f"step {self.step}/{self.config.steps}: loss {mean:.3f}, held out AP {result.ap:.3f}, "
            f"TP {result.tp}, FP {result.fp}, FN {result.fn}; {self.seconds / 60:.1f} min of training"
        )
        return result

    def _restore(self, state: dict) -> None:
        self.step, self.seconds, self.precision = state["step"], state["seconds"], state["precision"]
        self.network.load_state_dict(state["network"])
        self.averaged.load_state_dict(state["averaged"])
        self.optimizer.load_state_dict(state["optimizer"])


class _Batches(Dataset):
    """Batch number -> pictures (B, 300, 300, C) uint8, and the `Targets` of their priors with a leading axis."""

    def __init__(self, config: TrainConfig) -> None:
        self._config = config
        self._priors = prior_boxes(NETS[config.net].layers)
        self._source: SampleSource | None = None

    def __getitem__(self, number: int) -> tuple[np.ndarray, list[np.ndarray]]:
        if self._source is None:
            self._source = SampleSource(self._config.seed, self._config.data)
        pictures, targets = [], []
        for k in range(number * self._config.batch, (number + 1) * self._config.batch):
            sample = self._source.sample(k)
            pictures.append(network_input(sample.rgb, sample.depth))
            targets.append(match(sample.boxes, sample.difficult, self._priors))
        return np.stack(pictures), [np.stack(part) for part in zip(*targets, strict=True)]


def _use_one_thread(_: int) -> None:
    cv2.setNumThreads(1)
    torch.set_num_threads(1)


def draw_curves(out: Path) -> None:
    """Write `curves.png`: the loss and the held-out average precision of the run in a folder over its steps."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot, ticker

    losses = np.genfromtxt(out / "log.csv", delimiter=",", names=True, ndmin=1)
    scores = np.genfromtxt(out / "evaluation.csv", delimiter=",", names=True, ndmin=1)
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
    span = max(1, min(50, len(losses) // 4))
    smooth = np.convolve(losses["loss"], np.full(span, 1.0 / span), mode="valid")
    left.plot(losses["step"], losses["loss"], color="0.8", linewidth=0.5)
    left.plot(losses["step"][span - 1 :], smooth, color="tab:blue")
    left.set(xlabel="step", ylabel="MultiBox loss", yscale="log")
    left.yaxis.set_major_locator(ticker.LogLocator(subs=(1.0, 2.0, 5.0)))
    left.yaxis.set_major_formatter("{x:g}")
    left.yaxis.set_minor_formatter(ticker.NullFormatter())
    right.plot(scores["step"], scores["ap"], marker="o", color="tab:green")
    right.set(xlabel="step", ylabel="AP at overlap 0.5, held-out scenes", ylim=(0.0, 1.0))
    for axes in (left, right):
        axes.xaxis.set_major_locator(ticker.MaxNLocator(5, integer=True))
    figure.savefig(out / "curves.png", dpi=110)
    pyplot.close(figure)


def _append(path: Path, header: list[str], rows: list[list[float]]) -> None:
    new = not path.exists()
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        if new:
            writer.writerow(header)
        writer.writerows(rows)
