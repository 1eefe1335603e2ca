"""Pictures inside a notebook's page."""

import base64
import html
import io

import matplotlib.pyplot as plt

from ..machine.machine import Machine
from .machine import draw_machine


def machine_html(machine: Machine) -> str:
    """The drawing above the line-up; the line-up alone where numbers are traced, batched or not finite."""
    text = f"<pre>{html.escape(repr(machine))}</pre>"
    opened = set(plt.get_fignums())
    try:
        picture = io.BytesIO()
        draw_machine(machine).savefig(picture, format="png", dpi=100, bbox_inches="tight")
    except Exception:  # a page without a drawing is better than none
        return text
    finally:
        for number in set(plt.get_fignums()) - opened:
            plt.close(number)
    data = base64.b64encode(picture.getvalue()).decode()
    return f'<img alt="side view to scale" src="data:image/png;base64,{data}"/>\n{text}'
