"""What a comparison says in words of a model that fits where it was fitted and not elsewhere, or nowhere."""

from dataclasses import replace

import numpy as np
import pytest
from linear_study import SD, TIME, fitted, measured

from muslin.core.series import PointSeries
from muslin.inference.criticism.comparing.adequacy import adequacy
from muslin.inference.criticism.comparing.excess import excess, sentence
from muslin.inference.criticism.comparing.groups import partitions
from muslin.inference.criticism.comparing.result import Comparison, Row
from muslin.inference.noise import Noise
from muslin.inference.residuals import Offsets, residual

TRUTH, NONE, NOISE = np.full(3, 0.5), Offsets(), Noise(SD, 0.0, "told", "m", 0.02)


@pytest.mark.parametrize(("off", "told"), [(0.0, False), (0.02, True)])
def test_held_out_recordings_that_are_far_off_are_told_of_a_model_that_fits(off: float, told: bool) -> None:
    rng = np.random.default_rng(0)
    points = measured(rng)
    (take,), jacobian, unit = fitted(points, NOISE, NONE, TRUTH)
    tested = adequacy([take], partitions([take]), jacobian, unit, NOISE, NONE, rng)
    other = replace(take.recording, name="other", series=PointSeries(TIME, points + off))
    held = replace(take, recording=other, fitted=False, residual=residual(other, take.best.series, NOISE, NONE))
    groups = tuple(excess([take, held], partitions([take, held]), NOISE, rng))
    rows = tuple(
        Row(h.name, role, h.residual.rms, SD, 0.0, 0.1, 0.1, 0.2, 3, "m", 0.0, 0.0, 0.5, 0.1)
        for h, role in ((take, "fit"), (held, "held-out"))
    )
    comparison = Comparison(rows, tested, groups, sentence(groups, 2), "")
    last = comparison.text().splitlines()[-1]
    assert last.startswith("The model is adequate on the recordings that it was fitted to")
    assert ("held-out recordings are far off (1 of 1; most other, 10.0 times what noise gives)" in last) == told
    assert (comparison.to_json()["elsewhere"] in last) and bool(comparison.to_json()["elsewhere"]) == told
    wrong = replace(comparison, adequacy=replace(tested, p_value=1e-3))
    assert not wrong.elsewhere and wrong.text().splitlines()[-1] == wrong.adequacy.text()
    lost = replace(wrong, rows=(replace(rows[0], rmse=0.2), rows[1]))
    assert "On 1 of the 1 fitted recordings (made up) the model is further off than the first measured" in lost.text()
    assert lost.to_json()["astray"] and not wrong.astray and not replace(lost, adequacy=tested).astray
    assert not replace(wrong, rows=(rows[0], replace(rows[1], rmse=0.2))).astray
