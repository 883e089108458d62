"""Weights on disk: safetensors in half precision, with the name and the make of the network they belong to."""

import dataclasses
import hashlib
import json
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file

from tracker.detection.networks import MultiBoxNet, NetConfig, make_network


def save_weights(network: MultiBoxNet, path: Path) -> None:
    """Write the weights; kernels as float16, everything else (a thousandth of it) as float32."""
    state = {
        name: tensor.detach().cpu().to(torch.float16 if tensor.ndim > 1 else torch.float32).contiguous()
        for name, tensor in network.state_dict().items()
        if tensor.is_floating_point()  # the counters of batch normalization are of no use here
    }
    save_file(state, path, {"made": _made(network.config)})


def load_network(name: str, path: Path) -> MultiBoxNet:
    """Return the network `name` with the weights of a file, ready to detect.

    Raises:
        FileNotFoundError: if there is no such file.
        ValueError: if the file holds no weights, or those of another network.
    """
    network = make_network(name)
    if not path.is_file():
        raise FileNotFoundError(
            f"the weights {str(path)!r} do not exist; name a file that `follow detector train` wrote"
        )
    try:
        with safe_open(path, "pt") as file:
            made = (file.metadata() or {}).get("made", "nothing of ours")
            state = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118
    except SafetensorError as error:
        raise ValueError(f"{str(path)!r} holds no weights ({error}); expected a safetensors file") from error
    if made != _made(network.config):
        raise ValueError(
            f"{str(path)!r} holds {made}; expected {_made(network.config)}: choose the net that it names, or "
            f"train again with `follow detector train --net {name}`"
        )
    counters = {key: value for key, value in network.state_dict().items() if not value.is_floating_point()}
    network.load_state_dict({key: value.float() for key, value in state.items()} | counters)
    return network.eval()


def _made(config: NetConfig) -> str:
    """Return a sentence that changes with the network's name and with anything it is made of."""
    make = hashlib.sha256(json.dumps(dataclasses.asdict(config), sort_keys=True).encode()).hexdigest()[:12]
    return f"weights of the net {config.name!r}, make {make}"
