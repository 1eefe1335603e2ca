"""The gallery: studies and experiments, run as a user runs them, their pictures small and with their times.

    python docs/pages/gallery.py [NAME ...] [--limit 120] [--check] [--steps]

Runs what is named, left out: what changed since its picture was made (and what has none), each into results/gallery/NAME, one after
the other, for `--limit` seconds at most; what takes longer is said and keeps the picture that it has. Writes thumbnails
and docs/images/gallery/gallery.json (time, and what the study was), and docs/gallery.md. `--check` runs nothing and says what
is stale; `--steps` draws the pictures of docs/start/ anew.
"""

import argparse
import dataclasses
import hashlib
import json
import os
import resource
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
THUMBS = ROOT / "docs" / "images" / "gallery"
TIMES = THUMBS / "gallery.json"
PAGE = ROOT / "docs" / "gallery.md"
WIDE, LARGEST = 640, 60_000  # pixels, bytes


@dataclasses.dataclass
class Entry:
    """`picture`: of the results, the one to show. `ready`: of docs/images, where an experiment of many minutes has
    left one; then nothing is run."""

    source: str
    words: str
    picture: str
    command: str = "run"
    ready: str = ""
    options: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Of an experiment that has the name of a study, with a word more."""
        stem = Path(self.source).stem
        alike = self.source.startswith(X) and (ROOT / C / f"{stem}.toml").exists()
        return f"{stem}_experiment" if alike else stem

    def line(self) -> str:
        if self.source.startswith("configs/"):
            return f"jaxrotor {self.command} {self.source}"
        return " ".join(["python", self.source, *self.options])

    def digest(self) -> str:
        return hashlib.sha256((ROOT / self.source).read_bytes()).hexdigest()[:16]


C, X = "configs/", "experiments/"
ENTRIES = [
    Entry(C + "two_rotor_startup.toml", "The paper's machine passes its critical speed", "05_distances*", ready="startup"),
    Entry(C + "overhung_fan.toml", "An overhung fan runs up", "whirl_and_tilt*"),
    Entry(C + "friswell_two_disc.toml", "The two-disc rotor of Friswell et al. runs up", "*distances*"),
    Entry(C + "braking_through_critical.toml", "A centrifuge brakes through its critical speed", "whirl_over_speed*"),
    Entry(C + "geared_train.toml", "A fan behind a helical gear", "what_the_teeth*"),
    Entry(C + "planetary_reducer.toml", "A planetary gear and a rigid stage", "what_the_planets*"),
    Entry(C + "motor_coupling_pump.toml", "A pump set is switched on", "the_motor_s_transient*"),
    Entry(C + "clutch_start.toml", "A clutch starts a machine", "the_clutch*"),
    Entry(C + "clutch_bench.toml", "A slipping clutch on its bench", "the_clutch*"),
    Entry(C + "engine_viscous_damper.toml", "A four-cylinder engine and its viscous damper", "*torque*"),
    Entry(C + "governed_generator.toml", "A governed generator takes a load", "*torque*"),
    Entry(C + "rolling_mill.toml", "Two bars through a rolling stand", "two_bars*"),
    Entry(C + "oil_film_rotor.toml", "Oil whirl in plain journal bearings", "whirl_at_half*"),
    Entry(C + "magnetic_bearings.toml", "A rotor in magnetic bearings, and its drop", "heights*"),
    Entry(C + "cracked_shaft.toml", "A cracked rotor runs up", "*waterfall*"),
    Entry(C + "test_bench_record.toml", "A rotor driven by a measured start", "*distances*"),
    Entry(C + "compressor_assessment.toml", "A compressor held against API 617", "*.png", "assess"),
    Entry(C + "synchronous_start.toml", "A synchronous motor starts a compressor", "*start*", "torsional"),
    Entry(C + "tuned_damper.toml", "A rubber damper, tuned by gradient", "*response*", "optimize"),
    Entry(C + "tolerance_sweep.toml", "A series of blowers, by Monte Carlo", "*.png", "sweep"),
    Entry(X + "sommerfeld.py", "Captured at the critical speed", "sommerfeld*", ready="sommerfeld"),
    Entry(X + "active_torsional_damper.py", "An active damper for uncertain machines", "start*", ready="active_damper"),
    Entry(X + "identify_coupling.py", "A coupling's law from its start", "*.png", ready="coupling_characteristics"),
    Entry(X + "rk4_runup.py", "A published rig's run-up, identified", "run_up*", ready="rk4_run_up"),
    Entry(X + "rk4_rig.py", "Unbalance found blind on a rig", "blind*", ready="rk4_blind"),
    Entry(X + "phase_convention.py", "Which way phases count", "*.png", ready="phase_convention"),
    Entry(X + "cracked_shaft.py", "A crack's orders over speed", "*.png", options=("--quick",)),
    Entry(X + "wet_pump.py", "A pump rotor dry and wet", "*.png"),
    Entry(X + "pad_bearings.py", "One rotor in grooved, elliptical, lobed, offset and tilting-pad bearings", "*.png"),
    Entry(X + "pump_seals.py", "What worn seals and preswirl do to a pump", "*.png"),
    Entry(X + "compressor_labyrinths.py", "What labyrinths and swirl brakes do to a compressor", "*.png"),
    Entry(X + "earthquake.py", "An earthquake under a stiff and an isolated machine", "*.png"),
    Entry(X + "loaded_shaft.py", "A turning shaft under thrust and torque", "*.png"),
    Entry(X + "asymmetric_shaft.py", "Where a flat shaft is unstable", "*.png", options=("--quick",)),
    Entry(X + "damper_den_hartog.py", "Dampers by Den Hartog and after him", "response*"),
    Entry(X + "finite_film.py", "Films of finite length", "*.png"),
    Entry(X + "fault_signatures.py", "What each fault looks like", "*.png"),
    Entry(X + "oil_whirl.py", "Whirl, then whip", "*.png"),
    Entry(X + "rub_hysteresis.py", "A rub's jumps, up and down", "*.png"),
    Entry(X + "magnetic_bearing_design.py", "A magnetic bearing designed by its sensitivity", "*.png"),
    Entry(X + "gear_mesh.py", "Mesh stiffness, and tip relief against whine", "*.png"),
    Entry(X + "motor_faults.py", "What its supply does to a motor's coupling", "*.png", options=("--quick",)),
    Entry(X + "critical_speed_design.py", "Critical speeds moved away by gradient", "*.png"),
]  # fmt: skip


def stale(kept: dict) -> list[Entry]:
    def old(one: Entry) -> bool:
        known = kept.get(one.name, {})
        return known.get("digest") != one.digest()

    return [one for one in ENTRIES if old(one)]


def made(one: Entry, limit: float) -> dict:
    """Runs it, and makes the thumbnail. The record of it: seconds, or why there is none."""
    if one.ready:
        thumbnail(ROOT / "docs" / "images" / f"{one.ready}.png", one.name)
        return {"digest": one.digest()}
    out = ROOT / "results" / "gallery" / one.name
    out.mkdir(parents=True, exist_ok=True)
    if one.source.startswith(C):
        words = ["-m", "jaxrotor.commands.cli", one.command, one.source, "--out", str(out)]
    else:
        words = [one.source, *one.options, "--out", str(out)]
    environment = os.environ | {"JAX_ENABLE_X64": "1", "MPLBACKEND": "Agg", "JAX_PLATFORMS": "cpu"}
    environment["PYTHONPATH"] = str(ROOT / "src")
    start = _used()
    try:
        ran = subprocess.run([sys.executable, *words], cwd=ROOT, env=environment, timeout=limit,
                             capture_output=True, text=True)  # fmt: skip
    except subprocess.TimeoutExpired:
        return {"skipped": f"takes more than {limit:g} s"}
    seconds = _used() - start
    if ran.returncode not in (0, 4):  # 4: a limit is not met, which is what is to be seen
        return {"skipped": (ran.stderr or ran.stdout).strip().splitlines()[-1][:200]}
    found = sorted(out.rglob(one.picture)) or sorted(out.rglob("*.png"))
    found = [path for path in found if path.suffix == ".png"]
    if not found:
        return {"skipped": "drew nothing"}
    thumbnail(found[0], one.name)
    return {"digest": one.digest(), "seconds": round(seconds)}


def _used() -> float:
    """Processor seconds of all that was run so far: a busy machine counts no more."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


