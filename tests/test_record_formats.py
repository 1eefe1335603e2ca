"""Files of measuring programs. Each is written by other means than it is read by: by hand from the format's
description, by Python's `wave`, by h5py in MATLAB's layout, by npTDMS' and SciPy's own writers."""

import os
import struct
import sys
import wave
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
import xarray

import jaxrotor as jr
from jaxrotor.core.errors import MissingExtraError
from jaxrotor.sensors.formats.spelling import told_unit, unit_in

T = np.arange(50) * 1e-3
A, B = np.sin(40 * T), 3 + np.cos(90 * T)
RATE = 'time = { rate = "1 kHz" }\n'


def read(folder, file, columns, head=""):
    """A record of columns, as `name`: the column, or (the column, its unit)."""
    lines = [f'file = "{file}"', head]
    for name, told in columns.items():
        column, unit = told if isinstance(told, tuple) else (told, "")
        lines += [f'[channels."{name}"]', f'column = "{column}"', f'unit = "{unit}"' * bool(unit)]
    (folder / "record.toml").write_text("\n".join(lines))
    return jr.read_record(folder / "record.toml")


def assert_refused(folder, file, column, words, head=""):
    with pytest.raises(jr.InputError, match=words) as told:
        read(folder, file, {"a": (column, "1")}, head)
    assert len(told.value.problems) == 1 and "\n" not in str(told.value)


# --- WAV -------------------------------------------------------------------------------------------


def write_wav(place, samples, width=2, rate=1000):
    with wave.open(str(place), "wb") as file:
        file.setnchannels(samples.shape[1])
        file.setsampwidth(width)
        file.setframerate(rate)
        if width == 3:
            file.writeframes(
                b"".join(int(x).to_bytes(3, "little", signed=True) for x in samples.ravel())
            )
        else:
            file.writeframes(samples.astype({1: "u1", 2: "<i2", 4: "<i4"}[width]).tobytes())


@pytest.mark.parametrize(
    "width, top, middle", [(1, 2**7, 2**7), (2, 2**15, 0), (3, 2**23, 0), (4, 2**31, 0)]
)
def test_wav(tmp_path, width, top, middle):
    """Whole numbers of every size; the channels by their numbers, the time by the rate."""
    counts = np.round(0.9 * top * np.stack([A, -A], 1)) + middle
    write_wav(tmp_path / "run.wav", counts, width)
    found = read(tmp_path, "run.wav", {"left": "1", "right": ("2", "V")})
    np.testing.assert_allclose(found["left"].t, T, atol=1e-12)
    np.testing.assert_array_equal(found["left"].values, (counts[:, 0] - middle) / top)
    np.testing.assert_array_equal(found["right"].values, (counts[:, 1] - middle) / top)
    assert (found["left"].unit, found["right"].unit) == ("1", "V")
    assert "full scale is 1" in found.notes[0]
    assert_refused(tmp_path, "run.wav", "3", "no column `3`.*known: `1`, `2`")


def test_wav_of_floats_has_no_unit(tmp_path):
    scipy.io.wavfile.write(tmp_path / "run.wav", 1000, np.float32(A))
    with pytest.raises(jr.InputError, match="`unit` is missing"):
        read(tmp_path, "run.wav", {"a": "1"})
    found = read(tmp_path, "run.wav", {"a": ("1", "m/s^2")})
    np.testing.assert_array_equal(found["a"].values, np.float32(A))


def test_bad_wav(tmp_path):
    write_wav(tmp_path / "run.wav", np.round(1e4 * A)[:, None])
    data = (tmp_path / "run.wav").read_bytes()
    (tmp_path / "cut.wav").write_bytes(data[:90])
    assert_refused(tmp_path, "cut.wav", "1", "`.*cut.wav`: (is cut off|cannot be read).*")
    (tmp_path / "other.wav").write_bytes(b"no sound at all, but words")
    assert_refused(tmp_path, "other.wav", "1", "other.wav`: cannot be read as WAV: ")
    (tmp_path / "run.csv").write_bytes(data)  # the ending lies
    found = read(tmp_path, "run.csv", {"a": "1"})
    assert len(found["a"]) == 50 and "is a WAV file, whatever" in found.notes[0]


# --- MATLAB ----------------------------------------------------------------------------------------


