"""The calibration as Markdown tables: what `follow calibrate` prints and `docs/calibration.md` holds."""

from __future__ import annotations

from typing import Any

from baselines.benchmark.markdown import markdown_table


def summary(calibration: dict[str, Any]) -> str:
    """Return measured errors, fitted sensors and filter noise as three Markdown tables."""
    return "\n\n".join(
        (
            "Errors of each depth rule on rendered frames (bias and spread without outliers; outlier shares of all "
            f"frames, and of those with the person nearer and farther than {calibration['how']['far_from_m']} m):",
            _frames(calibration),
            "Emulated sensors, scaled to the paper's No filter row:",
            _sensors(calibration),
            "Filter noise by the rule (multiples of the unit in parentheses):",
            _noise(calibration),
        )
    )


def detector_summary(calibration: dict[str, Any]) -> str:
    """Return the detector's measured errors and the noise of the filters behind it as two Markdown tables."""
    first, last = calibration["how"]["seeds"]
    return "\n\n".join(
        (
            f"Errors of the accepted measurements ({last - first} episodes a scene; missed: of the frames looked at):",
            _frames(calibration),
            "Filter noise by the rule (multiples of the unit in parentheses):",
            _noise(calibration),
        )
    )


def _frames(calibration: dict[str, Any]) -> str:
    header = ["scene", "depth rule", "missed", "angle RMSE (rad)", "angle bias", "distance RMSE (cm)", "bias", "spread"]
    header += ["outliers", "nearer", "farther", "outlier size (cm)", "mean run (s)"]
    rows = []
    for scene, rules in calibration["frames"].items():
        for rule, entry in rules.items():
            bearing, distance = entry["bearing"], entry["distance"]
            sizes = [100.0 * distance[key] for key in ("outlier_low", "outlier_high")]
            found = distance["outlier_share"] > 0.0
            rows.append(
                [
                    scene,
                    rule,
                    f"{entry['miss_share']:.1%}",
                    f"{bearing['rmse']:.4f}",
                    f"{bearing['bias']:.4f}",
                    *(f"{100.0 * distance[key]:.1f}" for key in ("rmse", "bias", "spread")),
                    *(
                        f"{distance[key]:.1%}"
                        for key in ("outlier_share", "nearer_outlier_share", "farther_outlier_share")
                    ),
                    f"{sizes[0]:.0f} to {sizes[1]:.0f}" if found else "–",
                    f"{distance['outlier_duration_s']:.2f}" if found else "–",
                ]
            )
    return markdown_table(header, rows, left=2)


def _sensors(calibration: dict[str, Any]) -> str:
    header = ["sensor", "scene", "angle noise (rad)", "correlation (s)", "distance bias (cm)", "noise (cm)"]
    header += ["correlation (s)", "outliers", "size (cm)", "mean run (s)"]
    rows = []
    for name, scenes in calibration["sensors"].items():
        for scene, sensor in scenes.items():
            found = sensor["outlier_share"] > 0.0
            low, high = 100.0 * sensor["outlier_low"], 100.0 * sensor["outlier_high"]
            rows.append(
                [
                    name,
                    scene,
                    f"{sensor['bearing_noise']:.4f}",
                    f"{sensor['bearing_correlation_s']:.2f}",
                    f"{100.0 * sensor['distance_bias']:.1f}",
                    f"{100.0 * sensor['distance_noise']:.1f}",
                    f"{sensor['distance_correlation_s']:.2f}",
                    f"{sensor['outlier_share']:.1%}",
                    f"{low:.0f} to {high:.0f}" if found else "–",
                    f"{sensor['outlier_duration_s']:.2f}" if found else "–",
                ]
            )
    return markdown_table(header, rows, left=2)


def _noise(calibration: dict[str, Any]) -> str:
    header = ["perception", "scene", "R angle (rad²)", "R distance (m²)", "Q angle (rad²)", "Q distance (m²)"]
    header += ["inflated when clean", "q angle (rad²/s³)", "q distance (m²/s³)", "inflated when clean"]
    rows = []
    for name, scenes in calibration["noise"].items():
        for scene, entry in scenes.items():
            rows.append(
                [
                    name,
                    scene,
                    *(f"{value:.2e}" for value in entry["measurement"]),
                    *(f"{q:.2e} ({m})" for q, m in zip(entry["process"], entry["multiples"], strict=True)),
                    " / ".join(f"{share:.1%}" for share in entry["inflated_shares"]),
                    *(
                        f"{q:.2e} ({m})"
                        for q, m in zip(entry["acceleration"], entry["acceleration_multiples"], strict=True)
                    ),
                    " / ".join(f"{share:.1%}" for share in entry["acceleration_inflated_shares"]),
                ]
            )
    return markdown_table(header, rows, left=2)
