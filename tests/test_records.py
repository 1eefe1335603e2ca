"""Measured data: what is read, what is refused, and with which words."""

import re

import numpy as np
import pandas
import pytest
import xarray

import jaxrotor as jr

T = np.arange(50) * 1e-3
VALUES = np.sin(40 * T)

MAP = """
file = "run.csv"
time = { column = "t", unit = "ms" }
missing = -9999.0

[channels.housing]
column = "a"
unit = "m/s^2"
offset = "2 ms"
"""


def write(folder, table, told=MAP, name="run.csv"):
    if name.endswith(".csv"):
        pandas.DataFrame(table).to_csv(folder / name, index=False)
    (folder / "run.toml").write_text(told)
    return folder / "run.toml"


def test_csv_with_gaps(tmp_path):
    """Units, a time offset, missing values in three spellings."""
    values = VALUES.copy()
    values[[3, 10]] = np.nan
    values[20] = -9999.0
    found = jr.read_record(write(tmp_path, {"t": 1e3 * T, "a": values}))
    one = found["housing"]
    assert one.unit == "m/s^2" and found.name == "run"
    np.testing.assert_allclose(one.t, T + 2e-3, atol=1e-15)
    assert list(np.flatnonzero(~one.valid)) == [3, 10, 20]
    np.testing.assert_array_equal(one.values[one.valid], VALUES[one.valid])


def test_netcdf_brings_its_units(tmp_path):
    data = xarray.Dataset(
        {"a": ("t", VALUES, {"units": "mm/s^2"})}, coords={"t": ("t", T, {"units": "s"})}
    )
    data.to_netcdf(tmp_path / "run.nc", engine="h5netcdf")
    told = 'file = "run.nc"\ntime = { column = "t" }\n[channels.housing]\ncolumn = "a"\n'
    found = jr.read_record(write(tmp_path, None, told, "run.nc"))["housing"]
    assert found.unit == "mm/s^2"
    np.testing.assert_array_equal(found.t, T)


def test_parquet_and_two_rates(tmp_path):
    pytest.importorskip("pyarrow")
    pandas.DataFrame({"t": T, "a": VALUES}).to_parquet(tmp_path / "run.parquet")
    pandas.DataFrame({"s": T[::5], "n": 100 * T[::5]}).to_csv(tmp_path / "tacho.csv", index=False)
    told = """
file = "run.parquet"
time = { column = "t", unit = "s" }
[channels.housing]
column = "a"
unit = "m/s^2"
[channels.tacho]
file = "tacho.csv"
time = { column = "s", unit = "s" }
column = "n"
unit = "rpm"
"""
    found = jr.read_record(write(tmp_path, None, told, "run.parquet"))
    assert (len(found["housing"]), len(found["tacho"])) == (50, 10)


def test_shuffled_time(tmp_path):
    order = np.random.default_rng(0).permutation(50)
    table = {"t": 1e3 * T[order], "a": VALUES[order]}
    with pytest.raises(jr.InputError, match=r"`run.csv`: a: time must rise, but row .* sort"):
        jr.read_record(write(tmp_path, table))
    found = jr.read_record(write(tmp_path, table, "sort = true\n" + MAP))["housing"]
    np.testing.assert_array_equal(found.values, VALUES)


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda d: d.update(a=[*VALUES[:-1], "much"]), "row 50 of column `a`.*'much', no number"),
        (lambda d: d["t"].__setitem__(4, np.nan), "the instant in row 5 is nan"),
        (lambda d: d["a"].__setitem__(4, np.inf), "the value in row 5 is infinite"),
        (lambda d: d["t"].__setitem__(4, d["t"][3]), "time must rise, but row 5"),
        (lambda d: d.update(t=d["t"][:3], a=d["a"][:3]), "has 3 values; 4 at least"),
        (lambda d: d.update(b=d.pop("a")), "no such column"),
    ],
)
def test_bad_tables(tmp_path, change, words):
    table = {"t": list(1e3 * T), "a": list(VALUES)}
    change(table)
    with pytest.raises(jr.InputError, match=words):
        jr.read_record(write(tmp_path, table))


