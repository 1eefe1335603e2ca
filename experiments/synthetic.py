"""The synthetic records of experiments/data, and the truth behind them: with this seed this file makes
them anew.

python experiments/synthetic.py [--out experiments/data]
"""

import argparse
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import numpy as np
import pandas

import jaxrotor as jr
from jaxrotor.core.files import written_whole

HERE = Path(__file__).parent
CONFIGS = HERE.parent / "configs"
SEED = 20140901

# Unbalance of the two-rotor machine of Matyja & Lazarz (2014).
UNBALANCE = {
    "main.unbalance.eccentricity": 5e-4,
    "main.unbalance.angle": 0.6,
    "main.unbalance.inclination": np.deg2rad(1.0),
    "main.unbalance.inclination_angle": -1.1,
    "second.unbalance.eccentricity": 1e-5,
    "second.unbalance.angle": 2.2,
}
HOUSINGS = {
    "left_across": jr.sensors.Accelerometer("left", (1, 0, 0)),
    "left_up": jr.sensors.Accelerometer("left", (0, 1, 0)),
    "right_across": jr.sensors.Accelerometer("right", (1, 0, 0)),
    "right_up": jr.sensors.Accelerometer("right", (0, 1, 0)),
    "tacho": jr.sensors.Tachometer("second"),
}
RUN_UP = dict(end=2.5, rate=1000.0, step=2e-4)  # s, Hz, s

# The elastic coupling as it is; configs/coupling_bench.toml has it 50 % wrong.
COUPLING = {
    "coupling.phi.parts.0.coefficients[0]": 350.0,
    "coupling.phi.parts.0.coefficients[1]": 2e4,
    "coupling.phi.parts.0.damping": 0.1,
    "coupling.phi.parts.1.stiffness": 250.0,
    "coupling.phi.parts.1.damping": 1.5,
}
LOAD_STEP = {"drive.value.after": 20.0, "drive.value.duration": 0.3, "load.value.after": -32.0}
BENCH = {
    "motor_speed": jr.sensors.Tachometer("motor"),
    "brake_speed": jr.sensors.Tachometer("brake"),
    "torque": jr.sensors.TorqueSensor("coupling"),
}
BENCH_NOISE = {"motor_speed": 0.02, "brake_speed": 0.02, "torque": 0.3}  # rad/s, rad/s, N*m
COUPLING_RUNS = dict(end=0.8, rate=1000.0, step=2.5e-4)


def two_rotors(values=UNBALANCE) -> jr.Machine:
    return jr.load(CONFIGS / "two_rotor_startup.toml").machine.set(values)


def coupling_bench(values=COUPLING) -> jr.Machine:
    machine = jr.load(CONFIGS / "coupling_bench.toml").machine
    stiffness = [values[f"coupling.phi.parts.0.coefficients[{i}]"] for i in (0, 1)]
    rest = {path: value for path, value in values.items() if "[" not in path}
    return machine.set({**rest, "coupling.phi.parts.0.coefficients": np.array(stiffness)})


def run_up_noise(level: float, run: jr.Response, t: np.ndarray) -> dict[str, float]:
    """Standard deviations: so much (`level`) of the root mean square of what each sensor sees, of the
    tachometer of what it sees beside the drive's own speed."""
    found = {}
    for name, sensor in HOUSINGS.items():
        seen = np.asarray(jr.Channel(sensor).measure(run, t))
        if name == "tacho":
            seen = seen - np.interp(t, run.t, run["end"].speed)
        found[name] = level * float(np.sqrt(np.mean(seen**2)))
    return found


def channels(sensors, noise=None) -> dict[str, jr.Channel]:
    """Each sensor's channel, with white noise of the standard deviation `noise[name]`."""
    return {
        name: jr.Channel(sensor, noise=None if noise is None else jr.sensors.Noise(noise[name]))
        for name, sensor in sensors.items()
    }


def recorded(sensed: dict[str, jr.Channel], run, t, key, name: str) -> jr.Record:
    keys = jax.random.split(key, len(sensed))
    return jr.Record(
        {
            one: jr.sensors.Series(t, channel.recorded(run, k, t), channel.recorded_in)
            for k, (one, channel) in zip(keys, sensed.items())
        },
        name,
    )


def run_up(level: float, seed: int, values=UNBALANCE):
    """Channels and record of the two-rotor machine's run-up."""
    end, rate = RUN_UP["end"], RUN_UP["rate"]
    run = jr.simulate(two_rotors(values), end + 2 / rate, rate, step=RUN_UP["step"])
    t = np.arange(round(end * rate) + 1) / rate
    sensed = channels(HOUSINGS, run_up_noise(level, run, t) if level else None)
    return sensed, recorded(sensed, run, t, jax.random.key(seed), "run-up")


def coupling_runs(level: float, seed: int, values=COUPLING):
    """Channels and both records of the coupling bench; `level` 1: the noise of `BENCH_NOISE`."""
    end, rate = COUPLING_RUNS["end"], COUPLING_RUNS["rate"]
    t = np.arange(round(end * rate) + 1) / rate
    noise = {name: level * std for name, std in BENCH_NOISE.items()} if level else None
    sensed, records = channels(BENCH, noise), []
    keys = jax.random.split(jax.random.key(seed))
    for key, name, conditions in zip(keys, ("start", "load step"), ({}, LOAD_STEP)):
        machine = coupling_bench(values).set(conditions)
        run = jr.simulate(machine, end + 2 / rate, rate, "undeformed", step=COUPLING_RUNS["step"])
        records.append(recorded(sensed, run, t, key, name))
    return sensed, records


def compared(found: jr.identification.Identification, truth: dict[str, float], noisy: bool) -> str:
    """How far the estimates lie from the truth; without noise the standard deviations are rounding."""
    lines = []
    for path, value in truth.items():
        away = found.values[path] - value
        if "angle" in path:
            away = np.remainder(away + np.pi, 2 * np.pi) - np.pi
        size = f"{abs(away):.1e} rad" if "angle" in path else f"{abs(away / value):.1e} of it"
        stds = f", {away / found.std[path]:+.2f} standard deviations" if noisy else ""
        lines.append(f"  {path}: truth {value:.6g}, off by {size}{stds}")
    return "\n".join(lines)


def write(record: jr.Record, file: Path) -> None:
    """A CSV with its units in a TOML beside it, as `jr.read_record` takes them."""
    t = next(iter(record.series.values())).t
    columns = {"t": t, **{name: one.values for name, one in record.series.items()}}
    with written_whole(file.with_suffix(".csv")) as part:
        pandas.DataFrame(columns).to_csv(part, index=False, float_format="%.8g")
    lines = [
        f'file = "{file.name}.csv"',
        f'name = "{record.name}"',
        'time = { column = "t", unit = "s" }',
    ]
    for name, one in record.series.items():
        lines += ["", f"[channels.{name}]", f'column = "{name}"', f'unit = "{one.unit}"']
    with written_whole(file.with_suffix(".toml")) as part:
        part.write_text("\n".join(lines) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=HERE / "data", help="folder; made if missing")
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    sensed, record = run_up(0.05, SEED)
    write(record, out / "two_rotor_run_up")
    for name, channel in sensed.items():
        print(
            f"two_rotor_run_up: {name}: noise {float(channel.noise.std):.4g} {channel.recorded_in}"
        )
    _, (start, load_step) = coupling_runs(1.0, SEED)
    write(start, out / "coupling_start")
    write(load_step, out / "coupling_load_step")
    print(f"{out}/: {', '.join(sorted(p.name for p in out.iterdir()))}")


if __name__ == "__main__":
    main()
