"""The networks: what comes out, what they cost, and that they learn."""

import numpy as np
import pytest
import torch

from baselines.learned.detector.data import SampleSource
from baselines.learned.detector.loss import multibox_loss
from baselines.learned.detector.training import choose_precision
from tracker.detection.detector import network_input, to_tensor
from tracker.detection.networks import NETS, count_macs, count_parameters, make_network
from tracker.detection.priors import match, prior_boxes


@pytest.mark.parametrize(("name", "priors"), [("light", 2252), ("light_depth", 2252), ("light_ssd", 8732)])
def test_light_networks_say_something_of_every_prior(name: str, priors: int) -> None:
    network = make_network(name).eval()
    with torch.inference_mode():
        logits, offsets = network(torch.rand(2, 4 if NETS[name].depth else 3, 300, 300))
    assert logits.shape == (2, priors, 2)
    assert offsets.shape == (2, priors, 4)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "priors", "macs"), [("paper", 2252, 30.27e9), ("ssd300", 8732, 30.43e9)])
def test_the_papers_network_saves_half_a_percent_of_the_work(name: str, priors: int, macs: float) -> None:
    network = make_network(name).eval()
    with torch.inference_mode():
        logits, offsets = network(torch.rand(1, 3, 300, 300))
    assert (logits.shape, offsets.shape) == ((1, priors, 2), (1, priors, 4))
    assert count_macs(network) == pytest.approx(macs, rel=2e-4)


def test_the_light_network_fits_a_small_robot() -> None:
    network = make_network("light")
    assert count_macs(network) < 0.3e9
    assert 2 * count_parameters(network) < 2.5e6  # bytes on disk


def test_macs_are_those_of_the_first_layer_by_hand() -> None:
    first = make_network("light")
    without = make_network("light")
    without.trunk.lower[0][0] = torch.nn.Conv2d(3, 16, 1, stride=2, bias=False)  # 1 x 1 instead of 3 x 3
    assert count_macs(first) - count_macs(without) == 150 * 150 * 16 * 3 * (9 - 1)


@pytest.mark.parametrize("name", ["light", "light_ssd"])
def test_every_weight_gets_a_gradient(name: str) -> None:
    torch.manual_seed(0)
    network = make_network(name).train()
    logits, offsets = network(torch.rand(2, 3, 300, 300))
    labels = (torch.rand(logits.shape[:2]) < 0.5).long()
    multibox_loss(logits, offsets, labels, torch.randn_like(offsets), labels.float()).total.backward()
    silent = [n for n, p in network.named_parameters() if p.grad is None or not p.grad.abs().sum() > 0]
    assert silent == []


@pytest.mark.parametrize(
    ("name", "steps", "rate", "share"),
    [
        ("light", 12, 3e-3, 0.6),
        ("light_ssd", 12, 3e-3, 0.6),
        pytest.param("paper", 4, 1e-4, 0.95, marks=pytest.mark.slow),
        pytest.param("ssd300", 4, 1e-4, 0.95, marks=pytest.mark.slow),
    ],
)
def test_a_network_learns_eight_pictures(name: str, steps: int, rate: float, share: float) -> None:
    torch.manual_seed(0)
    torch.set_num_threads(1)
    source, priors = SampleSource(5), prior_boxes(NETS[name].layers)
    samples = [source.sample(k) for k in range(8)]
    pictures = torch.stack([torch.from_numpy(network_input(s.rgb, None)) for s in samples])
    matched = [match(s.boxes, s.difficult, priors) for s in samples]
    targets = [torch.from_numpy(np.stack(part)) for part in zip(*matched, strict=True)]
    network = make_network(name).train()
    optimizer = torch.optim.AdamW(network.parameters(), lr=rate)
    losses = []
    for _ in range(steps):
        with torch.autocast("cpu", torch.bfloat16, enabled=choose_precision(torch.device("cpu")) == "bfloat16"):
            logits, offsets = network(to_tensor(pictures))
        loss = multibox_loss(logits.float(), offsets.float(), *targets)
        optimizer.zero_grad()
        loss.total.backward()
        optimizer.step()
        losses.append(loss.total.item())
    assert losses[-1] < share * losses[0]


def test_an_unknown_name_is_answered_with_the_nearest() -> None:
    with pytest.raises(ValueError, match="did you mean 'ssd300'"):
        make_network("ssd3000")
