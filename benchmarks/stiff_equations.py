"""The three machines of stiff.py, as jaxrotor builds them and as equations by hand in numba."""

import numba
import numpy as np

import jaxrotor as jr

MASS = 525.0 / 9.81
GRAVITY = (0.0, -9.81, 0.0)


def _disc(mass, speed, eccentricity, attachments):
    return jr.Machine.in_line(
        {"disc": jr.Rotor(mass, 0.1, 0.05, unbalance=jr.Unbalance(eccentricity))},
        attachments={name: (part, "disc") for name, part in attachments.items()},
        gravity=GRAVITY,
        fixed={"disc": ("z", "psi", "theta")},
        prescribed={"disc": {"phi": jr.ConstantSpeed(speed)}},
    )


def journal():
    """A rigid rotor on a short film, beyond its threshold of stability: whirl and its limit cycle."""
    film = jr.JournalBearing(0.1, 0.03, 1e-4, 0.1)
    return _disc(MASS, 1000.0, 2e-6, {"film": film})


@numba.njit(error_model="numpy")
def _journal(t, y, dy):
    c, w = 1e-4, 1000.0
    ex, ey = y[0] / c, y[1] / c
    wx, wy = y[2] + 0.5 * w * y[1], y[3] - 0.5 * w * y[0]
    e = np.sqrt(ex**2 + ey**2) + 1e-30
    rx, ry = ex / e, ey / e
    wr, wt = wx * rx + wy * ry, -wx * ry + wy * rx
    size = np.sqrt(wr**2 + wt**2) + 1e-300
    co, si = wr / size, wt / size
    n = 1 - e * e
    d1, d2 = 1 - e * si, 1 + e * si
    c1, s1 = (si - e) / d1, -np.sqrt(n) * co / d1
    c2, s2 = (-si - e) / d2, np.sqrt(n) * co / d2
    arc = np.arctan2(-(s2 * c1 - c2 * s1), -(c2 * c1 + s2 * s1)) + np.pi
    half = 0.5 * (s2 * c2 - s1 * c1)
    rr = ((0.5 + e * e) * arc + half + 2 * e * (s2 - s1)) / n**2.5
    rt = (0.5 * (s2**2 - s1**2) - e * (c2 - c1)) / n**2
    tt = (0.5 * arc - half) / n**1.5
    scale = -0.1 * 0.05 * (0.03 / c) ** 3
    fr, ft = scale * (rr * wr + rt * wt), scale * (rt * wr + tt * wt)
    dy[0], dy[1] = y[2], y[3]
    dy[2] = (fr * rx - ft * ry) / MASS + 2e-6 * w * w * np.cos(w * t)
    dy[3] = (fr * ry + ft * rx) / MASS + 2e-6 * w * w * np.sin(w * t) - 9.81


def rub():
    """A disc on a spring that bounces around its stator, with friction."""
    support = jr.LinearSupport([2e5] * 2 + [0.0] * 4, [20.0] * 2 + [0.0] * 4)
    contact = jr.Rub(1.5e-4, 1e7, 0.05, 0.1, 0.5)
    return _disc(2.0, 330.0, 1e-4, {"support": support, "rub": contact})


@numba.njit(error_model="numpy")
def _rub(t, y, dy):
    w = 330.0
    fx = -2e5 * y[0] - 20.0 * y[2]
    fy = -2e5 * y[1] - 20.0 * y[3]
    r = np.sqrt(y[0] ** 2 + y[1] ** 2)
    u = r - 1.5e-4
    if u > 0:
        nx, ny = y[0] / r, y[1] / r
        normal = 1e7 * u * max(1 + 0.5 * (y[2] * nx + y[3] * ny), 0.0)
        friction = 0.1 * normal * np.tanh((-y[2] * ny + y[3] * nx + 0.05 * w) / 1e-2)
        fx += -normal * nx + friction * ny
        fy += -normal * ny - friction * nx
    dy[0], dy[1] = y[2], y[3]
    dy[2] = fx / 2.0 + 1e-4 * w * w * np.cos(w * t)
    dy[3] = fy / 2.0 + 1e-4 * w * w * np.sin(w * t) - 9.81


def rolling():
    """A rotor in a ball bearing with clearance and a pit in its outer race."""
    pit = jr.elements.OuterRaceDefect(-np.pi / 2, 0.2, 4e-6)
    bearing = jr.RollingBearing(1e10, 8e-3, 40e-3, 5e-6, 0.0, 3000.0, defects=(pit,), balls=9)
    return _disc(2.0, 300.0, 1e-5, {"bearing": bearing})


@numba.njit(error_model="numpy")
def _rolling(t, y, dy):
    w = 300.0
    fx, fy = -3000.0 * y[2], -3000.0 * y[3]
    for j in range(9):
        at = 0.5 * (1 - 0.2) * w * t + 2 * np.pi * j / 9
        away = (at + np.pi / 2 + np.pi) % (2 * np.pi) - np.pi
        room = 0.0
        if abs(away) < 0.1:
            room = 4e-6 * 0.5 * (1 + np.cos(2 * np.pi * away / 0.2))
        nx, ny = np.cos(at), np.sin(at)
        d = y[0] * nx + y[1] * ny - 5e-6 - room
        if d > 0:
            f = 1e10 * d**1.5
            fx -= f * nx
            fy -= f * ny
    dy[0], dy[1] = y[2], y[3]
    dy[2] = fx / 2.0 + 1e-5 * w * w * np.cos(w * t)
    dy[3] = fy / 2.0 + 1e-5 * w * w * np.sin(w * t) - 9.81


# name -> machine, its equations, where it starts (x, y, m) and how long it runs (s)
MACHINES = {
    "journal bearing, whirling": (journal, _journal, (5e-5, -5e-5), 0.3),
    "rub with friction": (rub, _rub, (0.0, 0.0), 0.3),
    "ball bearing with a pit": (rolling, _rolling, (0.0, -1e-5), 0.1),
}
