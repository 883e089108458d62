"""`Dashboard`: what a person wants to see of an episode: robot's view, depth, plan with both tracks, errors over time.

Colors are Okabe-Ito (person orange, robot blue, estimate green), told apart by shape as well.
"""

import math
from typing import Any

import cv2
import numpy as np

from follow_env.camera.frame import RGBDFrame
from follow_env.camera.pinhole import PinholeCamera
from follow_env.envs.task import SET_POINT
from follow_env.world.scene import Box, Scene

PANEL = (480, 360)
"""Width and height of each of the four panels, px."""
PERSON, ROBOT, ESTIMATE = (230, 159, 0), (0, 114, 178), (0, 158, 115)
INK, PAPER, GRID = (40, 40, 40), (255, 255, 255), (225, 225, 225)
DEPTH_RANGE = 8.0
HEADER = 30


class Dashboard:
    """Collects an episode step by step and draws it as one picture of 960 x 720 px.

    Args:
        scene: drawn in the plan.
        camera: the robot's camera, to draw the estimate into its view.
        camera_forward: camera ahead of the axle, m.
        title: first line of the picture.
    """

    def __init__(self, scene: Scene, camera: PinholeCamera, camera_forward: float, title: str = "") -> None:
        self._scene, self._camera, self._forward, self.title = scene, camera, camera_forward, title
        self._plan, self._to_plan = _plan(scene)
        self.reset()

    def reset(self) -> None:
        """Start a new episode."""
        self._rows: list[tuple[float, ...]] = []
        self._estimates: list[tuple[float, float] | None] = []
        self._frame: RGBDFrame | None = None
        self._box: tuple[float, ...] | None = None

    def update(
        self,
        info: dict[str, Any],
        frame: RGBDFrame,
        box: tuple[float, ...] | None = None,
        estimate: tuple[float, float] | None = None,
    ) -> None:
        """Add a step.

        Args:
            info: the environment's info.
            frame: what the robot sees.
            box: the person's box (u0, v0, u1, v1) in px, if known.
            estimate: (bearing rad, distance m) of the follower, if there is one.
        """
        self._rows.append((info["time"], info["bearing"], info["distance"], *info["robot_pose"], *info["person_pose"]))
        self._estimates.append(estimate)
        self._frame, self._box = frame, box

    def image(self) -> np.ndarray:
        """Return the picture, uint8 (720, 960, 3) RGB."""
        top = np.hstack((self._view(), self._depth()))
        bottom = np.hstack((self._map(), self._errors()))
        return np.vstack((top, bottom))

    def _view(self) -> np.ndarray:
        assert self._frame is not None
        panel, scale, left = _fit(self._frame.rgb, cv2.INTER_AREA)
        if self._box is not None:
            u0, v0, u1, v1 = (round(scale * value) for value in self._box)
            cv2.rectangle(panel, (left + u0, v0 + HEADER), (left + u1 - 1, v1 - 1 + HEADER), PERSON, 2)
        if self._estimates[-1] is not None:
            bearing, distance = self._estimates[-1]
            depth = distance - self._forward
            if depth > 0.2:
                u = left + round(scale * (self._camera.cx - self._camera.focal * distance * math.tan(bearing) / depth))
                cv2.line(panel, (u, HEADER), (u, PANEL[1]), ESTIMATE, 2, cv2.LINE_AA)
        legend = [("box", PERSON)] if self._box is not None else []
        legend += [("estimate", ESTIMATE)] if self._estimates[-1] is not None else []
        return _caption(panel, self.title or "robot's view", legend)

    def _depth(self) -> np.ndarray:
        assert self._frame is not None
        share = np.clip(self._frame.depth / DEPTH_RANGE, 0.0, 1.0)
        colors = cv2.applyColorMap((255 * (1.0 - share)).astype(np.uint8), cv2.COLORMAP_VIRIDIS)[:, :, ::-1].copy()
        colors[self._frame.depth <= 0.0] = 0
        panel, _, _ = _fit(colors, cv2.INTER_NEAREST)
        bar = cv2.applyColorMap(np.linspace(255, 0, 120).astype(np.uint8)[None, :], cv2.COLORMAP_VIRIDIS)
        panel[5:17, PANEL[0] - 165 : PANEL[0] - 45] = bar[:, :, ::-1]
        _text(panel, "0", (PANEL[0] - 178, 16))
        _text(panel, "8 m", (PANEL[0] - 40, 16))
        return _caption(panel, "depth (black: no reading)", [])

    def _map(self) -> np.ndarray:
        panel = self._plan.copy()
        rows = np.array(self._rows)
        for columns, color in (((6, 7), PERSON), ((3, 4), ROBOT)):
            track = np.array([self._to_plan(x, y) for x, y in rows[:, columns]], np.int32)
            cv2.polylines(panel, [track.reshape(-1, 1, 2)], False, color, 2, cv2.LINE_AA)
        _, _, _, x, y, yaw, px, py, _ = self._rows[-1]
        cv2.circle(panel, self._to_plan(px, py), 5, PERSON, -1, cv2.LINE_AA)
        corners = [(0.35, 0.0), (-0.25, 0.2), (-0.25, -0.2)]
        nose = [
            self._to_plan(x + math.cos(yaw) * a - math.sin(yaw) * b, y + math.sin(yaw) * a + math.cos(yaw) * b)
            for a, b in corners
        ]
        cv2.fillPoly(panel, [np.array(nose, np.int32)], ROBOT, cv2.LINE_AA)
        legend = [("robot", ROBOT), ("person", PERSON)]
        if self._estimates[-1] is not None:
            bearing, distance = self._estimates[-1]
            left = distance * math.tan(bearing)
            point = (
                x + math.cos(yaw) * distance - math.sin(yaw) * left,
                y + math.sin(yaw) * distance + math.cos(yaw) * left,
            )
            cv2.drawMarker(panel, self._to_plan(*point), ESTIMATE, cv2.MARKER_CROSS, 12, 2, cv2.LINE_AA)
            legend.append(("estimate", ESTIMATE))
        return _caption(panel, "plan", legend)

    def _errors(self) -> np.ndarray:
        panel = _blank()
        time = [row[0] for row in self._rows]
        span = max(14.0, time[-1])
        estimates = self._estimates
        bearing = [math.degrees(row[1]) for row in self._rows]
        distance = [row[2] - SET_POINT for row in self._rows]
        guess_b = [None if e is None else math.degrees(e[0]) for e in estimates]
        guess_d = [None if e is None else e[1] - SET_POINT for e in estimates]
        _plot(panel, (58, HEADER + 8, PANEL[0] - 12, 182), time, bearing, guess_b, span, 30.0, "bearing (deg)", False)
        _plot(
            panel, (58, 196, PANEL[0] - 12, PANEL[1] - 32), time, distance, guess_d, span, 1.0, "distance - 1.5 m", True
        )
        legend = [("truth", INK)] + ([("estimate", ESTIMATE)] if any(e is not None for e in estimates) else [])
        return _caption(panel, "errors", legend)


