"""`jaxrotor record`: what it says of files with known faults, what it writes, and that this is read again."""

import json
import tomllib

import numpy as np
import pytest
import scipy.io
from test_record_formats import A, B, T, mat5, other, uff58, write_tdms, write_wav

import jaxrotor as jr
from jaxrotor.commands.cli import main
from jaxrotor.plot.record import signals_over_time, spectrum_of, stretches
from jaxrotor.plot.style import close
from jaxrotor.sensors.sampling import rate_of, suspicions
from jaxrotor.sensors.survey import Signal, survey


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write_csv(place, columns):
    rows = zip(*columns.values())
    text = "\n".join(",".join("" if x != x else f"{x:.17g}" for x in row) for row in rows)
    place.write_text(",".join(columns) + "\n" + text + "\n")


# --- what is suspicious ----------------------------------------------------------------------------

CUT = [*range(600), *range(650, 2000)]
LONG = np.arange(2000) * 1e-3
WAVE = np.sin(2 * np.pi * 7.3 * LONG) + 0.01 * np.random.default_rng(0).normal(size=LONG.size)


def with_values(at, value):
    values = WAVE.copy()
    values[at] = value
    return values


@pytest.mark.parametrize(
    "t, values, words",
    [
        (LONG, np.clip(WAVE, -2, 0.8), ["may be clipped", "at the greatest, 0.8"]),
        (LONG, np.full(2000, 2.5), ["constant: all values are 2.5"]),
        (LONG, with_values(700, 9.0), ["1 spike of one value, the largest 9 at 0.7 s"]),
        (LONG, with_values([9, 700], [-7.0, 9.0]), ["2 spikes of one value, the largest 9"]),
        (LONG, with_values(slice(50, 60), np.nan), ["10 values are missing, the longest run 10 at 0.05 s"]),
        (LONG[CUT], WAVE[CUT], ["1 gap in time, the longest 0.05"]),
        (np.where(LONG == LONG[5], LONG[4], LONG), WAVE, ["1 instant is repeated, first 0.004 s", "1 gap"]),
        (LONG[[0, 2, 1, *range(3, 2000)]], WAVE, ["time falls 1 time, first in row 3, to 0.001 s"]),
        (np.round(LONG * 1.024, 4), WAVE, ["are they rounded?"]),
        (None, with_values(5, np.inf), ["1 value is missing", "1 value is infinite"]),
    ],
)  # fmt: skip
def test_faults_are_told(t, values, words):
    """Faults that were put in, each alone."""
    found = suspicions(t, values)
    for one in words:
        assert any(one in said for said in found), found
    assert len(found) <= len(words) + 1


@pytest.mark.parametrize(
    "values",
    [
        WAVE,
        np.round(20 * WAVE) / 20,  # coarse, not clipped
        np.sign(np.sin(40 * LONG)),  # a tachometer's pulses
        np.exp(-30 * (LONG % 0.25)) * np.sin(900 * LONG),  # knocks that ring
        np.random.default_rng(1).normal(size=2000),
        1e3 * LONG,
    ],
)
def test_nothing_is_suspicious_where_nothing_is_wrong(values):
    assert suspicions(LONG, values) == []


def test_jittered_instants_are_uneven_and_have_no_gaps():
    t = np.cumsum(np.random.default_rng(2).uniform(0.5, 1.5, 2000))
    assert rate_of(t) is None and suspicions(t, WAVE) == []
    assert rate_of(LONG) == pytest.approx(1000.0)
    assert rate_of(LONG[:2]) is None and rate_of(LONG[::-1]) is None


def test_no_peak_is_lost_in_a_long_record():
    values = np.zeros(100_003)
    values[77_777], values[5], values[50_000:50_100] = 9.0, -3.0, np.nan
    x, low, high = stretches(np.arange(values.size) * 1e-3, values)
    assert np.nanmax(high) == 9.0 and np.nanmin(low) == -3.0 and np.isnan(low).any()
    assert np.all(np.diff(x) > 0) and abs(x[np.nanargmax(high)] - 77.777) < 0.1


def test_amplitudes_of_sines():
    """3 at 50 Hz is 3 there, whatever the length; of the longest stretch without a gap."""
    t = np.arange(20_000) / 1024
    values = 3 * np.sin(2 * np.pi * 50 * t) + 0.5 * np.cos(2 * np.pi * 200 * t) + 7
    values[300] = np.nan
    found = spectrum_of(Signal("a", t, values, "mm"))
    assert found is not None and found.pieces > 5 and found.start == t[301]
    for f, amplitude in ((50, 3), (200, 0.5)):
        assert found.amplitude[np.argmin(np.abs(found.frequency - f))] == pytest.approx(
            amplitude, rel=1e-3
        )
    assert spectrum_of(Signal("a", None, values, "")) is None
    assert spectrum_of(Signal("a", t, 0 * t, "")) is None


