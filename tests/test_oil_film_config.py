"""configs/oil_film_rotor.toml: where its journals ride and when it whirls."""

from pathlib import Path

import numpy as np
import pytest

import jaxrotor as jr

STUDY = jr.load(Path(__file__).parents[1] / "configs" / "oil_film_rotor.toml")


def test_journals_ride_where_the_film_carries_them_until_it_whirls():
    run = jr.simulate(STUDY.machine, 2.0, 500.0, "running", rtol=1e-5, atol=1e-9, progress=False)
    left = np.asarray(run["left"].position[:, :2])
    # at the start: half of the weight on either film, by the bearing's own working point
    film = STUDY.machine["left film"]
    assert isinstance(film, jr.JournalBearing)
    place = film.working_point((0.0, -4.8 * 9.81 / 2), 150.0)
    np.testing.assert_allclose(left[0], place.eccentricity, rtol=1e-9)
    state = jr.linearize(STUDY.machine, 150.0).state
    disc = STUDY.machine.wiring.stations.index("disc")
    assert np.max(np.abs(run["disc"].position[0, :5] - state.position[disc, :5])) < 1e-14
    # up to the linear threshold it stays well inside the clearance of 150 um, then it whirls along the wall
    threshold = float(jr.stability_threshold(STUDY.machine, 150.0, 1000.0, 18, at="equilibrium"))
    speed, whirl = np.asarray(run["disc"].speed), np.hypot(*left.T)
    assert 500.0 < threshold < 600.0
    assert np.max(whirl[speed < threshold]) < 1.2e-4
    late = speed > 950.0
    assert np.min(whirl[late]) > 1.2e-4
    turned = np.unwrap(np.arctan2(left[late][:, 1], left[late][:, 0]))
    rate = np.polyfit(np.asarray(run.t)[late], turned, 1)[0]
    assert 0.4 < rate / speed[late].mean() < 0.5


def test_a_film_at_rest_carries_nothing():
    slow = STUDY.machine.set({"drive.profile.start": 0.0})
    with pytest.raises(jr.InputError, match='initial="running"'):
        jr.static_equilibrium(slow)  # what a static start asks