@pytest.mark.parametrize(
    "told, words",
    [
        ("file = 3 4", "is no valid TOML at line 1"),
        (MAP.replace('column = "a"', 'colum = "a"'), "colum.*did you mean `column`"),
        (MAP.replace("m/s^2", "m/s^^2"), "is no unit"),
        (MAP.replace('unit = "ms"', 'unit = "mm"'), ": time: its unit"),
        (MAP.replace("2 ms", "2 mm"), "must be in s"),
        (MAP.replace("run.csv", "walk.csv"), "walk.csv`: there is no such file"),
        (MAP.replace("run.csv", "run.xls"), "no such file"),
        ('file = "run.csv"\n', "names no channel"),
        (MAP.split("[channels")[0] + "channels = { a = 3 }", "channels.a must be a table"),
        (MAP.replace('column = "a"\n', ""), "`column` is missing"),
        (MAP.replace('unit = "ms"', 'unlt = "ms"'), "time: .*`unlt`: did you mean `unit`"),
        (MAP.replace('unit = "m/s^2"', ""), '`unit` is missing: write unit = "m/s\\^2"'),
        ("separator = 3\n" + MAP, "separator must be one character, but is 3"),
        ('decimal = "x"\n' + MAP, "decimal must be"),
        ("skip = -1\n" + MAP, "skip must be a number of lines"),
        ('encoding = "utf-99"\n' + MAP, "encoding 'utf-99' is not known"),
        (MAP.replace("-9999.0", "true"), "missing must be a number or a text"),
        ('sort = "yes"\n' + MAP, "sort must be true or false"),
    ],
)
def test_bad_descriptions(tmp_path, told, words):
    with pytest.raises(jr.InputError, match=words):
        jr.read_record(write(tmp_path, {"t": 1e3 * T, "a": VALUES}, told))


ROWS = [(0.0, 1.5), (0.5, -2.25), (1.0, 3.0), (1.5, 0.125), (2.0, 4.0)]


def plain(separator=",", decimal=".", names="t,a", rows=ROWS):
    lines = [names.replace(",", separator)]
    lines += [separator.join(f"{x:g}".replace(".", decimal) for x in row) for row in rows]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    "data, notes",
    [
        (plain().encode(), []),
        (plain("\t").encode(), ["parted by tab"]),
        (plain(";", ",").encode(), ["parted by ';'", "decimal comma"]),
        (plain(" ").encode(), ["parted by spaces"]),
        (plain("  ").encode(), ["parted by spaces"]),
        (plain().encode("utf-16"), ["read as utf-16"]),
        (plain(";", ",", names="t,Beschleunigung m²").encode("latin-1"), ["read as cp1252"]),
        (
            ("Logger 3000\nstarted;12:03\n\n" + plain(";")).encode(),
            ["2 lines before|3 lines before"],
        ),
        (plain(";").replace("t;a\n", "t;a\n[s];[m/s^2]\n").encode(), []),
        (("# t, a\n" + plain().split("\n", 1)[1]).encode(), []),
        (plain().replace("\n", ",\n").encode(), []),
        ((plain() + "2.5,4.2").encode(), ["last line has no end"]),
        (plain().replace("\n", "\r\n").encode(), []),
        (b"\xef\xbb\xbf" + plain().encode(), []),
    ],
)
def test_text_files_as_programs_write_them(tmp_path, data, notes):
    name = "Beschleunigung m²" if b"Beschl" in data else "a"
    told = f'file = "run.csv"\ntime = {{ column = "t", unit = "s" }}\n[channels.a]\ncolumn = "{name}"\n'
    (tmp_path / "run.csv").write_bytes(data)
    found = jr.read_record(write(tmp_path, {}, told + 'unit = "m/s^2"\n', "run.txt"))
    np.testing.assert_array_equal(np.stack([found["a"].t, found["a"].values], 1), ROWS)
    for note in notes:
        assert re.search(note, found.notes[0]) and found.notes[0] in repr(found)
    assert bool(found.notes) == bool(notes) or b"\n[s]" in data