def show_window(image: np.ndarray, rate: float) -> None:
    """Show the picture in a window at `rate` frames/s; needs pygame."""
    pygame = import_pygame()
    pygame.display.init()
    surface = pygame.display.get_surface() or pygame.display.set_mode((image.shape[1], image.shape[0]))
    surface.blit(pygame.surfarray.make_surface(image.swapaxes(0, 1)), (0, 0))
    pygame.event.pump()
    pygame.display.flip()
    pygame.time.Clock().tick(rate)


def import_pygame() -> Any:
    """Return the pygame module, or raise a ValueError that says how to get it."""
    try:
        import pygame
    except ImportError:
        raise ValueError(
            "render_mode 'human' opens a window and needs pygame; install it with 'pip install pygame' or use "
            "render_mode 'rgb_array'"
        ) from None
    return pygame


def _blank() -> np.ndarray:
    return np.full((PANEL[1], PANEL[0], 3), PAPER, np.uint8)


def _fit(image: np.ndarray, shrink: int) -> tuple[np.ndarray, float, int]:
    """Scale the picture to the panel below its header; return the panel, the scale and the left margin in px."""
    scale = min(PANEL[0] / image.shape[1], (PANEL[1] - HEADER) / image.shape[0])
    size = (round(image.shape[1] * scale), round(image.shape[0] * scale))
    panel = _blank()
    scaled = cv2.resize(image, size, interpolation=shrink if scale < 1.0 else cv2.INTER_NEAREST)
    left = (PANEL[0] - size[0]) // 2
    panel[HEADER : HEADER + size[1], left : left + size[0]] = scaled
    return panel, scale, left


