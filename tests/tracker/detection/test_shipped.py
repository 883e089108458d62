"""The shipped detectors are those that their cards and the committed results tell of."""

import csv
import hashlib
import json
from pathlib import Path

import pytest

from baselines.learned.detector.data import DataConfig, SampleSource, without_augmentation
from baselines.learned.detector.evaluation import evaluate
from baselines.learned.detector.training import TEST_SEED
from baselines.papers.zhang2018.sequences import TABLE_2, play
from tracker.detection.detector import SHIPPED, PersonDetector, shipped_weights
from tracker.detection.networks import count_macs, count_parameters

ROWS = Path(__file__).parents[3] / "results" / "astronaut" / "table2_rows.csv"


NETS = pytest.mark.parametrize("net", ["light", "light_ssd"])


@NETS
def test_the_weights_are_those_of_their_card(net: str) -> None:
    card, file = json.loads((SHIPPED / f"{net}.json").read_text(encoding="utf-8")), shipped_weights(net)
    network = PersonDetector(net).network
    assert card["net"] == net
    assert file.stat().st_size < 5e6
    assert hashlib.sha256(file.read_bytes()).hexdigest() == card["weights_sha256"]
    assert (count_parameters(network), count_macs(network)) == (card["parameters"], card["macs"])


def test_both_were_trained_on_the_same_pictures_for_as_long() -> None:
    one, other = (json.loads((SHIPPED / f"{net}.json").read_text(encoding="utf-8")) for net in ("light", "light_ssd"))
    assert one["settings"] == other["settings"] | {"net": "light"}
    assert one["started_from"] is other["started_from"] is None
    assert one["pictures"] == other["pictures"]
    assert one["precision"] == other["precision"]


@NETS
def test_it_finds_what_its_card_promises_in_held_out_pictures(net: str) -> None:
    """The score of a part of the card's held-out pictures lies within what chance allows about the card's."""
    card = json.loads((SHIPPED / f"{net}.json").read_text(encoding="utf-8"))
    held_out, shown = card["held_out"], DataConfig(**card["settings"]["data"] | {"pictures_per_scene": 2})
    source = SampleSource(TEST_SEED, without_augmentation(shown))
    score = evaluate(PersonDetector(net).network, source, 60)
    share = held_out["tp"] / (held_out["tp"] + held_out["fn"])
    assert score.tp / (score.tp + score.fn) == pytest.approx(share, abs=0.15)
    assert score.ap == pytest.approx(held_out["ap"], abs=0.15)


@NETS
def test_it_finds_again_what_the_committed_run_found(net: str) -> None:
    """A few frames of Table 2: the same people, boxes to a grid's step and scores to their printed digits."""
    with ROWS.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))[7::1500]
    detector = PersonDetector(net)
    films = {(film.suit, str(film.view)): film for film in TABLE_2}
    assert len(rows) == 8
    for row in rows:
        (frame,) = play(films[row["suit"], row["view"]], [int(row["frame"])])
        found = detector.detect(frame.rgb, frame.depth)
        committed = [[float(number) for number in text.split()] for text in row[net].split(";")]
        assert [[*one.box, one.score] for one in found] == [
            [*(pytest.approx(edge, abs=0.31) for edge in box), pytest.approx(score, abs=0.002)]
            for *box, score in committed
        ]
