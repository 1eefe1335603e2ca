"""Which reader a file is for: by what it begins with, and else by the ending of its name."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ...core.errors import InputError, MissingExtraError
from .table import Table
from .text import HowWritten, read_text_table

_TEXT = (".csv", ".txt", ".dat", ".tsv", ".asc")
_ENDINGS = {
    **dict.fromkeys(_TEXT, "text"),
    **dict.fromkeys((".uff", ".unv", ".uf", ".uf58", ".ufb", ".bsd"), "universal file"),
    **dict.fromkeys((".nc", ".nc4", ".netcdf"), "netCDF"),
    **dict.fromkeys((".h5", ".hdf5", ".hdf", ".he5"), "HDF5"),
    ".parquet": "Parquet",
    ".mat": "MATLAB",
    ".tdms": "TDMS",
    ".wav": "WAV",
}
_BEGINNINGS = (
    (b"TDSm", "TDMS"),
    (b"PAR1", "Parquet"),
    (b"MATLAB 5.0 MAT-file", "MATLAB"),
    (b"CDF\x01", "netCDF 3"),
    (b"CDF\x02", "netCDF 3"),
)
# What a name may end in beside what it says: they are HDF5 inside, or were once.
_ALIKE = ("HDF5", "netCDF", "netCDF 3", "MATLAB")
# The library and the extra that brings it.
_EXTRAS = {
    "Parquet": ("pyarrow", "data"),
    "universal file": ("pyuff", "uff"),
    "TDMS": ("npTDMS", "tdms"),
}


def read_table(file: Path, how: HowWritten, wanted: frozenset[str], least: int = 2) -> Table:
    """The columns of a file of any kind; `how`, `wanted`, `least`: for a text file. Raises `InputError`, and
    `MissingExtraError` for a library that is not there."""
    if file.is_dir():
        raise InputError(f"`{file}`: is a folder: name a file in it")
    if not file.is_file():
        raise InputError(f"`{file}`: there is no such file")
    by_name = _ENDINGS.get(file.suffix.lower(), "")
    kind = _begins(file) or by_name
    if not file.stat().st_size and kind != "text":
        raise InputError(f"`{file}`: is empty: record or copy it again")
    with reading(file, kind):
        table = _read(file, kind, how, wanted, least)
    if not table.columns:
        held = "; ".join(f"`{name}` is {words}" for name, words in list(table.others.items())[:8])
        raise InputError(f"`{file}`: holds no signal{f' ({held})' if held else ''}: is it whole?")
    if by_name not in ("", kind) and not {by_name, kind} <= set(_ALIKE):
        table = table._replace(notes=(f"is a {kind} file, whatever its name ends in", *table.notes))
    return table


@contextmanager
def reading(file: Path, kind: str = "") -> Iterator[None]:
    """What a library says of a file that it cannot read is said as an `InputError`."""
    try:
        yield
    except ImportError as error:
        if kind not in _EXTRAS:
            raise
        library, extra = _EXTRAS[kind]
        raise MissingExtraError(
            f"`{file}`: to read {kind} needs {library}: pip install 'jaxrotor[{extra}]'"
        ) from error
    except InputError:
        raise
    except Exception as error:  # each reader has its own dozen
        as_what = f" as {kind}" if kind else ""
        raise InputError(
            f"`{file}`: cannot be read{as_what}: {_first(error)}: is it whole, and what its name says?"
        ) from None


def _first(error: Exception) -> str:
    """The first line of what a library says."""
    lines = str(error).strip().splitlines()
    return lines[0].rstrip(".:") if lines else type(error).__name__


def _begins(file: Path) -> str:
    """The kind of a file by its content, or ""."""
    with open(file, "rb") as opened:
        start = opened.read(2100)
    if any(start[k : k + 8] == b"\x89HDF\r\n\x1a\n" for k in (0, 512, 1024, 2048)):
        return "HDF5"  # MATLAB, and who else likes to, writes a text before
    if start[:4] in (b"RIFF", b"RIFX", b"RF64") and start[8:12] == b"WAVE":
        return "WAV"
    lines = start.splitlines()
    if len(lines) > 1 and lines[0].strip() == b"-1" and lines[1][:6].strip().isdigit():
        return "universal file"
    return next((kind for magic, kind in _BEGINNINGS if start.startswith(magic)), "")


def _read(file: Path, kind: str, how: HowWritten, wanted: frozenset[str], least: int) -> Table:
    # what one kind alone needs is imported for it
    if kind == "text":
        return read_text_table(file, how, wanted, least)
    if kind == "Parquet":
        from .frame import read_parquet

        return read_parquet(file)
    if kind in ("HDF5", "netCDF", "netCDF 3"):
        from .hdf5 import is_netcdf, read_hdf5
        from .netcdf import read_netcdf

        if kind == "HDF5" and not is_netcdf(file):
            return read_hdf5(file)
        return read_netcdf(file, kind == "netCDF 3")
    if kind == "MATLAB":
        from .matlab import read_matlab

        return read_matlab(file)
    if kind == "universal file":
        from .uff import read_uff

        return read_uff(file)
    if kind == "TDMS":
        from .tdms import read_tdms

        return read_tdms(file)
    if kind == "WAV":
        from .wav import read_wav

        return read_wav(file)
    raise InputError(
        f"`{file}`: is of no kind that is known: .csv (.txt, .dat, .tsv, .asc), .parquet, .nc, .h5, .mat, "
        ".uff (.unv), .tdms or .wav"
    )
