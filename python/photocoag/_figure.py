"""A matplotlib figure that notebooks show; imported with the first figure."""

from __future__ import annotations

import io

from matplotlib.figure import Figure


class ShownFigure(Figure):
    """Shows itself as the value of a notebook's cell, whether pyplot is in use or not."""

    def _repr_png_(self) -> bytes:
        picture = io.BytesIO()
        self.savefig(picture, format="png")
        return picture.getvalue()
