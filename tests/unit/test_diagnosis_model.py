"""What a fit knows of its parameters, and what of the effects that it names."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from bushcli.active import ActiveEffect
from bushcli.casefile import Material
from bushcli.diagnosis.model import Fitted, Model
from bushcli.diagnosis.naming import derived, named, quantities
from bushcli.diagnosis.noise_model import Compared, NoiseModel
from bushcli.diagnosis.selected import Selection
from bushcli.effect import effects
from bushcli.recording import Recording

SIGMA = 2.0
YEOH = Material("yeoh", 2000.0)
Q = np.linspace(-4.0, 4.0, 81)
FORCE = 100.0 * Q + 3.0 * Q**3


def fitted(names, columns, active=(), law="yeoh", seed=1):
    """A fit of a law's parameters and one of an effect to a noisy line; the columns are its derivatives."""
    noise = SIGMA * np.random.default_rng(seed).normal(size=len(Q))
    channel = Compared(Recording("axial", Q, FORCE + noise, name="axial"), FORCE, NoiseModel(SIGMA))
    x = np.ones(len(names))
    model = Model(law, {"C10": 1.0, "C20": 1.0, "C30": 1.0}, effects=active)
    return Fitted(model, tuple(names), x, (channel,), (np.column_stack(columns),), (0.0,), (0.0,), True)


def test_standard_errors_are_those_of_least_squares():
    columns = [Q, Q**3]
    found = fitted(["C10", "C20"], columns).covariance()
    J = np.column_stack(columns) / SIGMA
    # Times the misfit's own size and memory, which are those of noise here.
    assert np.sqrt(np.diag(found)) == pytest.approx(np.sqrt(np.diag(np.linalg.inv(J.T @ J))), rel=0.2)


def test_what_the_recordings_leave_open_has_no_standard_error():
    # A factor on all moduli: of C10 and the factor only the product is known, C20 beside them is.
    found = fitted(["C10", "C20", "factor", "nothing"], [Q, Q**3, 2.0 * Q, 0.0 * Q]).covariance()
    assert np.isinf(np.diag(found)).tolist() == [True, False, True, True]
    assert np.sqrt(found[1, 1]) == pytest.approx(
        np.sqrt(fitted(["C10", "C20"], [Q, Q**3]).covariance()[1, 1])
    )
    assert quantities(fitted(["C10", "C30"], [Q, 2.0 * Q]), YEOH)["C30"].upper == math.inf


def test_the_evidence_is_against_the_model_without_the_effect_and_not_against_the_plain_law():
    mullins, friction = (ActiveEffect(effects()[name]).started() for name in ("mullins", "friction"))
    plain = fitted(["C10"], [Q])
    best = fitted(["C10"], [Q], (mullins, friction))
    found = Selection(plain, best)
    worse = SimpleNamespace(bic=lambda: best.bic() + 30.0)
    found.refits = {(): SimpleNamespace(bic=lambda: best.bic() + 900.0), ("mullins",): worse}
    first, second = named(found, YEOH)
    assert (first.name, second.name) == ("friction", "mullins")
    assert first.evidence == pytest.approx(30.0)
    # Friction alone was not fitted, or could not be: then nothing is said, least of all 900.
    assert math.isnan(second.evidence)


def test_models_are_compared_on_one_mesh():
    """The final model is shown on the usual mesh; the others were fitted on the coarse one."""
    mullins = ActiveEffect(effects()["mullins"]).started()
    plain, coarse = fitted(["C10"], [Q]), fitted(["C10"], [Q], (mullins,))
    shown = fitted(["C10"], [Q], (mullins,), seed=2)
    found = Selection(plain, shown, rough=coarse)
    found.refits = {(): SimpleNamespace(bic=lambda: coarse.bic() + 50.0)}
    assert named(found, YEOH)[0].evidence == pytest.approx(50.0)
    assert abs(shown.bic() - coarse.bic()) > 1.0


def test_a_compliance_that_is_added_is_said_with_the_case_s_own():
    # 1/2000 + 1/2000 = 1/1000.
    (compliance,) = effects()["compressibility"].parameters
    both = derived(compliance, 5e-4, YEOH)
    assert both["bulk_modulus"] == (pytest.approx(2000.0), "MPa")
    assert both["total_bulk_modulus"] == (pytest.approx(1000.0), "MPa")
    assert list(derived(compliance, 5e-4, Material("yeoh"))) == ["bulk_modulus"]
    assert derived(compliance, 0.0, YEOH) == {}
    (young, *_) = effects()["sleeve_compliance"].parameters
    assert list(derived(young, 5e-4, YEOH)) == ["youngs_modulus"]
