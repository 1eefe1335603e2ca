"""The words by which `--help` teaches each command."""

ABOUT = """\
Simulates rotating machines in transient states: run-up, run-down, shocks.

A study is one TOML file. It holds the machine, element by element from left to right, every
quantity with its unit, and what to simulate:

  title = "A rotor on a shaft"
  [machine]
  gravity = ["0 m/s^2", "-9.81 m/s^2", "0 m/s^2"]
  [[machine.line]]
  name = "disc"
  kind = "Rotor"
  mass = "6 kg"
  polar_inertia = "0.0187 kg*m^2"
  transverse_inertia = "0.0102 kg*m^2"
  unbalance = { eccentricity = "0.05 mm" }
  [[machine.line]]
  name = "shaft"
  kind = "Shaft"
  length = "200 mm"
  diameter = "12 mm"
  rayleigh = ["0.002 1/s", "1e-4 s"]
  [[machine.line]]
  name = "end"
  kind = "PrescribedSpin"
  profile = { kind = "CosineRamp", speed = "3000 rpm", duration = "2 s" }
  [simulation]
  t_end = "3 s"
  sample_rate = "1 kHz"
"""

EXAMPLES = """\
examples:
  jaxrotor check configs/two_rotor_startup.toml            find every mistake, run nothing
  jaxrotor show configs/two_rotor_startup.toml             draw the machine, to scale
  jaxrotor run configs/two_rotor_startup.toml              simulate, into results/two_rotor_startup/
  jaxrotor run configs/two_rotor_startup.toml --out trial  simulate, into another folder
  jaxrotor modes configs/friswell_two_disc.toml --speed "3000 rpm"     frequencies, damping, whirl
  jaxrotor campbell configs/friswell_two_disc.toml --to "4500 rpm"     frequencies over speed
  jaxrotor response configs/friswell_two_disc.toml --to "4500 rpm"     unbalance response: Bode, polar
  jaxrotor torsional configs/synchronous_start.toml        torsion: separation, response, starts
  jaxrotor assess configs/compressor_assessment.toml       API and ISO: limits, verdicts, what helps
  jaxrotor report configs/compressor_assessment.toml       the same as one HTML document
  jaxrotor identify configs/coupling_bench.toml            parameters from measured runs
  jaxrotor optimize configs/tuned_damper.toml              the best damper, as [optimize] asks
  jaxrotor report results/two_rotor_startup                a result as one page
  jaxrotor record run_up.csv                               what is in a file of measured data, drawn
  jaxrotor new startup fan.toml                            a study to begin with

what `run` writes:
  response.nc    all motions, forces and torques over time (netCDF; xarray.open_dataset reads it)
  summary.json   peaks, the speeds at which they occur, settings, versions, timings
  *.png          the figures

exit status: 0 done; 4 a limit is not met (`assess`, `report`); 2 the study or the command is wrong,
nothing was run; 3 the simulation failed (what was computed before is kept), or a search found no end; 130
stopped by Ctrl-C, SIGTERM or --time-limit: `run` keeps the samples, `identify` and `optimize` what they had
found so far, `sweep` what it had run (see --resume).
"""

OPTIMIZE = """\
The section says what may be changed, what is made small, and what must hold meanwhile:

  [[optimize.unknowns]]
  path = "damper.stiffness"            a parameter of the machine, as the study names it
  positive = true                      or bounds = ["10 N*m/rad", "200 N*m/rad"]

  [[optimize.objective]]
  measure = { kind = "PeakValue", sensor = { kind = "Twist", first = "motor", second = "fan" } }

  [[optimize.constraints]]
  measure = { kind = "TotalMass" }
  at_most = "40 kg"                    or at_least, or equal_to

  [optimize.variations]                optional: machines about the design, the worst of which counts
  spread = 0.1
  count = 50

Measures of a run (PeakValue, RootMeanSquare, Percentile, Integral, SettlingTime, PassageAmplitude,
FatigueDamage) look at what [simulation] runs, through a sensor (Twist, Signal, Tachometer, ShaftStress,
...). Measures of the machine itself (ResponsePeaks, H2Norm, DecayRate, UnbalancePeak, TotalMass) need
no run. Every quantity carries its unit, limits too.

what it writes:
  summary.json             what was gained, by which values, and which constraint costs how much
  <study>_optimized.toml   the study with the best values: run it
  history.png              the search
  before_after.png         what the sensors see, before and after (with measures of a run)
  response.png             the response over frequency, before and after (with ResponsePeaks)
"""

