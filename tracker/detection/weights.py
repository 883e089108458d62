"""Weights on disk: safetensors in half precision, with the name and the make of the network they belong to."""

import dataclasses
import hashlib
import json
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file

from tracker.detection.networks import NETS, MultiBoxNet, NetConfig, make_network

FORMAT = "follow-env person detector 1"


def fingerprint(config: NetConfig) -> str:
    """Return twelve hexadecimal digits that change with anything the network is made of."""
    return hashlib.sha256(json.dumps(dataclasses.asdict(config), sort_keys=True).encode()).hexdigest()[:12]


def save_weights(network: MultiBoxNet, path: Path) -> None:
    """Write the weights; kernels as float16, everything else (a thousandth of it) as float32."""
    state = {
        name: tensor.detach().cpu().to(torch.float16 if tensor.ndim > 1 else torch.float32).contiguous()
        for name, tensor in network.state_dict().items()
        if tensor.is_floating_point()  # the counters of batch normalisation are of no use here
    }
    config = network.config
    save_file(state, path, {"format": FORMAT, "net": config.name, "config": fingerprint(config)})


def load_network(name: str, path: Path) -> MultiBoxNet:
    """Return the network `name` with the weights of a file, ready to detect.

    Raises:
        FileNotFoundError: if there is no such file.
        ValueError: if the file holds no weights, or those of another network.
    """
    network = make_network(name)
    if not path.is_file():
        raise FileNotFoundError(f"the weights {str(path)!r} do not exist; name a file that `follow detector train` wrote")
    try:
        with safe_open(path, "pt") as file:
            said = file.metadata() or {}
            state = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118
    except SafetensorError as error:
        raise ValueError(f"{str(path)!r} holds no weights ({error}); expected a safetensors file") from error
    if said.get("format") != FORMAT or said.get("net") != name:
        raise ValueError(
            f"{str(path)!r} holds weights of the net {said.get('net')!r} (format {said.get('format')!r}); "
            f"expected {name!r} ({FORMAT!r}): choose the net that it names"
        )
    if said.get("config") != fingerprint(NETS[name]):
        raise ValueError(
            f"{str(path)!r} was trained for a net {name!r} of another make ({said.get('config')}, now "
            f"{fingerprint(NETS[name])}); train it again with `follow detector train --net {name}`"
        )
    counters = {key: value for key, value in network.state_dict().items() if not value.is_floating_point()}
    network.load_state_dict({key: value.float() for key, value in state.items()} | counters)
    return network.eval()
