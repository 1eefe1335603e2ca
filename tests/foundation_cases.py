"""Foundations that several test files stand on: a block with two machines, and what it is in plain NumPy."""

import numpy as np

import jaxrotor as jr

el, pr = jr.elements, jr.profiles

ARMS = np.array([[0.1, 0.5, -0.6], [-0.1, 0.45, 0.7]])
FEET = np.array([[-0.8, -0.4, -0.9], [0.8, -0.4, -0.9], [-0.8, -0.4, 0.9], [0.7, -0.5, 0.9]])
TENSOR = np.array([[30.0, 1.0, 0.5], [1.0, 40.0, -2.0], [0.5, -2.0, 25.0]])
FOOT, FOOT_C = np.array([3e6, 5e6, 2e6, 0, 0, 0]), np.array([3e3, 5e3, 2e3, 0, 0, 0])
MOUNT = np.array([[4e6, 6e6, 1e6, 1e4, 2e4, 1e3], [5e6, 5e6, 2e6, 2e4, 1e4, 2e3]])
MOUNT_C = MOUNT * 3e-4
ROTORS = {"fan": jr.Rotor(40.0, 0.9, 0.5), "pump": jr.Rotor(25.0, 0.4, 0.3)}
BASE = el.BaseMotion(
    y=pr.HarmonicMotion([1e-3], [9.0]), theta=pr.HarmonicMotion([1e-4], [4.0], [2e-4])
)


def block(base=None):
    return el.FoundationBlock(400.0, TENSOR, ARMS, MOUNT, FEET, FOOT, MOUNT_C, FOOT_C, base)


def on(foundation, gravity=(0.0, 0.0, 0.0)):
    return jr.Machine({**ROTORS, "base": foundation}, {"base": ("fan", "pump")}, gravity=gravity)


def arm(r):
    """By the cross product, column by column."""
    T = np.eye(6)
    for k in range(3):
        T[:3, 3 + k] = np.cross(np.eye(3)[k], r)
    return T


def assembled():
    """Mass, damping and stiffness of block and rotors, in plain NumPy; rows fan, pump, block."""
    Mg = np.diag(
        [40.0] * 3 + [0.5, 0.5, 0.9] + [25.0] * 3 + [0.3, 0.3, 0.4] + [400.0] * 3 + [0.0] * 3
    )
    Mg[15:, 15:] = TENSOR
    Kg, Cg = np.zeros((18, 18)), np.zeros((18, 18))
    for i, r in enumerate(ARMS):
        B = np.zeros((6, 18))
        B[:, 6 * i : 6 * i + 6], B[:, 12:] = np.eye(6), -arm(r)
        Kg += B.T @ np.diag(MOUNT[i]) @ B
        Cg += B.T @ np.diag(MOUNT_C[i]) @ B
    for r in FEET:
        Kg[12:, 12:] += arm(r).T @ np.diag(FOOT) @ arm(r)
        Cg[12:, 12:] += arm(r).T @ np.diag(FOOT_C) @ arm(r)
    return Mg, Cg, Kg


def by_size(values):
    values = np.asarray(values)
    return values[np.lexsort((values.imag, np.round(np.abs(values), 6)))]