SWEEP = """\
The section says which parameters scatter, or which values they take, and what to keep of each run, which
is that of [simulation]:

  [sweep]
  count = 256                          how many cases; powers of two cover best
  method = "sobol"                     or "latin", "random"; "saltelli" tells shares of the variance apart
  seed = 0

  [[sweep.parameters]]
  path = "main.unbalance.eccentricity"
  distribution = { kind = "uniform", low = "0.1 mm", high = "0.6 mm" }
  also = { "second.unbalance.eccentricity" = 0.1 }     optional: follows, by a factor

  [sweep.outputs.peak]
  kind = "PeakValue"
  sensor = { kind = "Radial", station = "main" }
  at_most = "0.5 mm"                   optional: the share of cases within it is told

Distributions: uniform (low, high), normal (mean, std, and low, high to cut it), lognormal (median, sigma
of the logarithm), triangular (low, mode, high). Correlated ones: [[sweep.correlations]] with two paths
and a value. Where all parameters have values = ["1 s", "2 s"] instead, or from, to and points, every
combination is run. [sweep.table] with file and units reads the cases from a file.

Outputs: measures as in [optimize] (PeakValue, PassageAmplitude, ResponsePeaks, ...), an OverSpeed (the
largest value within ranges of speed; edges = { from = "0 rpm", to = "3000 rpm", points = 31 }), a
TimeSeries.

what it writes:
  sweep.zarr          all cases, parameters and outputs, chunk by chunk as they are run; xarray.open_zarr
                      reads it, while it grows too. Stop it any time: --resume goes on
  summary.json        percentiles, shares within limits, what matters, which cases failed and why
  distributions.png   histograms and shares; scatter.png: outputs over parameters; sensitivity.png: what
                      matters; lines.png, map.png: of a grid; <output>.png: percentiles over speed or time
"""


TORSIONAL = """\
Torsion as a reviewer asks for it (API 684): modes with the torque in every shaft (Holzer's table), their
separation from all that excites them, the forced response, and the start that [simulation] runs. The section
says what there is beside the machine; without it all is done at the drive's highest speed:

  [torsional]
  speeds = ["1450 rpm", "1500 rpm"]    of operation, of the driven shaft
  line_frequency = "50 Hz"             excites, once and twice
  orders = [1, 2]                      of every shaft, at its own speed
  margin = 0.1                         the separation asked for, a part of the excitation's frequency

  [[torsional.excitations]]            your own; with a torque the forced response is computed
  name = "impeller vanes"
  station = "pump"
  order = 5                            or frequency = "100 Hz"
  torque = "12 N*m"

  [[torsional.shafts]]                 what a shaft or coupling stands: an S-N curve
  name = "shaft"
  amplitudes = ["200 MPa", "60 MPa"]   of shear stress, or of torque: "4 kN*m"
  cycles = [1e3, 1e7]
  concentration = 1.8                  of the notch
  hours = 20000                        wanted, where the separation is not met
  starts = 5000                        wanted, by rainflow and Miner

Drives of starts and faults: kind = "SynchronousStart" (mean torque and a pulsating one of twice the slip's
frequency), "SynchronousMachine" (field, dampers, breaker), "InductionMotor", and a "Torque" whose value is a
"ShortCircuit" or a "Reclosing". Of an inverter: "TorqueRipple", "InverterDrive".

what it writes:
  interference.png   modes across the lines of all excitations; the forbidden bands; meetings marked
  modes.png          shapes and torques; holzer.txt: the tables
  response.png, .csv amplitudes in each shaft over speed, by each excitation that has a torque
  start.png          torques of the run, and the instants at which modes are passed
  summary.json       all numbers: margins, stresses, lives, peak torques, damage, starts
"""


