"""The networks: paper A's with shared features, the two-class SSD300 it is compared with, and both on a light trunk.

A network takes pictures (B, C, 300, 300), float32 in [0, 1] (red, green, blue and, if asked for, depth / 8 m), and
returns the logits (B, P, 2) of background and person and the offsets (B, P, 4) of all its priors.
"""

import itertools
from dataclasses import dataclass

import torch
from torch import nn

from follow_env.registry import choose
from tracker.detection.priors import PAPER_LAYERS, SSD300_LAYERS, PriorLayer

CLASSES = 2
DEPTH_RANGE = 8.0
"""Depth that the fourth channel calls 1, m; no reading is 0."""


@dataclass(frozen=True)
class NetConfig:
    """What a network is made of.

    Attributes:
        name: of the network.
        trunk: "vgg16" or "light".
        shared: whether lower layers' features are pooled and joined to the upper (Concat7 to Concat9 of paper A).
        layers: priors; six layers also predict from the trunk's 38 x 38 map.
        widths: channels of the four layers above the 19 x 19 map.
        squeeze: channels between them.
        depth: whether there is a fourth channel.
    """

    name: str
    trunk: str
    shared: bool
    layers: tuple[PriorLayer, ...]
    widths: tuple[int, int, int, int]
    squeeze: tuple[int, int, int, int]
    depth: bool = False


_VGG, _LIGHT = ((512, 256, 256, 256), (256, 128, 128, 128)), ((128, 128, 128, 128), (64, 64, 64, 64))

NETS = {
    "light": NetConfig("light", "light", True, PAPER_LAYERS, *_LIGHT),
    "light_depth": NetConfig("light_depth", "light", True, PAPER_LAYERS, *_LIGHT, depth=True),
    "light_ssd": NetConfig("light_ssd", "light", False, SSD300_LAYERS, *_LIGHT),
    "paper": NetConfig("paper", "vgg16", True, PAPER_LAYERS, *_VGG),
    "ssd300": NetConfig("ssd300", "vgg16", False, SSD300_LAYERS, *_VGG),
}
"""Networks by name."""


def make_network(name: str) -> "MultiBoxNet":
    """Return the network `name` with random weights; a ValueError names the nearest when there is none.

    Its kernels lie in memory as the convolutions of a CPU read them fastest (channels last).
    """
    network = MultiBoxNet(NETS[choose("net", name, NETS)])
    return network.to(memory_format=torch.channels_last)  # type: ignore[call-overload]


