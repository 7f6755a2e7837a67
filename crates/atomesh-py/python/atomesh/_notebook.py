"""What notebooks show: one picture and a few numbers, without scripts."""

import base64
from collections.abc import Callable, Sequence

from ._atomesh import Flow, Mesh
from ._errors import InputError

_LARGEST = 73_000  # bytes of a picture, whose text is a third longer


def _figure(png: bytes | None, rows: Sequence[tuple[str, str]]) -> str:
    cells = "".join(
        f"<tr><th style='text-align:left'>{name}</th><td style='text-align:right'>{value}</td></tr>" for name, value in rows
    )
    image = f"<img alt='mesh' src='data:image/png;base64,{base64.b64encode(png).decode()}'/>" if png else ""
    return f"<div>{image}<table>{cells}</table></div>"


def _small(draw: Callable[[int], bytes]) -> bytes | None:
    """A picture of at most so many bytes; none where even a small one is larger."""
    for side in (480, 360, 240, 160):
        png = draw(side)
        if len(png) <= _LARGEST:
            return png
    return None


def html(mesh: Mesh) -> str:
    """A mesh with its picture."""
    try:
        png = _small(lambda side: mesh.picture(max_side=side))
    except InputError:
        png = None  # a mesh that was read knows no image
    quality = mesh.quality()
    rows = [("cells", f"{mesh.cell_count:,}"), ("points", f"{len(mesh.points):,}")]
    if mesh.kind == "delaunay":
        rows += [("mean quality", f"{quality['q_mean']:.3f}"), ("least angle", f"{quality['angle_min']:.1f}°")]
    features = sum(name.startswith("feature-") for name in mesh.facets)
    rows.append(("features", f"{features}"))
    return _figure(png, rows)


def flow_html(flow: Flow) -> str:
    """A flow with its picture."""
    balance = flow.balance
    rows = [(name, f"{balance[name]:.6g}") for name in ("wells_in", "wells_out", "boundary_in", "boundary_out", "error")]
    return _figure(_small(lambda side: flow.picture(max_side=side)), rows)
