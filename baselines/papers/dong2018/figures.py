"""The pictures: error curves (figures 6-9 of paper B), the sensitivity to Q and alpha, and the family of sensors.

Every picture is drawn from the records that are written as CSV beside it, and from nothing else.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from baselines.benchmark.cells import ALPHAS, ESTIMATORS, PERCEPTIONS, SCENES
from baselines.benchmark.files import Value
from baselines.papers.dong2018.explain import NAMES
from baselines.papers.dong2018.table1 import QUANTITIES, UNITS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Record = Mapping[str, Value]

_FIGURE_NUMBERS = {
    ("corridor", "angle"): 6,
    ("corridor", "distance"): 7,
    ("indoor", "angle"): 8,
    ("indoor", "distance"): 9,
}
_BLACK, _ORANGE, _SKY, _GREEN, _BLUE, _VERMILION, _PURPLE = (
    *("#000000", "#E69F00", "#56B4E9", "#009E73"),
    *("#0072B2", "#D55E00", "#CC79A7"),
)  # Okabe and Ito's colors, which color-blind readers can tell apart
_LINES = {
    "none": (_BLACK, "-"),
    "kf": (_BLUE, "--"),
    "akf": (_VERMILION, "-."),
    "akf_cv": (_GREEN, ":"),
}
_ALPHA_LINES = dict(zip(ALPHAS, ((_ORANGE, ":", "s"), (_VERMILION, "-.", "D"), (_PURPLE, "-", "^")), strict=True))
_STYLE = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "lines.linewidth": 1.6,
    "legend.frameon": False,
    "figure.constrained_layout.use": True,
    "savefig.dpi": 160,
}


def draw_curves(records: Sequence[Record], folder: Path) -> list[Path]:
    """Draw one picture per perception, scene and quantity: mean cumulative error with its band over seeds.

    Args:
        records: ``curves.curve_records``.
        folder: Existing folder for the pictures.

    Returns:
        The files written.
    """
    paths = []
    present = {record["perception"] for record in records}
    for perception in (name for name in PERCEPTIONS if name in present):
        for (scene, quantity), figure_number in _FIGURE_NUMBERS.items():
            path = folder / f"figure{figure_number}_{scene}_{quantity}_{perception}.png"
            chosen = _select(records, perception=perception, scene=scene, quantity=quantity)
            with picture(path, width=5.6, height=3.9) as figure:
                axes = figure.subplots()
                for estimator in ESTIMATORS:
                    _draw_curve(axes, _select(chosen, estimator=estimator), estimator)
                axes.set_xlim(left=0.0)
                axes.set_ylim(bottom=0.0)
                axes.set_xlabel("time (s)")
                axes.set_ylabel(f"sum of |{quantity} error| ({UNITS[quantity]})")
                axes.set_title(f"Figure {figure_number}. {scene.capitalize()}, {quantity} ({perception})", loc="left")
                _legend_below(figure, axes, columns=4)
            paths.append(path)
    return paths


def draw_sensitivity(records: Sequence[Record], path: Path) -> None:
    """Draw the ratio to No filter over the multiple of Q, a line per alpha, with the paper's ratios.

    Args:
        records: ``studies.study_records`` of the sensitivity cells.
        path: The picture; its folder exists.
    """
    with picture(path, width=7.2, height=5.8) as figure:
        from matplotlib.ticker import FuncFormatter, LogLocator

        panels = _panels(figure, share_y="col")
        for scene, quantity, axes in panels:
            chosen = _select(records, scene=scene, quantity=quantity)
            color, dashes = _LINES["kf"]
            _draw_ratios(axes, _select(chosen, estimator="kf"), "KF", (color, dashes, "o"), shift=0.94)
            for alpha, shift in zip(ALPHAS, (0.98, 1.02, 1.06), strict=True):
                lines = _select(chosen, estimator="akf", alpha=alpha)
                _draw_ratios(axes, lines, f"AKF, α = {alpha:g}", _ALPHA_LINES[alpha], shift)
            axes.axhline(1.0, color="#808080", linewidth=0.8)
            for estimator, (color, _) in (("kf", _LINES["kf"]), ("akf", _LINES["akf"])):
                ratio = _column(_select(chosen, estimator=estimator), "paper_ratio")[0]
                axes.axhline(ratio, color=color, linewidth=3.0, alpha=0.25, label=f"paper, {NAMES[estimator]}")
            axes.set_xscale("log")
            scales = sorted({float(str(record["q_scale"])) for record in chosen if record["q_scale"] is not None})
            axes.set_xticks(scales, [f"{scale:g}" for scale in scales])
            axes.set_yscale("log")
            shown = [1.0]
            for name in ("ratio_to_none", "ratio_low", "ratio_high", "paper_ratio"):
                shown += _column(_known(_select(records, quantity=quantity), name), name)
            axes.set_ylim(min(shown) / 1.1, max(shown) * 1.1)
            axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 3.0, 5.0, 7.0)))
            axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axes.minorticks_off()
            axes.set_title(f"{scene.capitalize()}, {quantity}", loc="left")
        _label_outside(panels, x="process noise, multiple of the rule's Q", y="RMSE, ratio to No filter")
        _legend_below(figure, panels[0][2], columns=3)


def draw_sensors(records: Sequence[Record], path: Path) -> None:
    """Draw the KF's and AKF's ratio to No filter for each sensor or depth rule, with the paper's ratios.

    Args:
        records: ``studies.study_records`` of the cells.
        path: The picture; its folder exists.
    """
    sensors = list(dict.fromkeys(str(record["sensor"]) for record in records))
    with picture(path, width=7.2, height=2.6 + 0.56 * len(sensors)) as figure:
        panels = _panels(figure, share_y=True)
        for scene, quantity, axes in panels:
            chosen = _select(records, scene=scene, quantity=quantity)
            for estimator, marker, offset in (("kf", "o", -0.16), ("akf", "D", 0.16)):
                color = _LINES[estimator][0]
                for row, sensor in enumerate(sensors):
                    for record in _select(chosen, estimator=estimator, sensor=sensor):
                        ratio, low, high = _ratio_and_errors(record)
                        axes.errorbar(
                            ratio,
                            row + offset,
                            xerr=[[low], [high]],
                            color=color,
                            marker=marker,
                            markersize=4.5,
                            linestyle="none",
                            label=NAMES[estimator] if row == 0 else None,
                        )
                axes.axvline(
                    _column(_select(chosen, estimator=estimator), "paper_ratio")[0],
                    color=color,
                    linewidth=3.0,
                    alpha=0.25,
                    label=f"paper, {NAMES[estimator]}",
                )
            axes.axvline(1.0, color="#808080", linewidth=0.8)
            axes.set_yticks(range(len(sensors)), [name.replace("_", " ") for name in sensors])
            axes.set_ylim(len(sensors) - 0.5, -0.5)
            axes.grid(visible=False, axis="y")
            axes.set_title(f"{scene.capitalize()}, {quantity}", loc="left")
        _label_outside(panels, x="RMSE, ratio to No filter")
        panels[0][2].set_xlim(left=0.0)
        _legend_below(figure, panels[0][2], columns=4)


def _draw_curve(axes: Axes, records: Sequence[Record], estimator: str) -> None:
    color, dashes = _LINES[estimator]
    times = _column(records, "time_s")
    axes.fill_between(times, _column(records, "p10"), _column(records, "p90"), color=color, alpha=0.13, linewidth=0.0)
    axes.plot(times, _column(records, "mean"), color=color, linestyle=dashes, label=NAMES[estimator])


def _draw_ratios(axes: Axes, records: Sequence[Record], label: str, line: tuple[str, str, str], shift: float) -> None:
    """Draw one line of ratios with intervals, shifted by a factor along the logarithmic axis so that none hide."""
    known = _known(records, "ratio_to_none")
    values = [_ratio_and_errors(record) for record in known]
    color, dashes, marker = line
    axes.errorbar(
        [scale * shift for scale in _column(known, "q_scale")],
        [ratio for ratio, _, _ in values],
        yerr=[[low for _, low, _ in values], [high for _, _, high in values]],
        color=color,
        linestyle=dashes,
        marker=marker,
        markersize=4.0,
        elinewidth=0.9,
        linewidth=1.3,
        label=label,
    )


def _ratio_and_errors(record: Record) -> tuple[float, float, float]:
    """Ratio and its distances to the interval's ends, 0 where there is no interval."""
    (ratio,) = _column([record], "ratio_to_none")
    if record["ratio_low"] is None:
        return ratio, 0.0, 0.0
    (low,), (high,) = _column([record], "ratio_low"), _column([record], "ratio_high")
    return ratio, max(0.0, ratio - low), max(0.0, high - ratio)


