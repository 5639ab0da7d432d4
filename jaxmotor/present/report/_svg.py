"""matplotlib's figures as inline SVG: text stays text, and colours, light and dark, are the page's.

A backend of matplotlib that makes elements of the page: no style, no reference to outside, all markers of a series in
one path, and the same text from the same figure.
"""

import functools
import math
from typing import Any

import numpy as np
from matplotlib.backend_bases import GraphicsContextBase, RendererBase
from matplotlib.colors import to_hex
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.transforms import Affine2D, BboxBase, Transform

from jaxmotor.present import _style
from jaxmotor.present.report._html import Html, element

DPI = 144
"""Two units of the drawing are a point: about a pixel each where the page is wide."""
COLOURS = {
    to_hex(colour): variable
    for colour, variable in (
        (_style.BLACK, "ink"),
        ("white", "paper"),
        (_style.BLUE, "blue"),
        (_style.VERMILLION, "red"),
        (_style.GREEN, "green"),
        (_style.PURPLE, "purple"),
        (_style.GREY, "grey"),
        (_style.SILVER, "silver"),
        (_style.SKY, "sky"),
        (_style.BAND["facecolor"], "band"),
        (_style.FAINT, "faint"),
    )
}
"""Variables of the page's style. A colour that is none of these stays as it is."""
LETTERS = {Path.MOVETO: "M", Path.LINETO: "L", Path.CURVE3: "Q", Path.CURVE4: "C"}
CODES = {code: letter.lower() for code, letter in LETTERS.items()}


class Renderer(RendererBase):
    """Turns what matplotlib draws into elements; y is up in what it is given, and down in SVG."""

    def __init__(self, width: float, height: float, name: str):
        super().__init__()
        self.width, self.height, self.name = width, height, name
        self.parts: list[Html] = []
        self.known: dict[str, str] = {}

    def get_canvas_width_height(self) -> tuple[float, float]:
        return self.width, self.height

    def points_to_pixels(self, points: Any) -> Any:
        return points * DPI / 72

    def draw_path(self, gc: GraphicsContextBase, path: Path, transform: Transform, rgbFace: Any = None) -> None:
        inside = None if rgbFace is not None or gc.get_hatch() else (0.0, 0.0, self.width, self.height)
        simplify = rgbFace is None and bool(path.should_simplify)
        drawn = _path(path, transform + self._down(), inside, simplify)
        if not drawn:
            return
        self._add(drawn, gc, self._style(gc, rgbFace))
        if gc.get_hatch():
            self._add(drawn, gc, {"fill": self._hatch(gc)})

    def draw_markers(
        self,
        gc: GraphicsContextBase,
        marker_path: Path,
        marker_trans: Transform,
        path: Path,
        trans: Transform,
        rgbFace: Any = None,
    ) -> None:
        places = (trans + self._down()).transform(path.vertices)
        shown = np.isfinite(places).all(axis=1) & (np.abs(places) < 1e5).all(axis=1)
        places, style = places[shown], self._style(gc, rgbFace)
        dot = _radius(marker_path, marker_trans)
        stroke = float(style.get("stroke_width") or 0.0)
        if dot and (not stroke or style["stroke"] == style["fill"]):
            # A stroke that only its round ends show: in print one of no length has none.
            ends = {"stroke": style["fill"], "stroke_width": _short(2 * dot + stroke), "stroke_linecap": "round"}
            drawn, style = "h.01", {"fill": "none", **ends}
        else:
            drawn = _circle(dot) if dot else _relative(marker_path, marker_trans + Affine2D().scale(1, -1))
        self._add("".join(f"M{x:.1f} {y:.1f}{drawn}" for x, y in places), gc, style)

    # One element for each, without the references that matplotlib's default makes of them.
    draw_path_collection = RendererBase.draw_path_collection

    def get_text_width_height_descent(self, s: str, prop: FontProperties, ismath: Any) -> tuple[float, float, float]:
        return _measured(s, prop, ismath)

    def draw_text(
        self,
        gc: GraphicsContextBase,
        x: float,
        y: float,
        s: str,
        prop: FontProperties,
        angle: float,
        ismath: Any = False,
        mtext: Text | None = None,
    ) -> None:
        anchor, share = _anchor(angle, mtext)
        width, *_ = self.get_text_width_height_descent(s, prop, ismath)
        turn = math.radians(angle)
        x, y = x + share * width * math.cos(turn), y - share * width * math.sin(turn)
        where = {"x": f"{x:.1f}", "y": f"{y:.1f}"}
        if angle:
            where["transform"] = f"rotate({-angle:g} {x:.1f} {y:.1f})"
        size = _short(self.points_to_pixels(prop.get_size_in_points()))
        bold = "bold" if prop.get_weight() in ("bold", 700) else None
        ink = {"fill": _colour(gc.get_rgb()), "font_size": size, "font_weight": bold, "text_anchor": anchor}
        self.parts.append(element("text", s, **where, **ink))

    def _down(self) -> Affine2D:
        return Affine2D().scale(1.0, -1.0).translate(0.0, self.height)

    def _add(self, drawn: str, gc: GraphicsContextBase, style: dict[str, str]) -> None:
        self.parts.append(element("path", d=drawn, **style, clip_path=self._clip(gc.get_clip_rectangle())))

    def _style(self, gc: GraphicsContextBase, face: Any) -> dict[str, str]:
        red, green, blue, alpha = (*face, 1.0)[:4] if face is not None else (0.0,) * 4
        style = {"fill": _colour((red, green, blue)) if alpha > 0 else "none"}
        alpha = gc.get_alpha() if gc.get_forced_alpha() else alpha
        if 0 < alpha < 1:
            style["opacity" if gc.get_forced_alpha() else "fill_opacity"] = _short(alpha)
        width = self.points_to_pixels(gc.get_linewidth())
        if width and gc.get_rgb()[3] > 0:
            style |= {"stroke": _colour(gc.get_rgb()), "stroke_width": _short(width)}
            _, dashes = gc.get_dashes()
            if dashes is not None:
                style["stroke_dasharray"] = " ".join(map(_short, self.points_to_pixels(np.asarray(dashes))))
        return style

    def _clip(self, box: BboxBase | None) -> str | None:
        if box is None:
            return None
        size = {"x": box.x0, "y": self.height - box.y1, "width": box.width, "height": box.height}
        return self._defined("clipPath", element("rect", **{key: _short(value) for key, value in size.items()}))

    def _hatch(self, gc: GraphicsContextBase) -> str:
        whole = _path(gc.get_hatch_path(), Affine2D().scale(DPI, -DPI).translate(0.0, DPI), None, False)
        style = {"stroke": _colour(gc.get_hatch_color()), "fill": "none"}
        width = _short(self.points_to_pixels(gc.get_hatch_linewidth()))
        tile = {"width": DPI, "height": DPI, "patternUnits": "userSpaceOnUse"}
        return self._defined("pattern", element("path", d=whole, stroke_width=width, **style), **tile)

    def _defined(self, kind: str, content: Html, **about: Any) -> str:
        """A reference to `content`, which is put into the drawing once."""
        if content not in self.known:
            self.known[content] = f"{self.name}-{len(self.known)}"
            self.parts.append(element(kind, content, id=self.known[content], **about))
        return f"url(#{self.known[content]})"


