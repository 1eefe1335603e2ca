"""The two-rotor machine's figures and matrices, with numpy, straight from physics.md.

Nothing of jaxrotor is used here. Stations: second, main, left, right; flat arrays are component
first, (6, 4); phi and phi' are measured from the drive's.
"""

import numpy as np

STATIONS = ("second", "main", "left", "right")
COORDINATES = X, Y, Z, PSI, THETA, PHI = range(6)
SIZE = 48

# shaft sections, left to right, between these stations (4 is the driven end)
SECTIONS = ((0, 2, 0.060), (2, 1, 0.080), (1, 3, 0.127), (3, 4, 0.020))  # from, to, m
DIAMETER, ALPHA, BETA = 0.012, 0.002, 0.002  # m, 1/s, s
YOUNG, SHEAR, DENSITY = 2.1e11, 8.1e10, 7850.0  # Pa, Pa, kg/m³
GRAVITY = 9.81  # m/s², along -y

MASS = np.array([3.0935, 6.0788])  # kg
POLAR, TRANSVERSE = np.array([0.00485, 0.01873]), np.array([0.002837, 0.01018])  # kg·m²
ECCENTRICITY = np.array([1e-5, 5e-4])  # m
INCLINATION = np.deg2rad([0.0, 1.0])

HOUSING, BASE_K, BASE_C, SWING_C = 1.0, 1e6, 2e2, 5.0  # kg, N/m, N·s/m, N·m·s/rad
FRICTION_ARM, FRICTION_SPEED, LOAD_SMOOTHING = 0.002, 1.0, 1e-3  # m, rad/s, N
ROD = np.array([0.070, 0.0735])  # lumped shaft at left and right, m

TOP_SPEED, RAMP = 1000.0, 2.5  # rad/s, s


def _bearing_inertia():
    m, r = DENSITY * np.pi / 4 * DIAMETER**2 * ROD, DIAMETER / 2
    jt, jp = m * (3 * r**2 + ROD**2) / 12, m * r**2 / 2
    return np.array([HOUSING + m, HOUSING + m, m, jt, jt, jp])


BEARING_INERTIA = _bearing_inertia()  # (6, 2)
BEARING_WEIGHT = np.zeros((6, 2))
BEARING_WEIGHT[Y] = -GRAVITY * BEARING_INERTIA[Y]


def _beam(L):
    """Stiffness and damping of one section, 12x12. Signs: dx/dz = +theta, dy/dz = -psi."""
    A, Ip = np.pi / 4 * DIAMETER**2, np.pi / 32 * DIAMETER**4
    bend_k = np.array(
        [[12, 6 * L, -12, 6 * L], [6 * L, 4 * L**2, -6 * L, 2 * L**2],
         [-12, -6 * L, 12, -6 * L], [6 * L, 2 * L**2, -6 * L, 4 * L**2]]
    ) * YOUNG * Ip / 2 / L**3  # fmt: skip
    bend_m = np.array(
        [[156, 22 * L, 54, -13 * L], [22 * L, 4 * L**2, 13 * L, -3 * L**2],
         [54, 13 * L, 156, -22 * L], [-13 * L, -3 * L**2, -22 * L, 4 * L**2]]
    ) * DENSITY * A * L / 420  # fmt: skip
    K, M = np.zeros((12, 12)), np.zeros((12, 12))
    for dofs, sign in (([X, THETA, 6 + X, 6 + THETA], 1), ([Y, PSI, 6 + Y, 6 + PSI], -1)):
        signs = np.outer([1, sign, 1, sign], [1, sign, 1, sign])
        K[np.ix_(dofs, dofs)], M[np.ix_(dofs, dofs)] = signs * bend_k, signs * bend_m
    for dof, k, m in ((Z, YOUNG * A, DENSITY * A), (PHI, SHEAR * Ip, DENSITY * Ip)):
        at = np.ix_([dof, 6 + dof], [dof, 6 + dof])
        K[at] = k / L * np.array([[1, -1], [-1, 1]])
        M[at] = m * L / 6 * np.array([[2, 1], [1, 2]])
    return K, ALPHA * M + BETA * K


def _assemble():
    """-[K C] of the four free stations, (24, 48), and what unit speed of the whole line adds, (24,).

    A common angle leaves the springs alone, but alpha M_c damps the absolute phi', the end's too.
    """
    K, C = np.zeros((2, 6, 5, 6, 5))
    for a, b, length in SECTIONS:
        for total, part in zip((K, C), _beam(length)):
            for i, p in ((a, 0), (b, 6)):
                for j, q in ((a, 0), (b, 6)):
                    total[:, i, :, j] += part[p : p + 6, q : q + 6]
    for bearing in (2, 3):
        for dof in (X, Y):
            K[dof, bearing, dof, bearing] += BASE_K
            C[dof, bearing, dof, bearing] += BASE_C
        for dof in (PSI, THETA):
            C[dof, bearing, dof, bearing] += SWING_C
    pull = -np.concatenate([m[:, :4, :, :4].reshape(24, 24) for m in (K, C)], axis=1)
    return pull, -C[:, :4, PHI].sum(-1).ravel()


PULL, DRAG = _assemble()


def jacobian(speed):
    """d(dy/dt)/dy of the undeformed, balanced, frictionless line turning at `speed` (rad/s)."""
    inertia = np.concatenate(
        [np.array([MASS] * 3 + [TRANSVERSE] * 2 + [POLAR]), BEARING_INERTIA], 1
    )
    J = np.concatenate([np.eye(24, 48, 24), PULL / inertia.reshape(24, 1)])
    return J + speed * GYRO


def _gyro():
    """What each rad/s of spin adds: psi'' = -(Jp/Jt) w theta', theta'' = +(Jp/Jt) w psi'."""
    G = np.zeros((48, 48))
    for rotor in (0, 1):
        psi, theta = (24 + 4 * c + rotor for c in (PSI, THETA))
        G[psi, theta] = -POLAR[rotor] / TRANSVERSE[rotor]
        G[theta, psi] = POLAR[rotor] / TRANSVERSE[rotor]
    return G


GYRO = _gyro()