def _panels(figure: Figure, share_y: Literal[True, "col"]) -> list[tuple[str, str, Axes]]:
    """Panels with a scene per row and a quantity per column."""
    grid = figure.subplots(len(SCENES), len(QUANTITIES), sharex=True, sharey=share_y)
    return [
        (scene, quantity, grid[row][column])
        for row, scene in enumerate(SCENES)
        for column, quantity in enumerate(QUANTITIES)
    ]


def _label_outside(panels: Sequence[tuple[str, str, Axes]], x: str, y: str = "") -> None:
    """Label the axes at the picture's lower and left edge."""
    for scene, quantity, axes in panels:
        if scene == SCENES[-1]:
            axes.set_xlabel(x)
        if quantity == QUANTITIES[0]:
            axes.set_ylabel(y)


def _legend_below(figure: Figure, axes: Axes, columns: int) -> None:
    """One legend for the whole picture, ours first, outside the panels so that it never covers data."""
    handles, labels = axes.get_legend_handles_labels()
    entries = sorted(zip(labels, handles, strict=True), key=lambda entry: entry[0].startswith("paper"))
    figure.legend(
        [handle for _, handle in entries],
        [label for label, _ in entries],
        loc="outside lower center",
        ncols=columns,
    )


@contextmanager
def picture(path: Path, width: float, height: float) -> Iterator[Figure]:
    """A figure of the given size in inches, saved without a display and without anything that names the software.

    Raises:
        ModuleNotFoundError: where Matplotlib is not installed; the message names the extra.
    """
    try:
        import matplotlib
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "drawing figures needs Matplotlib, which is not installed; run `pip install 'follow-env[bench]'`",
            name=error.name,
        ) from error
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(width, height))
        FigureCanvasAgg(figure)
        yield figure
        figure.savefig(path, metadata={"Software": None})


def _select(records: Sequence[Record], **wanted: Value) -> list[Record]:
    return [record for record in records if all(record[name] == value for name, value in wanted.items())]


def _known(records: Sequence[Record], name: str) -> list[Record]:
    return [record for record in records if record[name] is not None]


def _column(records: Sequence[Record], name: str) -> list[float]:
    return [float(str(record[name])) for record in records]
