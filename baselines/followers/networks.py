"""The shipped agents' networks, compiled: sums in a fixed order, so an agent drives with the same bits everywhere.

A network is a flat mapping of float32 arrays, as it stands in the weights file:

- `input.offset`, `input.scale` (n,): features = clip((observation - offset) * scale, -CLIP, CLIP); not for pictures;
- `conv.<i>.weight` (out, in, k, k), `conv.<i>.bias` (out,), `conv.<i>.stride` (1,): ReLU after each, no padding;
- `lstm.weight_ih` (4h, n), `lstm.weight_hh` (4h, h), `lstm.bias` (4h,): gates in torch's order (i, f, g, o);
- `dense.<i>.weight` (out, in), `dense.<i>.bias` (out,): the last one is the action.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numba
import numpy as np

CLIP = 5.0
ACTIVATIONS = ("tanh", "relu")

Arrays = Mapping[str, np.ndarray]
Memory = tuple[np.ndarray, np.ndarray]
"""Hidden and cell state of the LSTM, (h,) float64 each."""


class Network:
    """A policy network without torch.

    Args:
        arrays: see the module.
        activation: between dense layers, one of `ACTIVATIONS`.
        squash: whether tanh bounds the action (SAC); otherwise it is clipped (PPO).

    Raises:
        ValueError: if an array is missing, does not fit the others or is not finite.
    """

    def __init__(self, arrays: Arrays, activation: str, squash: bool) -> None:
        for name, array in arrays.items():
            if not np.isfinite(array).all():
                raise ValueError(f"the weights {name} are not all finite; the file is damaged: get it again")
        wide = {name: np.ascontiguousarray(array, np.float64) for name, array in arrays.items()}
        try:
            self._dense = _layers(wide, "dense")
            self._conv = [(w, b, int(wide[f"conv.{i}.stride"][0])) for i, (w, b) in enumerate(_layers(wide, "conv"))]
            self._input = None if self._conv else (wide["input.offset"], wide["input.scale"])
            lstm = "lstm.bias" in wide
            self._lstm = (wide["lstm.weight_ih"], wide["lstm.weight_hh"], wide["lstm.bias"]) if lstm else None
        except KeyError as missing:
            raise ValueError(f"the weights lack {missing}; the file is not one of this project's agents") from None
        self._check()
        self._activation, self._squash = ACTIVATIONS.index(activation), squash

    @property
    def inputs(self) -> int:
        """Length of the observation, or number of the picture's channels."""
        return self._conv[0][0].shape[1] if self._conv else len(self._input[0])  # type: ignore[index]

    def _check(self) -> None:
        """Raise a ValueError unless each array fits the one before: the kernels do not look."""
        if not self._dense or self._dense[-1][0].shape[0] != 2:
            raise ValueError("the weights do not end in two actions; the file is not one of this project's agents")
        chain = [array for layer in self._dense for array in (layer[0].shape[1], layer[0].shape[0])]
        fits = all(w.ndim == 2 and b.shape == w.shape[:1] for w, b in self._dense) and chain[1:-1:2] == chain[2::2]
        if self._lstm is not None:
            w_ih, w_hh, bias = self._lstm
            units = w_hh.shape[1]
            fits &= len(w_ih) == len(w_hh) == len(bias) == 4 * units and chain[0] == units
        if self._input is not None:
            size = self._lstm[0].shape[1] if self._lstm else chain[0]
            fits &= self._input[0].shape == self._input[1].shape == (size,)
        channels = [n for w, _, _ in self._conv for n in (w.shape[1], w.shape[0])]
        fits &= all(w.ndim == 4 and w.shape[2] == w.shape[3] and b.shape == w.shape[:1] for w, b, _ in self._conv)
        if not (fits and channels[1:-1:2] == channels[2::2]):
            raise ValueError("the weights do not fit each other; the file is damaged: get it again")

    def start(self) -> Memory:
        """Return the memory at an episode's start."""
        size = self._lstm[1].shape[1] if self._lstm else 0
        return np.zeros(size), np.zeros(size)

    def act(self, observation: np.ndarray, memory: Memory) -> tuple[np.ndarray, Memory]:
        """Return the action (2,) float32 in [-1, 1] and the new memory for one observation.

        Raises:
            ValueError: for a picture of another size.
        """
        if self._conv:
            values = np.ascontiguousarray(observation.transpose(2, 0, 1), np.float64) / 255.0
            for weight, bias, stride in self._conv:
                values = _convolve(values, weight, bias, stride)
            features: np.ndarray = values.ravel()
            if len(features) != self._dense[0][0].shape[1]:
                raise ValueError(
                    f"the picture is {observation.shape[1]}x{observation.shape[0]}; the agent was trained on another "
                    "size: make the environment with camera={'width': 84, 'height': 84}"
                )
        else:
            offset, scale = self._input  # type: ignore[misc]
            features = np.clip((observation.astype(np.float64) - offset) * scale, -CLIP, CLIP)
        if self._lstm is not None:
            memory = _remember(features, *memory, *self._lstm)
            features = memory[0]
        for weight, bias in self._dense[:-1]:
            features = _dense(features, weight, bias, self._activation)
        weight, bias = self._dense[-1]
        action = _dense(features, weight, bias, 0 if self._squash else -1)
        return np.clip(action, -1.0, 1.0).astype(np.float32), memory