def _text(panel: np.ndarray, text: str, origin: tuple[int, int], size: float = 0.42) -> None:
    cv2.putText(panel, text, origin, cv2.FONT_HERSHEY_SIMPLEX, size, INK, 1, cv2.LINE_AA)


def _caption(panel: np.ndarray, text: str, legend: list[tuple[str, tuple[int, int, int]]]) -> np.ndarray:
    _text(panel, text, (8, 20), 0.5)
    right = PANEL[0] - 8
    for label, color in reversed(legend):
        right -= 9 * len(label) + 22
        cv2.rectangle(panel, (right, 10), (right + 12, 20), color, -1)
        _text(panel, label, (right + 17, 20))
    cv2.rectangle(panel, (0, 0), (PANEL[0] - 1, PANEL[1] - 1), GRID, 1)
    return panel


def _plan(scene: Scene) -> tuple[np.ndarray, Any]:
    """Draw the scene from above once; return the panel and the map from world (m) to panel (px)."""
    x0, x1, y0, y1 = scene.bounds
    scale = min((PANEL[0] - 24) / (x1 - x0), (PANEL[1] - HEADER - 50) / (y1 - y0))
    left = 0.5 * (PANEL[0] - scale * (x1 - x0))
    middle = HEADER + 0.5 * (PANEL[1] - HEADER - 30)

    def to_plan(x: float, y: float) -> tuple[int, int]:
        return round(left + scale * (x - x0)), round(middle - scale * (y - 0.5 * (y0 + y1)))

    panel = _blank()
    for primitive in scene.obstacles():
        x, y, _ = primitive.center
        if isinstance(primitive, Box):
            c, s = math.cos(primitive.yaw), math.sin(primitive.yaw)
            a, b = 0.5 * primitive.size[0], 0.5 * primitive.size[1]
            corners = [
                (x + c * i * a - s * j * b, y + s * i * a + c * j * b) for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1))
            ]
            cv2.fillPoly(panel, [np.array([to_plan(*p) for p in corners], np.int32)], (190, 190, 190), cv2.LINE_AA)
        else:
            cv2.circle(panel, to_plan(x, y), max(round(scale * primitive.radius), 1), (190, 190, 190), -1, cv2.LINE_AA)
    bar_x, bar_y = round(left), PANEL[1] - 14
    cv2.line(panel, (bar_x, bar_y), (bar_x + round(2.0 * scale), bar_y), INK, 2)
    _text(panel, "2 m", (bar_x + round(2.0 * scale) + 6, bar_y + 4))
    return panel, to_plan


def _plot(
    panel: np.ndarray,
    area: tuple[int, int, int, int],
    time: list[float],
    truth: list[float],
    guess: list[float | None],
    span: float,
    limit: float,
    label: str,
    time_axis: bool,
) -> None:
    """Draw two curves over time in the area (left, top, right, bottom); values beyond +-limit stretch the axis."""
    left, top, right, bottom = area
    limit = max(limit, *(abs(value) for value in truth), *(abs(g) for g in guess if g is not None))

    def at(t: float, value: float) -> tuple[int, int]:
        return round(left + (right - left) * t / span), round(
            0.5 * (top + bottom) - 0.5 * (bottom - top) * value / limit
        )

    for value in (-limit, 0.0, limit):
        _, v = at(0.0, value)
        cv2.line(panel, (left, v), (right, v), GRID, 1)
        _text(
            panel,
            "0" if value == 0.0 else f"{value:+.0f}" if limit >= 5.0 else f"{value:+.1f}",
            (left - 40, v + 4),
            0.38,
        )
    for t in range(0, int(span) + 1, 2):
        u, _ = at(float(t), 0.0)
        cv2.line(panel, (u, bottom), (u, bottom + 3), INK, 1)
        if time_axis:
            _text(panel, str(t), (u - 4, bottom + 16), 0.38)
    if time_axis:
        _text(panel, "time (s)", (right - 52, bottom + 29), 0.38)
    _text(panel, label, (left + 6, top + 12), 0.4)
    points = [(t, g) for t, g in zip(time, guess, strict=True) if g is not None]
    for series, color, width in ((points, ESTIMATE, 1), (list(zip(time, truth, strict=True)), INK, 2)):
        if len(series) > 1:
            curve = np.array([at(t, value) for t, value in series], np.int32)
            cv2.polylines(panel, [curve.reshape(-1, 1, 2)], False, color, width, cv2.LINE_AA)