def of_matlab(group, name, value, kind="double"):
    """As MATLAB writes 7.3: columns first, the class as an attribute."""
    made = group.create_dataset(name, data=np.atleast_2d(value).T)
    made.attrs["MATLAB_class"] = np.bytes_(kind)
    return made


def mat73(place):
    with h5py.File(place, "w", userblock_size=512) as file:
        of_matlab(file, "t", T[:, None])
        of_matlab(file, "data", np.stack([A, B], 1))
        run = file.create_group("run")
        run.attrs["MATLAB_class"] = np.bytes_("struct")
        of_matlab(run, "a", A[None])
        of_matlab(file, "fs", [[1000.0]])
        of_matlab(file, "name", np.frombuffer(b"b\0e\0d\0", np.uint16)[None], "char")
        of_matlab(file, "up", (A > 0).astype(np.uint8)[:, None], "logical")
        both = np.zeros(50, [("real", "f8"), ("imag", "f8")])
        of_matlab(file, "z", both[:, None])
        refs = file.create_group("#refs#")
        inner = of_matlab(refs, "b", A[:, None])
        cells = file.create_dataset("c", (1, 1), h5py.ref_dtype)
        cells[0, 0] = inner.ref
        cells.attrs["MATLAB_class"] = np.bytes_("cell")
    with open(place, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def mat5(place):
    cells = np.empty((1, 1), object)
    cells[0, 0] = A
    held = {
        "t": T[:, None], "data": np.stack([A, B], 1), "run": {"a": A}, "fs": 1000.0, "name": "bed",
        "up": (A > 0)[:, None], "z": (A + 1j * B)[:, None], "c": cells,
    }  # fmt: skip
    scipy.io.savemat(place, held)


@pytest.mark.parametrize("write", [mat5, mat73])
def test_matlab(tmp_path, write):
    write(tmp_path / "run.mat")
    asked = {
        "one": ("data[0]", "m/s^2"),
        "two": ("data[1]", "mm"),
        "a": ("run/a", "V"),
        "up": ("up", "1"),
    }
    for head in ('time = "t"\n', RATE, 'time = { step = "1 ms" }\n'):
        found = read(tmp_path, "run.mat", asked, head)
        for name, values in {"one": A, "two": B, "a": A, "up": A > 0}.items():
            np.testing.assert_allclose(found[name].t, T, atol=1e-15)
            np.testing.assert_array_equal(found[name].values, values)
    assert "the 2 columns of `data` are `data[0]` to `data[1]`" in found.notes[0]
    later = read(tmp_path, "run.mat", asked, 'time = { rate = "1 kHz", start = "2 s" }\n')
    np.testing.assert_allclose(later["one"].t, 2 + T)
    for column, words in {
        "c": "is a cell array: write what is in it as a matrix, no signal",
        "fs": "is one number, 1000",
        "name": "is a text",
        "z": "holds complex numbers and not real numbers",
        "data": r"no such column.*`data\[0\]`",
        "run": "no such column.*`run/a`",
    }.items():
        assert_refused(tmp_path, "run.mat", column, words, RATE)
    assert_refused(tmp_path, "run.mat", "t", ": time is missing, and `run.mat` does not say")


@pytest.mark.parametrize("write", [mat5, mat73])
def test_bad_matlab(tmp_path, write):
    write(tmp_path / "run.mat")
    data = (tmp_path / "run.mat").read_bytes()
    (tmp_path / "cut.mat").write_bytes(data[: len(data) // 2])
    assert_refused(tmp_path, "cut.mat", "t", "cut.mat`: cannot be read as ", RATE)
    (tmp_path / "none.mat").write_bytes(b"")
    assert_refused(tmp_path, "none.mat", "t", "none.mat`: is empty", RATE)


# --- HDF5 ------------------------------------------------------------------------------------------


def test_plain_hdf5(tmp_path):
    """Paths, units of attributes, matrices either way up, tables; netCDF-like files still by xarray."""
    with h5py.File(tmp_path / "run.h5", "w") as file:
        rig = file.create_group("rig")
        rig["t"] = T
        rig["a"] = np.float32(A)
        rig["a"].attrs["units"] = "m/s2"
        file["both"] = np.stack([A, B])
        rows = np.zeros(50, [("t", "f8"), ("b", "f4"), ("word", "S3")])
        rows["t"], rows["b"] = T, B
        file["log"] = rows
        file["words"] = "many"
        file["cube"] = np.zeros((3, 4, 5))
        pairs = np.zeros(50, [("at", "f8"), ("xy", "f8", (2,))])
        pairs["xy"][:, 1] = B
        file["orbit"] = pairs
        rig["round"] = rig  # a link back
        file["short"], file["nowhere"] = h5py.SoftLink("/rig/a"), h5py.SoftLink("/none")
    asked = {"a": "rig/a", "one": ("both[1]", "mm"), "b": ("log/b", "mm")}
    asked |= {"y": ("orbit/xy[1]", "mm"), "again": "short"}
    found = read(tmp_path, "run.h5", asked, 'time = "rig/t"\n')
    assert found["a"].unit == "m/s^2"
    np.testing.assert_array_equal(found["a"].values, np.float32(A))
    np.testing.assert_array_equal(found["again"].values, np.float32(A))
    np.testing.assert_array_equal(found["one"].values, B)
    np.testing.assert_array_equal(found["y"].values, B)
    np.testing.assert_array_equal(found["b"].values, np.float32(B))
    np.testing.assert_array_equal(found["b"].t, T)
    for column, words in {
        "words": "is a text",
        "cube": "an array of 3 x 4 x 5",
        "log/word": "holds texts and not real",
        "rig/aa": "did you mean `rig/a`",
    }.items():
        assert_refused(tmp_path, "run.h5", column, words, RATE)
    data = xarray.Dataset({"a": ("t", A, {"units": "mm"})}, coords={"t": ("t", T, {"units": "ms"})})
    data.to_netcdf(tmp_path / "other.h5", engine="h5netcdf")
    found = read(tmp_path, "other.h5", {"a": "a"}, 'time = "t"\n')["a"]
    assert found.unit == "mm" and found.t[-1] == pytest.approx(1e-3 * T[-1])
    data.to_netcdf(tmp_path / "third.nc", engine="scipy")  # netCDF 3
    np.testing.assert_array_equal(
        read(tmp_path, "third.nc", {"a": "a"}, 'time = "t"\n')["a"].values, A
    )


def test_bad_hdf5(tmp_path):
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["a"] = np.arange(9999.0)
        file["late"] = T[::-1]
    data = (tmp_path / "run.h5").read_bytes()
    (tmp_path / "cut.h5").write_bytes(data[:20000])
    assert_refused(
        tmp_path, "cut.h5", "a", "cut.h5`: cannot be read as HDF5: .*: is it whole", RATE
    )
    assert_refused(tmp_path, "run.h5", "late", "time must rise, but row 2", 'time = "late"\n')
    (tmp_path / "text.h5").write_text("t,a\n1,2\n")
    assert_refused(tmp_path, "text.h5", "a", "text.h5`: cannot be read as HDF5", RATE)


# --- TDMS ------------------------------------------------------------------------------------------


def write_tdms(place):
    nptdms = pytest.importorskip("nptdms")
    noon = np.datetime64("2024-05-01T12:00:00.000000")
    sampled = {"wf_increment": 1e-3, "wf_start_offset": 0.5, "unit_string": "m/s^2"}
    with nptdms.TdmsWriter(str(place)) as file:
        file.write_segment(
            [
                nptdms.ChannelObject("rig", "a", A, sampled | {"wf_start_time": noon}),
                nptdms.ChannelObject(
                    "rig",
                    "b 1",
                    B,
                    sampled
                    | {"wf_start_time": noon + np.timedelta64(250, "ms"), "unit_string": "g"},
                ),
                nptdms.ChannelObject("log", "t", T),
                nptdms.ChannelObject("log", "word", ["x"] * 50),
            ]
        )


def test_tdms(tmp_path):
    write_tdms(tmp_path / "run.tdms")
    found = read(tmp_path, "run.tdms", {"a": "rig/a", "b": ("rig/b 1", "g_0")})
    np.testing.assert_array_equal(found["a"].values, A)
    np.testing.assert_array_equal(found["b"].values, B)
    np.testing.assert_allclose(found["a"].t, 0.5 + T)
    np.testing.assert_allclose(found["b"].t, 0.75 + T)
    assert found["a"].unit == "m/s^2" and "began at different times" in found.notes[0]
    over = read(tmp_path, "run.tdms", {"a": "rig/a"}, 'time = "log/t"\n')
    np.testing.assert_array_equal(over["a"].t, T)
    with pytest.raises(
        jr.InputError, match='`unit` is missing .the file says g, which may be "g_0"'
    ):
        read(tmp_path, "run.tdms", {"b": "rig/b 1"})
    assert_refused(
        tmp_path, "run.tdms", "log/word", "holds (texts|objects) and not real numbers", RATE
    )
    assert_refused(tmp_path, "run.tdms", "log/t", ": time is missing")
    assert_refused(tmp_path, "run.tdms", "rig/b", "did you mean `rig/b 1`")
    data = (tmp_path / "run.tdms").read_bytes()
    (tmp_path / "cut.tdms").write_bytes(data[:-300])
    assert_refused(tmp_path, "cut.tdms", "rig/a", "cut.tdms`: (is cut off|cannot be read)", RATE)


# --- universal files -------------------------------------------------------------------------------


def uff58(values, step=1e-3, start=0.0, t=None, binary="", kind=1, entity="NONE", node=12, way=-3,
          unit="m/s^2", what=12, axis=17, double=True, line="NONE", whole=True):  # fmt: skip
    """One data set 58 by its description: records in FORTRAN's formats. `binary`: "<" or ">"."""
    values = np.asarray(values)
    form = (5 if np.iscomplexobj(values) else 2) + (
        double if np.iscomplexobj(values) else 2 * double
    )
    flat = values.view(float) if np.iscomplexobj(values) else values
    blob = flat.astype(f"{binary or '<'}{'f8' if double else 'f4'}").tobytes()
    head = f"{58:6d}"
    if binary:
        head += f"b{1 + (binary == '>'):6d}{2:6d}{11:12d}{len(blob):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    lines = [f"{-1:6d}", head, line, "NONE", "01-May-24 12:00:00", "NONE", "NONE"]
    lines.append(
        f"{kind:5d}{0:10d}{0:5d}{0:10d} {entity:10s}{node:10d}{way:4d} {'NONE':10s}{0:10d}{0:4d}"
    )
    lines.append(
        f"{form:10d}{len(values):10d}{int(t is None):10d}{start:13.5E}{step:13.5E}{0:13.5E}"
    )
    for code, label, of in (
        (axis, "Time", "s"),
        (what, "Response", unit),
        (0, "NONE", "NONE"),
        (0, "NONE", "NONE"),
    ):
        lines.append(f"{code:10d}{0:5d}{0:5d}{0:5d} {label:20s} {of:20s}")
    text = ("\n".join(lines) + "\n").encode()
    if binary:
        return text + blob + b"\n" + f"{-1:6d}\n".encode() * whole
    if t is not None:  # 2(E13.5,E20.12)
        words = [f"{x:13.5E}{v:20.12E}" for x, v in zip(t, flat)]
        rows = ["".join(words[k : k + 2]) for k in range(0, len(words), 2)]
    else:
        words = [f"{v:20.12E}" if double else f"{v:13.5E}" for v in flat]
        many = 4 if double else 6
        rows = ["".join(words[k : k + many]) for k in range(0, len(words), many)]
    return text + ("\n".join(rows) + "\n").encode() + f"{-1:6d}\n".encode() * whole


def units164(length=1000.0, force=1.0):
    lines = [f"{-1:6d}", f"{164:6d}", f"{9:10d}{'user':20s}{0:10d}"]
    lines += [
        f"{length:25.17E}{force:25.17E}{1.0:25.17E}".replace("E", "D"),
        f"{273.15:25.17E}".replace("E", "D"),
    ]
    return ("\n".join([*lines, f"{-1:6d}"]) + "\n").encode()


def other(number):
    return f"{-1:6d}\n{number:6d}\n{1:10d}{0:10d}\n{-1:6d}\n".encode()


@pytest.mark.parametrize(
    "how, near",
    [
        (dict(), 1e-12),
        (dict(double=False), 1e-5),
        (dict(binary="<"), 0.0),
        (dict(binary=">"), 0.0),
        (dict(binary="<", double=False), 1e-7),
        (dict(binary=">", double=False), 1e-7),
        (dict(t=T**1.1), 1e-12),
    ],
)
def test_universal_files(tmp_path, how, near):
    """Text and binary, both orders of bytes, both precisions, even and uneven sampling."""
    pytest.importorskip("pyuff")
    (tmp_path / "run.unv").write_bytes(uff58(A, start=0.25, **how))
    found = read(tmp_path, "run.unv", {"a": "12-Z"})["a"]
    np.testing.assert_allclose(found.values, A, rtol=near, atol=near)
    np.testing.assert_allclose(found.t, how["t"] if "t" in how else 0.25 + T, rtol=1e-5)
    assert found.unit == "m/s^2"


def test_universal_file_of_many(tmp_path):
    """Names, units from data set 164, what is passed over, and what is no signal over time."""
    pytest.importorskip("pyuff")
    parts = [
        units164(), other(2411),
        uff58(A, unit="NONE"), uff58(B, unit="NONE", what=8, way=5),
        uff58(A, entity="bed", unit="g"), uff58(B, entity="bed", unit="g", what=1),
        uff58(A, node=0, line="motor's torque", unit="NONE", what=13, way=4),
        uff58(A + 1j * B, kind=4, axis=18, entity="frf"), uff58(A + 1j * B, entity="turning"),
    ]  # fmt: skip
    (tmp_path / "run.uff").write_bytes(b"".join(parts))
    asked = {"a": "12-Z", "angle": "12+RY", "bed": "bed (1)", "torque": "motor's torque"}
    found = read(tmp_path, "run.uff", asked)
    units = {name: one.unit for name, one in found.series.items()}
    assert units == {"a": "mm/s^2", "angle": "rad", "bed": "g_0", "torque": "N*mm"}
    np.testing.assert_allclose(found["angle"].values, B, rtol=1e-12)
    assert "2 functions are named `bed`: numbered" in found.notes[0]
    assert "2411 (nodes) are passed over" in found.notes[0] and "164" not in found.notes[0]
    with pytest.raises(jr.InputError, match="the file says g, which may be"):
        read(tmp_path, "run.uff", {"b": "bed (2)"})
    assert_refused(
        tmp_path, "run.uff", "frf", "frequency response function over frequency, no signal"
    )
    assert_refused(tmp_path, "run.uff", "turning", "complex time response, no signal")


def test_bad_universal_files(tmp_path):
    pytest.importorskip("pyuff")
    for data, words in {
        uff58(A)[:1100]: "is cut off: its last data set has no end",
        uff58(A) + uff58(B, whole=False): "is cut off",
        uff58(
            A, kind=4, axis=18
        ): r"no signal over time, but the data sets 58 \(frequency response function",
        other(2411)
        + other(55)
        + other(4711): r"the data sets 2411 \(nodes\), 55 \(mode shapes .*\), 4711:",
        other(1858) + other(82): r"1858 \(qualifiers of functions\), 82 \(trace lines\)",
        uff58(A).replace(b"E-0", b"X-0"): "its data set 1 cannot be read",
        b"": "is empty",
    }.items():
        (tmp_path / "run.uff").write_bytes(data)
        assert_refused(tmp_path, "run.uff", "12-Z", rf"run.uff`: .*{words}")
    (tmp_path / "run.uff").write_text("t,a\n1,2\n")
    assert_refused(tmp_path, "run.uff", "a", "run.uff`: ")
    (tmp_path / "run.dat").write_bytes(uff58(A))  # an ending that says nothing
    assert len(read(tmp_path, "run.dat", {"a": "12-Z"})["a"]) == 50
    short = uff58(A).replace(f"{50:10d}{1:10d}".encode(), f"{80:10d}{1:10d}".encode())
    (tmp_path / "run.uff").write_bytes(short)
    assert (
        "has 50 values, though its header says 80"
        in read(tmp_path, "run.uff", {"a": "12-Z"}).notes[0]
    )


# pyuff's own samples (MIT, github.com/ladisk/pyuff, data/): the small ones are here; of all, PYUFF_DATA
# names the folder of a copy
SMALL = Path(__file__).parent / "data" / "uff"
SAMPLES = {
    "Sample_UFF58_ascii.uff": ("Mic 01", "Pa", 79292),
    "Sample_UFF58b_bin.uff": ("Mic 01", "Pa", 79292),
    "binary8byte.uff": ("sine 5 Hz", "g_0", 250),
    "dataset_milestone_in_header.uff": ("PWL Mic", "Pa", 42),
    "time-history-not-all-columns-filled.uff": ("1x : m/s²", "m/s²", 13),
    "MPSTD#Set001_2024_10_08_10_27_07.uff": ("2+Z", "m/s^2", 222400),
    "MPSTD#Set001_2024_10_08_10_27_07_fixed_test.uff": ("1+Z (2)", "m/s^2", 222400),
}


def met_or_refused(folder, samples):
    for place in sorted(samples.glob("*.uff")):
        if place.name not in SAMPLES:
            assert_refused(folder, place, "1", "holds no signal over time, but the data sets ")
            continue
        name, unit, count = SAMPLES[place.name]
        found = read(folder, place, {"a": name})["a"]
        assert (found.unit, len(found)) == (unit, count)


def test_small_samples_of_pyuff(tmp_path):
    """Three read; six refused in words: sets 15, 18, 55, 151, 164, 1858, 2411, 2412, 2414, a 58 of no signal
    over time."""
    assert len(list(SMALL.glob("*.uff"))) == 9
    met_or_refused(tmp_path, SMALL)


@pytest.mark.skipif(
    "PYUFF_DATA" not in os.environ, reason="PYUFF_DATA names no folder of pyuff's samples"
)
def test_samples_of_pyuff(tmp_path):
    met_or_refused(tmp_path, Path(os.environ["PYUFF_DATA"]))
    text, binary = (
        read(tmp_path, Path(os.environ["PYUFF_DATA"]) / f, {"a": "Mic 01"})["a"]
        for f in list(SAMPLES)[:2]
    )
    np.testing.assert_allclose(text.values, binary.values, rtol=1e-5)


# --- all kinds -------------------------------------------------------------------------------------


def test_text_over_a_rate(tmp_path):
    (tmp_path / "run.csv").write_text("a\n" + "\n".join(f"{x:.17g}" for x in A) + "\n")
    found = read(tmp_path, "run.csv", {"a": ("a", "V")}, RATE)["a"]
    np.testing.assert_array_equal(found.values, A)
    np.testing.assert_allclose(found.t, T, atol=1e-15)


@pytest.mark.parametrize(
    "time, words",
    [
        ('{ rate = "0 Hz" }', "rate must be positive"),
        ('{ rate = "2 ms" }', ": time: rate must be in Hz"),
        ('{ rate = "? Hz" }', "rate is still .* write how it was sampled"),
        ('{ rate = "2 Hz", step = "1 s" }', "has rate and step: keep one"),
        ('{ rate = "2 Hz", unit = "s" }', "unit goes with column"),
        ('{ column = "t", start = "1 s" }', "start goes with rate or step"),
        ('{ speed = "2 Hz" }', "there is no key `speed`"),
        ("{}", ": time is missing, and `run.csv`"),
    ],
)
def test_bad_times(tmp_path, time, words):
    (tmp_path / "run.csv").write_text("t,a\n" + "\n".join(f"{t},{a}" for t, a in zip(T, A)) + "\n")
    assert_refused(tmp_path, "run.csv", "a", words, f"time = {time}\n")


def test_a_library_that_is_missing(tmp_path, monkeypatch):
    for library, kind, extra in (("pyuff", "uff", "uff"), ("nptdms", "tdms", "tdms")):
        for module in [m for m in sys.modules if m.endswith(f"formats.{kind}")]:
            monkeypatch.delitem(sys.modules, module)
        monkeypatch.setitem(sys.modules, library, None)
        (tmp_path / f"run.{kind}").write_bytes(b"something")
        with pytest.raises(MissingExtraError, match=rf"run.{kind}.*jaxrotor\[{extra}\]"):
            read(tmp_path, f"run.{kind}", {"a": ("a", "1")}, RATE)


def test_a_kind_that_nobody_knows(tmp_path):
    (tmp_path / "run.xls").write_bytes(struct.pack("<4d", 1, 2, 3, 4))
    assert_refused(tmp_path, "run.xls", "a", "of no kind that is known: .csv", RATE)


@pytest.mark.parametrize(
    "text, unit, why",
    [
        ("m/s2", "m/s^2", ""), ("[mm]", "mm", ""), ("Volts", "V", ""), ("NONE", "", ""), ("rpm", "rpm", ""),
        ("g", "", "which may be"), ("EU", "", "which may be"), ("bananas", "", "which is no unit here"),
    ],
)  # fmt: skip
def test_units_as_programs_spell_them(text, unit, why):
    found, words = told_unit(text)
    assert found == unit and why in words and bool(why) == bool(words)
    assert unit_in(f"a 1 [{text.strip('[]')}]") == text.strip("[]")