# Of the first steps: page -> picture in docs/images -> what its code calls it.
STEPS = {
    "3-look": {"start_over_time": "curves", "start_machine": "drawing"},
    "4-linearise": {"start_campbell": "axes"},
}


def draw_steps() -> None:
    """Runs the code of those pages as it stands, and keeps what they draw."""
    import re

    import matplotlib
    import numpy as np

    matplotlib.use("Agg")
    for step, pictures in STEPS.items():
        text = (ROOT / "docs" / "start" / f"{step}.md").read_text(encoding="utf-8")
        space: dict = {}
        for code in re.findall(r"^```python\n(.*?)^```$", text, re.M | re.S):
            exec(code, space)
        for name, drawn in pictures.items():
            figure = np.ravel(space[drawn])[0].figure
            path = ROOT / "docs" / "images" / f"{name}.png"
            figure.savefig(path, dpi=90)
            thumbnail(path, name, path, 1000)


def thumbnail(picture: Path, name: str, to: Path | None = None, wide: int = WIDE) -> None:
    """Of web size, in few colours: 60 kB at most."""
    from PIL import Image

    with Image.open(picture) as whole:
        small = whole.convert("RGB")
    small.thumbnail((wide, wide), Image.Resampling.LANCZOS)
    for colours in (128, 64, 32, 16):
        path = to or THUMBS / f"{name}.png"
        small.quantize(colours, dither=Image.Dither.NONE).save(path, optimize=True)
        if path.stat().st_size <= LARGEST:
            return


