"""What notebooks show: one picture and a few numbers, without scripts."""

import base64

_LARGEST = 75_000  # bytes of a picture, a third less than its text


def _figure(png, rows):
    cells = "".join(
        f"<tr><th style='text-align:left'>{name}</th><td style='text-align:right'>{value}</td></tr>" for name, value in rows
    )
    image = f"<img alt='mesh' src='data:image/png;base64,{base64.b64encode(png).decode()}'/>" if png else ""
    return f"<div>{image}<table>{cells}</table></div>"


def _small(draw):
    """A picture of at most so many bytes; none where there is no image to draw on."""
    for side in (480, 360, 240, 160):
        png = draw(side)
        if len(png) <= _LARGEST:
            return png
    return None


def html(mesh):
    """A mesh with its picture."""
    from . import InputError

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


def flow_html(flow):
    """A flow with its picture."""
    balance = flow.balance
    rows = [(name, f"{balance[name]:.6g}") for name in ("wells_in", "wells_out", "boundary_in", "boundary_out", "error")]
    return _figure(_small(lambda side: flow.picture(max_side=side)), rows)