def _layers(arrays: Arrays, kind: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return (weight, bias) of the layers of a kind, in order."""
    count = sum(name.startswith(f"{kind}.") and name.endswith(".bias") for name in arrays)
    return [(arrays[f"{kind}.{i}.weight"], arrays[f"{kind}.{i}.bias"]) for i in range(count)]


@numba.njit(cache=True)
def _dense(x: np.ndarray, weight: np.ndarray, bias: np.ndarray, activation: int) -> np.ndarray:
    """Return weight x + bias after tanh (0), ReLU (1) or nothing (-1)."""
    out = bias.copy()
    for i in range(weight.shape[0]):
        for j in range(weight.shape[1]):
            out[i] += weight[i, j] * x[j]
        if activation == 0:
            out[i] = math.tanh(out[i])
        elif activation == 1:
            out[i] = max(out[i], 0.0)
    return out


@numba.njit(cache=True)
def _sigmoid(x: float) -> float:
    return 0.5 * (1.0 + math.tanh(0.5 * x))


@numba.njit(cache=True)
def _remember(
    x: np.ndarray, hidden: np.ndarray, cell: np.ndarray, w_ih: np.ndarray, w_hh: np.ndarray, bias: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return (hidden, cell) of the LSTM after the input x."""
    size = len(hidden)
    gates = bias.copy()
    for i in range(4 * size):
        for j in range(len(x)):
            gates[i] += w_ih[i, j] * x[j]
        for j in range(size):
            gates[i] += w_hh[i, j] * hidden[j]
    new_hidden, new_cell = np.empty(size), np.empty(size)
    for i in range(size):
        kept, written = _sigmoid(gates[size + i]) * cell[i], _sigmoid(gates[i]) * math.tanh(gates[2 * size + i])
        new_cell[i] = kept + written
        new_hidden[i] = _sigmoid(gates[3 * size + i]) * math.tanh(new_cell[i])
    return new_hidden, new_cell


@numba.njit(cache=True)
def _convolve(x: np.ndarray, weight: np.ndarray, bias: np.ndarray, stride: int) -> np.ndarray:
    """Return ReLU(weight * x + bias) for x (in, h, w), without padding."""
    outputs, inputs, k, _ = weight.shape
    height, width = (x.shape[1] - k) // stride + 1, (x.shape[2] - k) // stride + 1
    out = np.empty((outputs, height, width))
    for o in range(outputs):
        for row in range(height):
            line = out[o, row]
            line[:] = bias[o]
            for i in range(inputs):
                for dv in range(k):
                    source = x[i, row * stride + dv]
                    for du in range(k):
                        w = weight[o, i, dv, du]
                        for column in range(width):
                            line[column] += w * source[column * stride + du]
            for column in range(width):
                line[column] = max(line[column], 0.0)
    return out