def page(kept: dict) -> str:
    lines = [
        "# Gallery",
        "",
        "Studies and experiments of the repository, run as anyone runs them (`make gallery`): what it looks like, with the code that makes it, and the "
        "processor seconds that it took, compiling included. Where none are told the "
        "picture is the one of another page of this site.",
        "",
        '<div class="gallery" markdown>',
        "",
    ]
    for one in ENTRIES:
        if not (THUMBS / f"{one.name}.png").is_file():
            continue
        seconds = kept.get(one.name, {}).get("seconds")
        told = f" {seconds} s" if seconds else ""
        lines += [
            "<figure markdown>",
            f"![{one.words}](images/gallery/{one.name}.png)",
            f"<figcaption markdown>**{one.words}.**{told}<br>`{one.line()}`<br>{_parts(one)}</figcaption>",
            "</figure>",
            "",
        ]
    return "\n".join([*lines, "</div>", ""])


def _parts(one: Entry) -> str:
    """What a study is made of."""
    if not one.source.startswith(C):
        return ""
    machine = tomllib.loads((ROOT / one.source).read_text(encoding="utf-8")).get("machine", {})
    told = [
        *machine.get("line", ()),
        *machine.get("attachments", ()),
        *machine.get("elements", {}).values(),
    ]
    kinds = dict.fromkeys(
        part.get("kind", "").split(":")[-1] for part in told if isinstance(part, dict)
    )
    return ", ".join(list(filter(None, kinds))[:6])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*")
    parser.add_argument("--limit", type=float, default=120.0, help="seconds each (default: 120)")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--steps", action="store_true")
    given = parser.parse_args()
    if given.steps:
        draw_steps()
        return 0
    THUMBS.mkdir(parents=True, exist_ok=True)
    kept = json.loads(TIMES.read_text()) if TIMES.is_file() else {}
    wanted = [e for e in ENTRIES if e.name in given.names] if given.names else stale(kept)
    if given.check:
        print(
            "\n".join(f"{one.name}: changed since its picture" for one in wanted)
            or "all as they are"
        )
        return bool(wanted)
    for one in wanted:
        record = made(one, given.limit)
        print(
            f"{one.name}: {record.get('skipped') or record.get('seconds', 'as in docs/images')}",
            flush=True,
        )
        if "skipped" not in record:
            kept[one.name] = record
            TIMES.write_text(json.dumps(kept, indent=1, sort_keys=True) + "\n")
    PAGE.write_text(page(kept), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