@functools.lru_cache(4096)
def _measured(text: str, prop: FontProperties, ismath: Any) -> tuple[float, float, float]:
    """Width, height and descent; ticks of many figures have the same few texts."""
    return RendererBase.get_text_width_height_descent(Renderer(0.0, 0.0, ""), text, prop, ismath)


def _path(path: Path, transform: Transform, inside: tuple[float, float, float, float] | None, simplify: bool) -> str:
    segments = path.iter_segments(transform, remove_nans=True, clip=inside, simplify=simplify)  # pyright: ignore[reportArgumentType]
    return "".join(
        LETTERS[code] + " ".join(f"{v:.1f}" for v in ends) if code in LETTERS else "Z" for ends, code in segments
    )


def _relative(path: Path, transform: Transform) -> str:
    """`path` as steps from where the marker stands."""
    drawn, now = "", np.zeros(2)
    for ends, code in path.iter_segments(transform):
        if code not in CODES:
            drawn += "z"
            continue
        steps = ends.reshape(-1, 2) - now
        drawn, now = drawn + CODES[code] + " ".join(f"{v:.2f}" for v in steps.ravel()), ends[-2:]
    return drawn


def _radius(path: Path, transform: Transform) -> float:
    """Of a marker that is a circle; 0 of another."""
    corners = np.asarray(path.vertices)
    if corners.shape != np.shape(Path.unit_circle().vertices):
        return 0.0
    round_ = np.hypot(*transform.transform(corners[1:-1]).T)
    return float(round_.max()) if np.ptp(round_) < 0.1 * round_.max() else 0.0


def _circle(radius: float) -> str:
    r = _short(radius)
    half = f"a{r} {r} 0 1 0"
    return f"m-{r} 0{half} {_short(2 * radius)} 0{half} -{_short(2 * radius)} 0z"


def _anchor(angle: float, text: Text | None) -> tuple[str | None, float]:
    """SVG's name of where a line of text is held, so that it is in place in any font, and the part of its width."""
    if text is None or (angle and text.get_rotation_mode() != "anchor"):
        return ("middle", 0.5) if angle else (None, 0.0)
    return {"center": ("middle", 0.5), "right": ("end", 1.0)}.get(str(text.get_horizontalalignment()), (None, 0.0))


def _colour(rgb: Any) -> str:
    name = to_hex(rgb[:3])
    return f"var(--{COLOURS[name]},{name})" if name in COLOURS else name


def _short(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")
