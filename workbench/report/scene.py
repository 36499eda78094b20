"""Moving drawings of a page: lines in space, frame after frame, as inline SVG; a still where nothing runs."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape

import numpy as np

_WIDTH, _HEIGHT, _MARGIN = 640.0, 420.0, 24.0
_AZIMUTH, _ELEVATION = np.radians(30.0), np.radians(22.0)


@dataclass(frozen=True, eq=False)
class Line:
    """A line through points [frames, k, 3], m, that moves; a colour and a width in pixels."""

    points: np.ndarray
    colour: str
    width: float = 2.0


@dataclass(frozen=True, eq=False)
class Label:
    """A few letters that stand at a point [3], m."""

    text: str
    point: np.ndarray
    colour: str


@dataclass(frozen=True, eq=False)
class Scene:
    """Lines that move together, `step` seconds from frame to frame, in several takes by name; each begins with the
    frame that is shown where nothing runs: its `still`-th. `labels` stand still in all takes. Raises ValueError for
    lines of different length."""

    title: str
    takes: Mapping[str, tuple[Line, ...]]
    step: float
    note: str = ""
    still: int = 0
    labels: tuple[Label, ...] = ()

    def __post_init__(self) -> None:
        for name, lines in self.takes.items():
            if len({len(line.points) for line in lines}) != 1:
                raise ValueError(f'scene "{self.title}", {name}: its lines have different numbers of frames')


def scene_html(scene: Scene) -> str:
    """The scene as HTML: a drawing of the first take's still, buttons, and all frames for the script of the page."""
    low, high = _bounds(scene)
    takes = {
        name: {
            "lines": [_flat(line.points, low, high) for line in lines],
            "looks": [[ln.colour, ln.width] for ln in lines],
        }
        for name, lines in scene.takes.items()
    }
    data = json.dumps({"step": scene.step, "still": scene.still, "takes": takes}, separators=(",", ":"))
    first = next(iter(takes.values()))
    paths = "".join(
        f'<path d="{_path(frames[min(scene.still, len(frames) - 1)])}" stroke="{colour}" stroke-width="{width}"/>'
        for frames, (colour, width) in zip(first["lines"], first["looks"], strict=True)
    )
    labels = "".join(_label(label, low, high) for label in scene.labels)
    buttons = "".join(f'<button type="button" data-take="{escape(name)}">{escape(name)}</button>' for name in takes)
    note = f'<figcaption class="note">{escape(scene.note)}</figcaption>\n' if scene.note else ""
    return (
        f'<figure class="item scene">\n<h3>{escape(scene.title)}</h3>\n'
        f'<svg viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" role="img" aria-label="{escape(scene.title)}" fill="none" '
        f'stroke-linecap="round" stroke-linejoin="round"><g>{paths}</g>{labels}</svg>\n'
        f'<div class="takes">{buttons}<input type="range" min="0" max="1" step="any" value="0" aria-label="time"/>'
        f"<output></output></div>\n"
        f'<script type="application/json">{data.replace("<", chr(92) + "u003c")}</script>\n{note}</figure>\n'
    )


def _label(label: Label, low: np.ndarray, high: np.ndarray) -> str:
    ((x, y),) = _flat(label.point[None, None], low, high)
    where = f'x="{x:g}" y="{y:g}" text-anchor="middle" dominant-baseline="central"'
    return f'<text {where} fill="{label.colour}">{escape(label.text)}</text>'


def _flat(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> list[list[float]]:
    """Frames of x, y, x, y ... in pixels, to a tenth, of points [frames, k, 3]."""
    scale = min((_WIDTH - 2 * _MARGIN) / (high - low)[0], (_HEIGHT - 2 * _MARGIN) / (high - low)[1])
    middle = (low + high) / 2
    flat = (_projected(points) - middle) * (scale, -scale) + (_WIDTH / 2, _HEIGHT / 2)
    return np.round(flat.reshape(len(flat), -1), 1).tolist()


def _bounds(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    lines = [line for take in scene.takes.values() for line in take]
    parts = [line.points for line in lines] + [label.point for label in scene.labels]
    points = np.concatenate([_projected(part).reshape(-1, 2) for part in parts])
    return points.min(axis=0), points.max(axis=0)


def _projected(points: np.ndarray) -> np.ndarray:
    """Parallel projection [.., 2] from the front, turned and from above."""
    x, y, z = np.moveaxis(points, -1, 0)
    right = np.cos(_AZIMUTH) * y - np.sin(_AZIMUTH) * x
    away = -np.cos(_AZIMUTH) * x - np.sin(_AZIMUTH) * y
    return np.stack((right, np.cos(_ELEVATION) * z + np.sin(_ELEVATION) * away), -1)


def _path(flat: list[float]) -> str:
    return "M" + "L".join(f"{x:g} {y:g}" for x, y in zip(flat[::2], flat[1::2], strict=True))