ASSESS = """\
Holds the machine against API 617/684 and ISO, as [standards] says, and [torsional] where there is one. Only
what is named is assessed:

  [standards]
  speeds = ["4500 rpm", "7500 rpm"]        least and greatest of service
  probes = ["disc.x", "disc at 45 deg"]    resonances, margins, vibration limit, clearances
  bearings = ["b1", "b2"]                  the journals, for the unbalance placed by mode shape
  unbalance = { disc = "100 g*mm" }        instead of that
  clearances = { left = "0.3 mm" }         diametral; films have their own
  films = { b1 = ["0.1 mm", "0.14 mm"] }   least and greatest radial clearance: both machines
  limits = { most_below = 16, share = 0.75 }   instead of the standard's

  [standards.stability]                    level 1 and level 2
  stations = "disc"
  cross_coupling = "1e5 N/m"               or wheels = [{ station, power, diameter, height, density_ratio }]
  density = "20 kg/m^3"                    of the gas, mean: screening
  without = ["seal 1"]                     left out at level 1

  [standards.balance]                      ISO 21940-11
  grade = 2.5
  planes = ["left", "right"]

  [[standards.vibration]]                  ISO 20816: measured, or computed
  kind = "shaft"                           or "housing"
  place = "disc"
  accepted = "B"

  [[standards.magnetic]]                   ISO 14839-3
  name = "loop"

The last column of the table tells by how much the room to the limit grows where a parameter grows by 1 %: the
three that count most, from exact derivatives (all others in summary.json).

what it writes:
  table.txt, table.md   value, limit, verdict, source, and what moves each number
  summary.json          all of it in SI, with every sensitivity
  *.png                 response with margins, mode shapes with the unbalance, stability, screening,
                        interference diagram

exit status: 0 all is met; 4 something is not; 2 the study or the command is wrong, nothing was assessed.
docs/standards.md says where each rule was read.
"""


REPORT = """\
RESULT is a folder that a command wrote, or a file in it; it becomes one page: the machine, figures that
zoom and tell their values, orbits, a waterfall, the machine in motion with its whirl exaggerated, tables to
copy or sort, warnings, the study as it was written and how it was made. It needs plotly:
pip install "jaxrotor[report]".

  jaxrotor run configs/two_rotor_startup.toml
  jaxrotor report results/two_rotor_startup        writes results/two_rotor_startup.html

STUDY.toml is assessed as `jaxrotor assess` does, and laid out in the order of the field: static deflection
and bearing loads, critical speed map, Campbell diagram, mode shapes with the unbalance, responses with
margins, orbits, stability of levels 1 and 2, torsion, summary.

what it writes:
  one HTML file with all figures and tables in it, for a browser, to print on A4 or to keep; no network

exit status: of a result 0; of a study as of `jaxrotor assess`.
"""

NEW = """\
  jaxrotor new --list                    which templates there are
  jaxrotor new startup fan.toml          writes fan.toml, and says by which commands it is used

Beside it stands jaxrotor.schema.json: editors that know the line `#:schema` (Even Better TOML, taplo)
complete keys by it, tell units and mark what is misspelt.
"""

SCHEMA = """\
In a study, as its first line:

  #:schema jaxrotor.schema.json          after: jaxrotor schema --out jaxrotor.schema.json

Editors with Even Better TOML, or taplo, know that line.
"""

COMPLETION = """\
One line where the shell starts:

  eval "$(jaxrotor completion bash)"                                      in ~/.bashrc
  eval "$(jaxrotor completion zsh)"                                       in ~/.zshrc, after compinit
  jaxrotor completion fish | source                                       in ~/.config/fish/config.fish
"""

# What is named after a command, where it is more than a study.


RECORD = """\
FILE holds measured signals: a text table (.csv, .txt, ...), .parquet, netCDF, HDF5, MATLAB's .mat, a
universal file (.uff, .unv), TDMS or WAV; or it is a record file in TOML that describes one, as [identify]
and jr.read_record take it.

  jaxrotor record run_up.mat                       what is in it, which is time, what looks wrong
  jaxrotor record run_up.mat --init                writes run_up.toml: a record file with what was found
  jaxrotor record run_up.toml                      what the record file makes of it

A record file says which column is what:

  file = "run_up.mat"
  time = { column = "t", unit = "ms" }     or { rate = "2048 Hz" }; none where the file knows its rate
  [channels.housing]                       the name of a sensor
  column = "run/acc[2]"                    third column of the matrix acc in the struct run
  unit = "m/s^2"

What --init cannot know it writes as "?", and that is refused until you write what it is.

what it writes, without --init:
  signals.png    all signals over time; nothing between two pixels is lost
  spectra.png    amplitudes over frequency, of what is evenly sampled
  summary.json   the table, and what looks wrong: clipped, constant, missing, spikes, gaps, repeated times
"""
