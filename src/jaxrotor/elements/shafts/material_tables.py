"""Published figures of metals over temperature: Young's modulus and mean expansion from 20 °C; Poisson's
ratio and the density at 20 °C as one number each.

Sources, as they were read:

- ASME BPVC Section II-D (metric), table TM-1: carbon steels with C <= 0.30 %, group G (austenitic); table
  TE-1, group 1 (carbon and low-alloy steels).
- MMPDS-01 (2003; MIL-HDBK-5's successor) and MMPDS-11 (2016), "effect of temperature" figures, as digitised
  in the public material-properties-interchange: low-alloy steels, INCONEL 718, Ti-6Al-4V, Al 6061-T6; their
  densities and Poisson's ratios; expansion of AISI 304.
- EN 1993-1-1, 3.2.6 and EN 1993-1-2, 3.2.2: Poisson's ratio and density of carbon steel.
- High Temp Metals' data sheet of alloy 718 (expansion); producers' data sheets of Ti-6Al-4V (8.6e-6 to 100
  °C, 9.2e-6 to 300 °C) and of Al 6061 (23.6e-6 to 100 °C), held beyond.

Typical values, not minima; scatter between heats is 2 to 3 %.
"""

from typing import NamedTuple

ZERO = 273.15


class Table(NamedTuple):
    """`moduli`: GPa at `temperatures` (K), the range of which is the material's. `expansion`: 1e-6/K, mean
    from 20 °C, at `expansion_temperatures` (K), held beyond. `density`: kg/m³ at 20 °C."""

    temperatures: tuple[float, ...]
    moduli: tuple[float, ...]
    expansion_temperatures: tuple[float, ...]
    expansion: tuple[float, ...]
    poisson: float
    density: float
    source: str


def _celsius(*values: float) -> tuple[float, ...]:
    return tuple(v + ZERO for v in values)


_TE_1 = (
    _celsius(21, 93, 149, 204, 260, 316, 371, 427, 482, 538),
    (11.5, 12.1, 12.4, 12.8, 13.1, 13.3, 13.7, 14.0, 14.2, 14.6),
)
_CARBON = Table(
    _celsius(-75, 25, 100, 150, 200, 250, 300, 350, 400, 450, 500, 550),
    (209, 202, 198, 195, 192, 189, 185, 179, 171, 162, 151, 137),
    *_TE_1,
    0.30,
    7850.0,
    "ASME II-D TM-1 (C <= 0.30 %), TE-1; EN 1993-1-1 and 1-2",
)
_LOW_ALLOY = Table(
    (200, 250, 300, 350, 400, 450, 500, 550, 600, 650, 700, 750, 800),
    (206.2, 202.9, 200.2, 197.2, 194.4, 191.5, 188.4, 184.5, 179.6, 173.6, 165.6, 155.7, 143.0),
    *_TE_1,
    0.32,
    7833.0,
    "MMPDS-11, low-alloy steels; ASME II-D TE-1 group 1",
)
_AUSTENITIC = Table(
    _celsius(-75, 25, 100, 150, 200, 250, 300, 350, 400, 450, 500, 550, 600, 650, 700),
    (201, 195, 189, 186, 183, 179, 176, 172, 169, 165, 160, 156, 151, 146, 140),
    (200, 311, 366, 478, 589, 700, 811, 922, 978),
    (14.4, 15.7, 16.2, 17.0, 17.7, 18.2, 18.7, 19.2, 19.3),
    0.27,
    7916.0,
    "ASME II-D TM-1 group G; MMPDS-01, AISI 304",
)
_INCONEL_718 = Table(
    (100, 200, 250, 300, 350, 400, 450, 500, 550, 600, 650, 700, 750, 800, 850, 900, 950, 1000),
    (
        *(213.6, 208.9, 206.8, 204.2, 201.8, 199.5, 197.1, 194.4, 191.5),
        *(188.7, 185.8, 182.8, 180.0, 176.4, 172.9, 168.7, 164.1, 159.4),
    ),
    _celsius(93, 204, 316, 427, 538, 649, 760),
    (12.8, 13.5, 13.9, 14.2, 14.4, 15.1, 16.0),
    0.29,
    8221.0,
    "MMPDS-01, INCONEL 718; High Temp Metals data sheet",
)
_TITANIUM = Table(
    (100, 150, 200, 250, 300, 350, 400, 450, 500, 550, 600, 650, 700, 750),
    (123.9, 120.9, 120.2, 118.9, 116.1, 112.3, 108.5, 104.7, 101.0, 97.4, 93.9, 90.2, 86.5, 80.0),
    _celsius(100, 300),
    (8.6, 9.2),
    0.31,
    4429.0,
    "MMPDS-01, Ti-6Al-4V; producers' data sheets",
)
_ALUMINIUM = Table(
    (100, 150, 200, 250, 300, 350, 400, 450, 500, 550),
    (75.9, 73.5, 71.4, 69.8, 68.6, 67.7, 66.7, 64.0, 59.6, 53.4),
    _celsius(100, 200),
    (23.6, 23.6),
    0.33,
    2713.0,
    "MMPDS-01, Al 6061-T6; producers' data sheets",
)

TABLES = {
    "carbon steel": _CARBON,
    "low-alloy steel": _LOW_ALLOY,
    "austenitic steel": _AUSTENITIC,
    "inconel 718": _INCONEL_718,
    "titanium 6al-4v": _TITANIUM,
    "aluminium 6061": _ALUMINIUM,
}
# Grades, by the table that has them.
GRADES = {
    "carbon steel": ("s235", "s355", "c22", "p355nh", "aisi 1020", "aisi 1025"),
    "low-alloy steel": (
        *("42crmo4", "34crmo4", "25crmo4", "34crnimo6", "30crnimo8"),
        *("aisi 4130", "aisi 4140", "aisi 4340"),
    ),
    "austenitic steel": ("aisi 304", "aisi 316", "x5crni18-10", "x5crnimo17-12-2"),
    "inconel 718": ("alloy 718", "nicr19fe19nb5mo3"),
    "titanium 6al-4v": ("ti-6al-4v", "titanium grade 5"),
    "aluminium 6061": ("aluminum 6061", "al 6061", "en aw-6061"),
}
NAMES = tuple(sorted({*TABLES, *(grade for grades in GRADES.values() for grade in grades)}))


def found(name: str) -> str | None:
    """The table that a name means, in any case, with or without "steel" before a grade."""
    plain = " ".join(name.lower().split())
    for candidate in (plain, plain.removeprefix("steel ")):
        for key, grades in GRADES.items():
            if candidate == key or candidate in grades:
                return key
    return None