# --- the command -----------------------------------------------------------------------------------


def test_record_of_a_table(place, capsys):
    columns = {
        "Zeit [ms]": 1e3 * LONG,
        "acc [m/s2]": np.clip(WAVE, -2, 0.8),
        "n (rpm)": 60 * LONG,
        "x": WAVE,
    }
    write_csv(place / "run.csv", columns)
    lines = (place / "run.csv").read_text().splitlines()
    words = ["remark", *("ok" for _ in lines[1:])]
    (place / "run.csv").write_text("\n".join(f"{a},{b}" for a, b in zip(lines, words)) + "\n")
    assert main(["record", "run.csv"]) == 0
    said, wrong = capsys.readouterr()
    assert not wrong
    for words in (
        "acc [m/s2]     2000        0  1.999      1000  m/s^2",
        "n (rpm)        2000        0  1.999      1000  rpm",
        "`Zeit [ms]` is the time, in ms",
        "remark: no column of numbers (line 2 has 'ok')",
        "acc [m/s2]: may be clipped",
        "results/run_record/: signals.png, spectra.png, summary.json",
        "jaxrotor record run.csv --init",
    ):
        assert words in said
    folder = place / "results" / "run_record"
    assert all(
        (folder / name).read_bytes()[:4] == b"\x89PNG" for name in ("signals.png", "spectra.png")
    )
    summary = json.loads((folder / "summary.json").read_text())
    acc = summary["signals"]["acc [m/s2]"]
    assert acc["rate_Hz"] == pytest.approx(1000) and acc["greatest"] == 0.8 and acc["missing"] == 0
    assert acc["rms"] == pytest.approx(np.sqrt(np.mean(columns["acc [m/s2]"] ** 2)))
    assert main(["record", "run.csv"]) == 0  # its own folder is written again


def of_csv(place):
    write_csv(place / "run.csv", {"time": T, "a [m/s^2]": A, "b": B})
    return {"a": A, "b": B}


def of_german_csv(place):
    rows = "\n".join(
        f"{1e3 * t:.17g};{a:.17g};{b:.17g}".replace(".", ",") for t, a, b in zip(T, A, B)
    )
    (place / "run.csv").write_text(f"Messung 3\n\nZeit [ms];a;b\nms;m/s^2;mm\n{rows}\n")
    return {"a": A, "b": B}


def of_mat(place):
    mat5(place / "run.mat")
    return {"data[0]": A, "data[1]": B, "a": A}


def of_rate(place):
    scipy.io.savemat(place / "run.mat", {"a": A, "b": B, "fs": 1000.0})
    return {"a": A, "b": B}


def of_tdms(place):
    write_tdms(place / "run.tdms")
    return {"a": A, "b 1": B}


def of_wav(place):
    write_wav(place / "run.wav", np.round(2**14 * np.stack([A, -A], 1)))
    return {"1": np.round(2**14 * A) / 2**15, "2": np.round(-(2**14) * A) / 2**15}


def of_uff(place):
    pytest.importorskip("pyuff")
    (place / "run.unv").write_bytes(uff58(A) + other(2411) + uff58(B, entity="bed 1", unit="EU"))
    return {"12-Z": A, "bed 1": B}


