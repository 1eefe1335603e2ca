"""Pictures inside a notebook's page."""

import base64
import html
import io

from ..machine.machine import Machine
from .machine import draw_machine
from .style import close, closed_on_failure, figure_of


def machine_html(machine: Machine) -> str:
    """The drawing above the line-up; the line-up alone where numbers are traced, batched or not finite."""
    text = f"<pre>{html.escape(repr(machine))}</pre>"
    try:
        picture = io.BytesIO()
        with closed_on_failure():
            fig = figure_of(draw_machine(machine))
            fig.savefig(picture, format="png", dpi=100, bbox_inches="tight")
        close([fig])
    except Exception:  # a page without a drawing is better than none
        return text
    data = base64.b64encode(picture.getvalue()).decode()
    return f'<img alt="side view to scale" src="data:image/png;base64,{data}"/>\n{text}'