class MultiBoxNet(nn.Module):
    """A trunk, four layers above it and a 3 x 3 head on each prediction layer (paper A, figures 4 and 5)."""

    def __init__(self, config: NetConfig) -> None:
        super().__init__()
        self.config = config
        channels = 4 if config.depth else 3
        self.trunk = _VggTrunk(channels) if config.trunk == "vgg16" else _LightTrunk(channels)
        unit = _plain if config.trunk == "vgg16" else _normed
        widths = (self.trunk.top, *config.widths)
        self.chain = nn.ModuleList(
            nn.Sequential(unit(below, squeeze, 1), unit(squeeze, width, 3, *spacing))
            for below, squeeze, width, spacing in zip(
                widths[:-1], config.squeeze, widths[1:], ((2, 1), (2, 1), (1, 0), (1, 0)), strict=True
            )
        )
        pairs = list(itertools.pairwise(widths[:4])) if config.shared else []
        self.lower_norms = nn.ModuleList(nn.BatchNorm2d(below) for below, _ in pairs)
        self.upper_norms = nn.ModuleList(nn.BatchNorm2d(width) for _, width in pairs)
        seen = [widths[0], *(sum(pair) for pair in pairs), *widths[1 + len(pairs) :]]
        if len(config.layers) == len(seen) + 1:
            seen.insert(0, self.trunk.middle)
        self.heads = nn.ModuleList(
            nn.Conv2d(width, layer.per_cell * (4 + CLASSES), 3, padding=1)
            for width, layer in zip(seen, config.layers, strict=True)
        )
        self.apply(_initialize)
        for head in self.heads:
            nn.init.normal_(
                head.get_parameter("weight"), std=0.01
            )  # at first every prior says "perhaps", and says it of itself

    def forward(self, pictures: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return logits (B, P, 2) and offsets (B, P, 4)."""
        middle, top = self.trunk(pictures)
        maps = [top]
        for layer in self.chain:
            maps.append(layer(maps[-1]))
        seen = list(maps)
        for k, (lower, upper) in enumerate(zip(self.lower_norms, self.upper_norms, strict=True)):
            pooled = nn.functional.max_pool2d(maps[k], 3, stride=2, padding=1)
            seen[k + 1] = torch.cat([lower(pooled), upper(maps[k + 1])], dim=1)
        if len(self.heads) > len(seen):
            seen.insert(0, middle)
        batch = len(pictures)
        said = torch.cat(
            [
                head(features).permute(0, 2, 3, 1).reshape(batch, -1, 4 + CLASSES)
                for head, features in zip(self.heads, seen, strict=True)
            ],
            dim=1,
        )
        return said[..., 4:], said[..., :4]


class _VggTrunk(nn.Module):
    """VGG-16 up to conv5_3, with fc6 and fc7 as convolutions; the 38 x 38 map is scaled to length 20 (SSD)."""

    middle, top = 512, 1024

    def __init__(self, channels: int) -> None:
        super().__init__()
        blocks: list[nn.Sequential] = []
        for width, count in ((64, 2), (128, 2), (256, 3), (512, 3), (512, 3)):
            units = []
            for _ in range(count):
                units.append(_plain(channels, width, 3, 1, 1))
                channels = width
            blocks.append(nn.Sequential(*units))
        half = nn.MaxPool2d(2, ceil_mode=True)
        self.lower = nn.Sequential(blocks[0], half, blocks[1], half, blocks[2], half, blocks[3])
        self.upper = nn.Sequential(
            half,
            blocks[4],
            nn.MaxPool2d(3, stride=1, padding=1),
            nn.Conv2d(512, 1024, 3, padding=6, dilation=6),
            nn.ReLU(inplace=True),
            _plain(1024, 1024, 1),
        )
        self.length = nn.Parameter(torch.full((512,), 20.0))

    def forward(self, pictures: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        features = self.lower(pictures)
        scaled = nn.functional.normalize(features, dim=1) * self.length[:, None, None]
        return scaled, self.upper(features)


class _LightTrunk(nn.Module):
    """A small residual trunk. Plain convolutions: on a CPU they cost less time than depthwise ones of a fifth."""

    middle, top = 64, 96

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.lower = nn.Sequential(_normed(channels, 16, 3, 2, 1), _normed(16, 32, 3, 2, 1), _Residual(32, 64, 2))
        self.upper = nn.Sequential(_Residual(64, 96, 2), _Residual(96, 96, 1))

    def forward(self, pictures: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        features = self.lower(pictures)
        return features, self.upper(features)


class _Residual(nn.Module):
    """Two 3 x 3 convolutions beside a shortcut (He et al., 2016)."""

    def __init__(self, below: int, width: int, stride: int) -> None:
        super().__init__()
        self.first = _normed(below, width, 3, stride, 1)
        self.second = _normed(width, width, 3, 1, 1)[:-1]
        same = stride == 1 and below == width
        self.shortcut = nn.Identity() if same else _normed(below, width, 1, stride)[:-1]

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        return nn.functional.relu(self.second(self.first(features)) + self.shortcut(features), inplace=True)


def _plain(below: int, width: int, kernel: int, stride: int = 1, padding: int = 0) -> nn.Sequential:
    return nn.Sequential(nn.Conv2d(below, width, kernel, stride, padding), nn.ReLU(inplace=True))


def _normed(below: int, width: int, kernel: int, stride: int = 1, padding: int = 0) -> nn.Sequential:
    convolution = nn.Conv2d(below, width, kernel, stride, padding, bias=False)
    return nn.Sequential(convolution, nn.BatchNorm2d(width), nn.ReLU(inplace=True))


def _initialize(module: nn.Module) -> None:
    """He et al. (2015): what keeps a deep net with rectifiers trainable from random weights."""
    if isinstance(module, nn.Conv2d):
        nn.init.kaiming_normal_(module.weight, mode="fan_in", nonlinearity="relu")
        if module.bias is not None:
            nn.init.zeros_(module.bias)


def count_macs(network: MultiBoxNet) -> int:
    """Return the multiplications of all convolutions for one picture, counted while one passes."""
    total = 0

    def count(module: nn.Module, _: object, result: torch.Tensor) -> None:
        nonlocal total
        assert isinstance(module, nn.Conv2d)
        total += result[0].numel() * module.weight[0].numel()

    hooks = [m.register_forward_hook(count) for m in network.modules() if isinstance(m, nn.Conv2d)]
    training = network.training
    try:
        with torch.inference_mode():
            network.eval()(torch.zeros(1, 4 if network.config.depth else 3, 300, 300))
    finally:
        network.train(training)
        for hook in hooks:
            hook.remove()
    return total


def count_parameters(network: MultiBoxNet) -> int:
    """Return the number of trained weights."""
    return sum(parameter.numel() for parameter in network.parameters())