@pytest.mark.parametrize("write", [of_csv, of_german_csv, of_mat, of_rate, of_tdms, of_wav, of_uff])
def test_a_record_file_gives_the_same_numbers(place, capsys, write):
    """From the file to its record file and back: all numbers, instants and known units; what is unknown is
    refused in words until it is written."""
    expected = write(place)
    (file,) = place.glob("run.*")
    assert main(["record", file.name, "--init"]) == 0
    told = capsys.readouterr().out
    text = (place / "run.toml").read_text()
    described = tomllib.loads(text)["channels"]
    unknown = [name for name, one in described.items() if one["unit"] == "?"]
    if unknown:
        with pytest.raises(
            jr.InputError, match='unit is still "\\?": write what it was measured in'
        ) as refused:
            jr.read_record("run.toml")
        assert len(refused.value.problems) == len(unknown)
        assert 'still "?": write what is known' in told
        (place / "run.toml").write_text(text.replace('unit = "?"', 'unit = "mm"'))
    found = jr.read_record("run.toml")
    late = {"a": 0.5, "b 1": 0.75} if write is of_tdms else {}
    for name, values in expected.items():
        np.testing.assert_allclose(found[name].values, values, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(found[name].t, T + late.get(name, 0.0), atol=1e-12)
        assert name not in unknown or found[name].unit == "mm"
    assert main(["record", "run.toml", "-o", "shown"]) == 0
    assert (place / "shown" / "signals.png").exists()


def test_what_init_cannot_know(place, capsys):
    """No time and no unit: every gap is told at once, and the file is not written over."""
    scipy.io.savemat(place / "run.mat", {"a": A, "b": B})
    assert main(["record", "run.mat"]) == 0
    assert "?" in capsys.readouterr().out
    assert not (place / "results" / "run_record" / "spectra.png").exists()
    assert main(["record", "run.mat", "--init", "deep/bench.toml"]) == 0
    assert '3 entries are still "?"' in capsys.readouterr().out
    text = (place / "deep" / "bench.toml").read_text()
    assert 'file = "../run.mat"' in text
    with pytest.raises(
        jr.InputError, match='time: rate is still "\\? Hz": write how it was sampled'
    ) as told:
        jr.read_record("deep/bench.toml")
    assert len(told.value.problems) == 1
    (place / "deep" / "bench.toml").write_text(text.replace("? Hz", "1 kHz"))
    with pytest.raises(jr.InputError, match="unit is still") as told:
        jr.read_record("deep/bench.toml")
    assert len(told.value.problems) == 2
    assert main(["record", "run.mat", "--init", "deep/bench.toml"]) == 2
    assert (
        "is there already: name another file after --init, or add --force"
        in capsys.readouterr().err
    )
    assert "1 kHz" in (place / "deep" / "bench.toml").read_text()
    assert main(["record", "run.mat", "--init", "deep/bench.toml", "--force"]) == 0
    assert "? Hz" in (place / "deep" / "bench.toml").read_text()


def test_rows_that_are_out_of_order(place):
    order = np.arange(50)
    order[[10, 11]] = order[[11, 10]]
    write_csv(place / "run.csv", {"t": T[order], "a [mm]": A[order]})
    assert main(["record", "run.csv", "--init"]) == 0
    np.testing.assert_array_equal(jr.read_record("run.toml")["a"].values, A)


def test_many_channels_and_odd_names(place):
    """24 are drawn and the rest is counted; names that TOML must quote."""
    columns = {"t": T, **{f'a "{k}" $x_{k}$ [mm]': A + k for k in range(26)}}
    lines = "\n".join(";".join(f"{x:.17g}" for x in row) for row in zip(*columns.values()))
    names = ";".join(f'"{name.replace(chr(34), chr(34) * 2)}"' for name in columns)
    (place / "run.csv").write_text(f"{names}\n{lines}\n")
    assert main(["record", "run.csv", "--init"]) == 0
    found = jr.read_record("run.toml")
    np.testing.assert_array_equal(found['a "25" $x_25$'].values, A + 25)
    axes = signals_over_time(survey(place / "run.csv").signals, "run.csv")
    assert len(axes) == 24 and "the first 24 of 26" in axes[0].figure.get_suptitle()
    close([axes[0].figure])


@pytest.mark.parametrize(
    "write, words",
    [
        (lambda p: None, "run.dat`: there is no such file"),
        (lambda p: p.write_bytes(b""), "holds no table"),
        (lambda p: p.write_text("a,b\nx,y\nz,w\n"), "run.dat`: holds no column of numbers"),
        (
            lambda p: p.write_bytes(other(2411)),
            r"no signal over time, but the data sets 2411 (nodes)",
        ),
        (lambda p: p.write_bytes(uff58(A)[:900]), "is cut off"),
        (lambda p: p.mkdir(), "run.dat`: "),
    ],
)
def test_mistakes_are_sentences(place, capsys, write, words):
    write(place / "run.dat")
    for more in ([], ["--init"]):
        assert main(["record", "run.dat", *more]) == 2
        out, err = capsys.readouterr()
        assert words in err and "Traceback" not in err and len(err.splitlines()) == 1
    assert not (place / "results").exists() and not (place / "run.toml").exists()


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["run.toml", "--init"], "is a record file already"),
        (["run.csv", "--init", "run.txt"], "must end in .toml: name it run.toml"),
        (["none.toml"], "none.toml`: there is no such file"),
        (["run.csv", "--out", "run.csv"], "is a file: choose another folder"),
    ],
)
def test_wrong_arguments(place, capsys, arguments, words):
    of_csv(place)
    assert main(["record", *arguments]) == 2
    assert words in capsys.readouterr().err


def test_help_teaches(capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["record", "--help"])
    said = capsys.readouterr().out
    assert stopped.value.code == 0
    for words in ("--init", "[channels.housing]", "jaxrotor record run_up.mat", "signals.png"):
        assert words in said
