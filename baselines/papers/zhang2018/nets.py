"""The two detectors that paper A compares, with their weights; apart from the experiments because it brings torch."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path

from baselines.papers.zhang2018.table2 import NETS, OURS
from follow_env.registry import choose
from tracker.detection.detector import PersonDetector, shipped_weights


class Nets(Mapping[str, PersonDetector]):
    """The trained detectors by name, each loaded when first asked for; a worker process gets them unloaded.

    Ours has to be there; one that it is compared with is left out where it has no weights.

    Args:
        weights: Files that replace the shipped ones, by net.

    Raises:
        ValueError: If there is no such net, or a file holds the weights of another.
        FileNotFoundError: If weights are missing.
    """

    def __init__(self, weights: Mapping[str, Path]) -> None:
        for net in weights:
            choose("net", net, NETS)
        self._files: dict[str, Path] = {}
        for net in NETS:
            try:
                self._files[net] = weights.get(net) or shipped_weights(net)
            except FileNotFoundError:
                if net == OURS:
                    raise
        self._loaded: dict[str, PersonDetector] = {}
        for net in self:
            self[net]

    def __getitem__(self, net: str) -> PersonDetector:
        """The detector of one of `NETS`; it uses one thread, so that its results do not depend on the machine's."""
        if net not in self._loaded:
            self._loaded[net] = PersonDetector(net, self._files[net], threads=1)
        return self._loaded[net]

    def __iter__(self) -> Iterator[str]:
        return iter(self._files)

    def __len__(self) -> int:
        return len(self._files)

    def __getstate__(self) -> dict[str, object]:
        return {"_files": self._files, "_loaded": {}}

    def digests(self) -> dict[str, str]:
        """SHA-256 of each file of weights."""
        return {net: hashlib.sha256(file.read_bytes()).hexdigest() for net, file in self._files.items()}
