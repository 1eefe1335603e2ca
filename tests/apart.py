"""Many rotors in one machine that do not know of each other: one program instead of many."""

import numpy as np

import jaxrotor as jr

NOTHING = jr.ElasticMatrix(np.zeros((12, 12)), np.zeros((12, 12)))


def apart(attachments, inertia, fixed=()):
    """A free rotor for each attachment, of its name: `{"fan": jr.FanLoad(...)}`, or a tuple of
    attachments that act on the same rotor. `inertia`: polar, kg·m², for all or one for each. `fixed`:
    what all are held in; work on the weights of a run goes with the cube of what is free."""
    line, attached = {}, {}
    inertias = np.broadcast_to(inertia, len(attachments))
    for (name, parts), polar in zip(attachments.items(), inertias):
        if line:
            line[f"before {name}"] = NOTHING
        line[name] = jr.Rotor(1.0, polar, 0.6 * polar)
        parts = parts if isinstance(parts, tuple) else (parts,)
        attached |= {f"{name}: {type(p).__name__}": (p, name) for p in parts}
    held = {name: fixed for name in attachments} if fixed else None
    return jr.Machine.in_line(line, attachments=attached, fixed=held)


def spinning(speeds):
    """An undeformed machine whose stations turn at `speeds` (rad/s)."""
    v = np.zeros((len(speeds), 6))
    v[:, 5] = speeds
    return jr.State(np.zeros_like(v), v)