def test_a_line_of_units_serves_and_words_for_missing_values(tmp_path):
    text = (
        plain(";")
        .replace("t;a\n", "t;a\nms;mm/s^2\n")
        .replace("0.125", "n/a")
        .replace("4\n", "-99\n")
    )
    (tmp_path / "run.csv").write_text(text)
    told = 'file = "run.csv"\ntime = "t"\nmissing = [-99, "n/a"]\n[channels.a]\ncolumn = "a"\n'
    with pytest.raises(jr.InputError, match="has 3 values; 4 at least"):
        jr.read_record(write(tmp_path, {}, told, "run.txt"))
    found = jr.read_record(write(tmp_path, {}, told.replace("-99, ", ""), "run.txt"))["a"]
    assert found.unit == "mm/s^2"
    np.testing.assert_allclose(found.t, 1e-3 * np.array(ROWS)[:, 0])
    assert list(np.flatnonzero(~found.valid)) == [3]


@pytest.mark.parametrize(
    "text, words",
    [
        (plain().replace("1,3\n", "1,3,7\n"), "line 4 has 3 entries where the names are 2"),
        (plain().replace("1,3\n", "1\n"), "line 4 has 1 entries where the names are 2"),
        (plain(names="t,a").replace("t,a", "a,a"), "2 columns are named `a`"),
        (plain().replace(",3\n", ",true\n"), "row 3 of column `a` .*line 4.* is 'true', no number"),
        (
            plain().replace(",1.5\n", ",n/a\n"),
            "row 1 of column `a` .* is 'n/a', no number.*missing = 'n/a'",
        ),
        (plain().replace(",3\n", ",1_000\n"), "is '1_000', no number"),
        (plain().split("\n", 1)[1], "line 1 holds numbers where the names"),
        ("t\n1\n2\n", "holds no table of two columns"),
        ("", "holds no table of two columns"),
        (plain().replace("1,3", '"1,3'), "a quotation mark is left open"),
    ],
)
def test_bad_text_files(tmp_path, text, words):
    (tmp_path / "run.csv").write_text(text)
    told = 'file = "run.csv"\ntime = "t"\n[channels.a]\ncolumn = "a"\nunit = "mm"\n'
    with pytest.raises(jr.InputError, match=words):
        jr.read_record(write(tmp_path, {}, told, "run.txt"))


def test_columns_that_are_no_real_numbers(tmp_path):
    pytest.importorskip("pyarrow")
    frame = pandas.DataFrame({"t": T, "a": VALUES > 0, "when": pandas.to_datetime(T, unit="s")})
    frame.to_parquet(tmp_path / "run.parquet")
    told = 'file = "run.parquet"\ntime = "t"\n[channels.a]\ncolumn = "a"\nunit = "mm"\n'
    for change in (told, told.replace('column = "a"', 'column = "when"')):
        with pytest.raises(jr.InputError, match="and not real numbers"):
            jr.read_record(write(tmp_path, {}, change, "run.txt"))


def test_ragged_file(tmp_path):
    place = write(tmp_path, {"t": T, "a": VALUES})
    (tmp_path / "run.csv").write_text("t,a\n1,2\n3,4,5,6\n")
    with pytest.raises(jr.InputError, match="cannot be read: .*line 3"):
        jr.read_record(place)
    with pytest.raises(jr.InputError, match="there is no such file"):
        jr.read_record(tmp_path / "none.toml")


def test_series_and_records_refuse():
    with pytest.raises(jr.InputError, match="as many values as instants"):
        jr.sensors.Series(T, VALUES[:-1])
    with pytest.raises(jr.InputError, match="must be a Series"):
        jr.Record({"a": VALUES})
    with pytest.raises(jr.InputError, match="holds no signal"):
        jr.Record({})
    with pytest.raises(jr.InputError, match="instants must be a rising list"):
        jr.sensors.angle_of([0.1, 0.1, 0.2, 0.3, 0.4], 1)
