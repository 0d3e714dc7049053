"""Effects on rubber and assembly, and contact with plates, against closed forms, other meshes and another code."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from dolfinx import mesh as dolfinx_mesh
from scipy.optimize import brentq

from bushcli.effects.active import ActiveEffect
from bushcli.effects.assembly import features_of
from bushcli.effects.effect import effect
from bushcli.effects.library.sleeve_compliance import RIGID
from cases.feature import Feature, Installed
from cases.march import march
from cases.mode import modes
from cases.model import FiniteElementModel
from cases.program import Program
from cases.simulate import Rubber, is_odd, prepare
from cases.snubber import pushed_back
from forms.law import law
from geometry import ring
from geometry.mesh import build
from geometry.shape import Refinement, Sleeve, Snubber, shapes

SHARP = 1e-11
COARSE = Refinement(across=2, along=4, around=8)
MU, KAPPA = 1.0, 300.0
NEO_HOOKEAN = Rubber(law("neo_hookean"), {"C10": MU / 2}, KAPPA)
# The bushing of the practice recordings, and their rubber (FElupe 11.3).
PRACTICE = {"inner_radius": 9.0, "outer_radius": 18.0, "length": 34.0}
YEOH = Rubber(law("yeoh"), {"C10": 0.48, "C20": -0.035, "C30": 0.006}, 2000.0)


def bushing(**more):
    return shapes()["plain"](**(PRACTICE | more))


def features(**values):
    return features_of([ActiveEffect(effect(name), given) for name, given in values.items()])


def curve(shape, mode, rubber, q, refinement=COARSE, installed_features=(), **options):
    model = prepare(shape, modes()[mode], rubber, refinement, features=installed_features)
    return march(model, Program(np.asarray(q, dtype=float)), tolerance=SHARP, **options)


# -- coupons: homogeneous, closed forms --------------------------------------------------------------------------------


@pytest.mark.parametrize("compliance", [0.0, 0.002])
def test_compressibility_adds_to_the_volume_of_a_block(compliance):
    q = np.array([-0.02, 0.03])
    found = curve(
        shapes()["coupon"](),
        "volumetric",
        NEO_HOOKEAN,
        q,
        installed_features=features(compressibility={"compliance": compliance}),
    ).force
    kappa, stretch = 1 / (1 / KAPPA + compliance), 1 + q
    np.testing.assert_allclose(found, kappa * stretch**2 * (stretch**3 - 1), rtol=1e-8)


def test_cure_shrinkage_pulls_at_a_block_that_is_held():
    """F = (1 - s) F_e, energy per volume of the shrunk rubber: nominal stress kappa l^2 (l^3/(1 - s)^3 - 1)."""
    s, q = 0.01, np.array([0.0, 0.02])
    found = curve(
        shapes()["coupon"](),
        "volumetric",
        NEO_HOOKEAN,
        q,
        installed_features=features(cure_shrinkage={"shrinkage": s}),
    ).force
    stretch = 1 + q
    np.testing.assert_allclose(found, KAPPA * stretch**2 * (stretch**3 / (1 - s) ** 3 - 1), rtol=1e-8)


def test_cure_shrinkage_makes_a_free_block_a_smaller_one():
    """Pulled to l the shrunk rubber has the stretch l / (1 - s) and a section of (1 - s)^2."""
    s, q = 0.02, np.array([0.1, 0.5])
    shrunk = curve(
        shapes()["coupon"](),
        "uniaxial",
        NEO_HOOKEAN,
        q,
        installed_features=features(cure_shrinkage={"shrinkage": s}),
    ).force
    plain = curve(shapes()["coupon"](), "uniaxial", NEO_HOOKEAN, (1 + q) / (1 - s) - 1).force
    np.testing.assert_allclose(shrunk, (1 - s) ** 2 * plain, rtol=1e-7)


# -- contact -----------------------------------------------------------------------------------------------------------


def test_a_block_pressed_against_a_plate_at_its_side():
    """Uniaxial until the side has moved by the gap; then the plate's pressure k d on the side is a third stress."""
    gap, stiffness = 0.05, 40.0

    def surface(values, place):
        return [pushed_back(place.u[2] - values["gap"], stiffness) * place.ds("face_z")]

    plate = Installed("plate", Feature(surface=surface), {"gap": gap})
    model = prepare(
        shapes()["coupon"](), modes()["uniaxial"], replace(NEO_HOOKEAN, bulk_modulus=np.inf), features=[plate]
    )
    q = np.linspace(0.0, -0.4, 41)
    history = march(model, Program(q), tolerance=1e-12, sensitivity=["plate.gap"])

    def force(stretch, gap=gap):
        def side(z):
            # Nominal stress of the side, with the free one y = 1 / (x z): mu (z - y^2 / z) = -k <z - 1 - gap>.
            y = 1 / (stretch * z)
            return MU * (z - y**2 / z) + stiffness * max(z - 1 - gap, 0.0)

        z = brentq(side, 0.5, 3.0, xtol=1e-14)
        return MU * (stretch - 1 / (stretch * z) ** 2 / stretch)

    expected = np.array([force(1 + x) for x in q])
    np.testing.assert_allclose(history.force, expected, atol=1e-8 * np.abs(expected).max())
    slopes = [(force(1 + x, gap + 1e-6) - force(1 + x, gap - 1e-6)) / 2e-6 for x in q[20:]]
    np.testing.assert_allclose(history.sensitivity[20:, 0], slopes, rtol=1e-5)
    # Work is stored; the rest is the trapezoidal rule's.
    assert np.trapezoid(history.force, q) == pytest.approx(history.energy[-1], rel=2e-3)
    # It takes more than without the plate.
    assert history.force[-1] < curve(shapes()["coupon"](), "uniaxial", NEO_HOOKEAN, [-0.4]).force[-1]


@pytest.mark.parametrize("fixed_to", ["outer", "inner"])
@pytest.mark.parametrize("mode", ["axial", "radial"])
def test_the_force_at_a_snubber_is_the_slope_of_the_energy(mode, fixed_to):
    shape = bushing(length=18.0, snubber=Snubber(gap=0.1, fixed_to=fixed_to))
    step = 1e-3
    history = curve(shape, mode, YEOH, [0.5, 1.0 - step, 1.0, 1.0 + step])
    plain = curve(bushing(length=18.0), mode, YEOH, [0.5, 1.0])
    assert history.force[2] > 1.05 * plain.force[1]
    slope = (history.energy[3] - history.energy[1]) / (2 * step)
    assert slope == pytest.approx(history.force[2], rel=1e-5)


def test_a_plate_on_one_side_only_makes_the_curve_uneven():
    shape = bushing(length=18.0, snubber=Snubber(gap=0.2, ends="top"))
    assert not is_odd(shape, modes()["axial"])
    assert is_odd(shape, modes()["radial"])
    up, down = (curve(shape, "axial", YEOH, [sign]).force[0] for sign in (1.0, -1.0))
    plain = curve(bushing(length=18.0), "axial", YEOH, [1.0]).force[0]
    assert up > 1.2 * plain
    # Downwards the rubber bulges near the outer sleeve, but hardly to the plate.
    assert abs(down) < up


# -- assembly ----------------------------------------------------------------------------------------------------------


def test_swaging_as_another_code_has_it():
    """Axial and radial stiffness at rest with the outer bond 0.5 mm inwards, over those without, from FElupe."""
    swaged = features(swaging={"reduction": 0.5})
    q = [0.05]
    ratio = {
        mode: curve(bushing(), mode, YEOH, q, Refinement(), swaged).force[0]
        / curve(bushing(), mode, YEOH, q, Refinement()).force[0]
        for mode in ("axial", "radial")
    }
    assert ratio["axial"] == pytest.approx(245.512 / 279.093, rel=0.01)
    # Its radial mesh of linear elements is 0.7 % too stiff without swaging, and more where the ends are squeezed out.
    assert ratio["radial"] == pytest.approx(2077.634 / 1826.616, rel=0.015)


def test_swaging_is_the_same_in_the_half_plane_and_in_space(monkeypatch):
    """Swaging changes axial and torsional stiffness alike in a section and in a solid with the same section."""
    monkeypatch.setattr("geometry.ring.SECTION_GRADING", ring.SOLID_GRADING)
    refinement = Refinement(across=3, along=8, around=8)
    for mode, q in (("axial", 1.0), ("torsional", 0.1)):
        ratio = []
        for kind in (modes()[mode], replace(modes()[mode], section=None)):
            force = [
                march(
                    prepare(bushing(), kind, YEOH, refinement, features=installed_features),
                    Program(np.array([q])),
                ).force[0]
                for installed_features in ((), features(swaging={"reduction": 0.5}))
            ]
            ratio.append(force[1] / force[0])
        assert abs(ratio[0] - 1) > 0.03
        # Eight elements around.
        assert ratio[1] == pytest.approx(ratio[0], rel=1e-3)


def test_a_misaligned_bushing_is_one_with_a_moved_mesh():
    offset, q = 1.0, [-1.0, 1.0]
    off_centre = curve(
        bushing(), "radial", YEOH, q, installed_features=features(misalignment={"offset": offset})
    )
    mirrored = curve(
        bushing(), "radial", YEOH, q, installed_features=features(misalignment={"offset": -offset})
    )
    np.testing.assert_allclose(mirrored.force, -off_centre.force[::-1], rtol=1e-7)
    mesh = build(bushing(), 3, frozenset({"y", "z"}), COARSE)
    x = mesh.mesh.geometry.x
    x[:, 0] += offset * (18.0 - np.hypot(x[:, 0], x[:, 1])) / 9.0
    moved = FiniteElementModel(mesh, modes()["radial"], YEOH.law, YEOH.parameters, YEOH.bulk_modulus)
    expected = march(moved, Program(np.array(q))).force
    assert expected[1] > 1.05 * abs(expected[0])
    # Curved element edges are parabolas in one mesh and moved parabolas in the other.
    np.testing.assert_allclose(off_centre.force, expected, rtol=2e-3)


BONDS = effect("debonding").parameter("bond").choices


def loose(bond, length=3.0):
    return features(debonding={"length": length, "bond": float(BONDS.index(bond))})


@pytest.mark.parametrize("sleeve", ["inner", "outer"])
@pytest.mark.parametrize(("mode", "q"), [("axial", 1.0), ("torsional", 0.1)])
def test_a_debonded_bushing_is_one_whose_boundary_is_free(mode, q, sleeve):
    """The force lost by a debonded length of 3 mm, against a mesh whose boundary is free there."""
    fine, length = Refinement(across=8, along=68), 3.0
    mesh = build(bushing(), 2, frozenset(), fine)
    kind = modes()[mode]

    def force(named):
        model = FiniteElementModel(named, kind, YEOH.law, YEOH.parameters, YEOH.bulk_modulus)
        return march(model, Program(np.array([q]))).force[0]

    whole = force(mesh)
    facets = mesh.facets.find(mesh.boundary[sleeve])
    middle = dolfinx_mesh.compute_midpoints(mesh.mesh, 1, facets)[:, 1]
    values = mesh.facets.values.copy()
    free = facets[middle > 17.0 - length]
    edge = np.sort(middle[middle <= 17.0 - length])[-1] + np.sort(middle[middle > 17.0 - length])[0]
    length = 17.0 - edge / 2  # the edge is at a node of the mesh, to a tenth of an element
    values[np.isin(mesh.facets.indices, free)] = 99
    tags = dolfinx_mesh.meshtags(mesh.mesh, 1, mesh.facets.indices, values)
    lost = whole - force(replace(mesh, facets=tags))
    bonded = prepare(bushing(), kind, YEOH, fine, features=loose(f"{sleeve}_top", float(length)))

    def found(length):
        bonded.set_parameters({"debonding.length": float(length)})
        return whole - march(bonded, Program(np.array([q]))).force[0]

    assert lost > 0.005 * whole
    # The transition at the edge of the bond is a twentieth of the thickness wide, so the free length is known to half
    # of that.
    assert found(length - 0.2) < lost < found(length + 0.2)
    if (mode, sleeve) != ("torsional", "outer"):
        assert found(length) == pytest.approx(lost, rel=0.05)


def test_a_whole_bond_gives_the_same_force_on_the_mesh_of_one_that_may_end_anywhere():
    shape, q = shapes()["plain"](inner_radius=8.48, outer_radius=18.4, length=35.1), [0.2, 2.0]
    whole, off = (
        curve(shape, "radial", YEOH, q, Refinement(), given).force for given in ((), loose("outer_top", 0.0))
    )
    np.testing.assert_allclose(off, whole, rtol=1e-3)


@pytest.mark.parametrize("length", [3.0, 10.0, 14.0])
def test_the_default_mesh_resolves_a_bond_that_ends_up_to_one_and_a_half_thicknesses_from_the_end(length):
    """Graded for the free ends alone, it was up to 7 % too stiff there."""
    shape = shapes()["plain"](inner_radius=8.48, outer_radius=18.4, length=35.1)
    found, fine = (
        curve(shape, "radial", YEOH, [0.2], mesh, loose("outer_top", length)).force[0]
        for mesh in (Refinement(), Refinement(along=24))
    )
    assert found == pytest.approx(fine, rel=0.01)


@pytest.mark.parametrize("sleeve", ["inner", "outer"])
@pytest.mark.parametrize("mode", ["axial", "torsional", "radial", "conical"])
def test_a_bond_that_is_off_at_the_bottom_is_the_mirror_image_of_one_at_the_top(mode, sleeve):
    """Therefore a diagnosis leaves out exactly those choices that give the same curve."""
    reach = 0.1 if modes()[mode].rotational else 1.0
    q = np.array([-reach, reach])
    top, bottom = (
        curve(bushing(), mode, YEOH, q, installed_features=loose(f"{sleeve}_{end}")).force
        for end in ("top", "bottom")
    )
    np.testing.assert_allclose(bottom, -top[::-1], rtol=1e-6)
    choice = effect("debonding").parameter("bond")
    alike = len(choice.distinct_choices(bushing(), [mode])) == 2
    assert alike == bool(np.allclose(top, bottom, rtol=1e-6))
    # Together with an effect that is not symmetric about the mid-plane, all choices differ.
    assert choice.distinct_choices(bushing(), [mode], frozenset("z")) == BONDS


def test_a_swaged_sleeve_takes_the_bond_with_it():
    """Where springs model the outer bond (here fully bonded), they move inward with the sleeve."""
    swaged, off = {"reduction": 0.5}, {"length": 0.0, "bond": 2.0}
    expected = curve(bushing(), "axial", YEOH, [1.0], installed_features=features(swaging=swaged)).force
    both = features(swaging=swaged, debonding=off)
    found = curve(bushing(), "axial", YEOH, [1.0], installed_features=both, sensitivity=["swaging.reduction"])
    np.testing.assert_allclose(found.force, expected, rtol=1e-5)
    step = 0.01
    ends = [
        curve(
            bushing(),
            "axial",
            YEOH,
            [1.0],
            installed_features=features(swaging={"reduction": r}, debonding=off),
        ).force
        for r in (0.5 - step, 0.5 + step)
    ]
    np.testing.assert_allclose(found.sensitivity[:, 0], (ends[1] - ends[0]) / (2 * step), rtol=1e-3)


def test_a_sleeve_drawn_in_to_a_cone_is_pushed_towards_its_wide_end():
    """At rest; turned about, it is pushed the other way. Without a mean reduction the radial stiffness is as before."""
    cone = {"reduction": 0.3, "slope": 0.01}

    def axial(**change):
        by = ["swaging.reduction", "swaging.slope"]
        swaged = features(swaging=cone | change)
        return curve(bushing(), "axial", YEOH, [0.0, 1.0], installed_features=swaged, sensitivity=by)

    found = axial()
    turned = axial(slope=-0.01).force
    straight = axial(slope=0.0).force
    assert found.force[0] * turned[0] < 0
    assert found.force[0] == pytest.approx(-turned[0], rel=1e-6)
    assert straight[0] == pytest.approx(0.0, abs=1e-6 * straight[1])
    assert abs(found.force[0]) > 0.002 * straight[1]
    for i, (name, value) in enumerate(cone.items()):
        ends = [axial(**{name: value + sign * 1e-4}).force for sign in (1, -1)]
        np.testing.assert_allclose(found.sensitivity[:, i], (ends[0] - ends[1]) / 2e-4, rtol=1e-5)
    plain = curve(bushing(), "radial", YEOH, [0.5]).force
    conical = features(swaging={"reduction": 0.0, "slope": 0.005})
    whole = curve(bushing(), "radial", YEOH, [0.5], installed_features=conical).force
    assert whole == pytest.approx(plain, rel=0.01)


@pytest.mark.parametrize("mode", ["axial", "torsional", "radial"])
@pytest.mark.parametrize("grip", ["ends", "surface"])
def test_a_swaged_elastic_sleeve_is_free_of_stress(mode, grip):
    """Swaging draws in a stiff sleeve, wherever it is held, as it does a rigid one, and with exact slopes."""
    swaged, q = features(swaging={"reduction": 0.4}), [0.1]
    by = ["swaging.reduction"]
    rigid = curve(bushing(), mode, YEOH, q, installed_features=swaged, sensitivity=by)
    stiff = bushing(outer_sleeve=Sleeve(thickness=2.0, youngs_modulus=2e6, grip=grip))
    found = curve(stiff, mode, YEOH, q, installed_features=swaged, sensitivity=by)
    np.testing.assert_allclose(found.force, rigid.force, rtol=1e-3)
    np.testing.assert_allclose(found.sensitivity, rigid.sensitivity, rtol=1e-2)
    soft = bushing(outer_sleeve=Sleeve(thickness=2.0, youngs_modulus=2e3, grip=grip))
    slope = curve(soft, mode, YEOH, q, installed_features=swaged, sensitivity=by).sensitivity[0, 0]
    below, above = (
        curve(soft, mode, YEOH, q, installed_features=features(swaging={"reduction": r})).force[0]
        for r in (0.399, 0.401)
    )
    assert (above - below) / 0.002 == pytest.approx(slope, rel=1e-4)


def test_sleeves_that_are_rigid_turn_with_the_bushing():
    """Much stiffer metal would prevent the equilibrium of a turned sleeve, by rounding beside the rubber's tangent."""
    shape = shapes()["plain"](inner_radius=11.5, outer_radius=18.7, length=22.3)
    q = np.linspace(0.02, 0.2, 10)
    rigid = features(sleeve_compliance={"compliance": 0.0, "thickness": 2.0})
    found, plain = (
        march(prepare(shape, modes()["torsional"], YEOH, Refinement(), features=given), Program(q)).force
        for given in (rigid, ())
    )
    np.testing.assert_allclose(found, plain, rtol=1e-3)


def test_compliant_sleeves_are_those_that_a_case_could_give():
    given = Sleeve(thickness=2.0, youngs_modulus=1 / (1.4e-5 + RIGID), grip="ends")
    q = [1.0]
    expected = curve(bushing(inner_sleeve=given, outer_sleeve=given), "radial", YEOH, q).force
    found = curve(
        bushing(),
        "radial",
        YEOH,
        q,
        installed_features=features(sleeve_compliance={"compliance": 1.4e-5, "thickness": 2.0}),
    ).force
    np.testing.assert_allclose(found, expected, rtol=1e-8)


@pytest.mark.parametrize("sleeve", [None, Sleeve(thickness=2.0, youngs_modulus=1e4, grip="ends")])
def test_what_was_assembled_has_exact_slopes_with_memory_and_by_the_law(sleeve):
    """Swaging and shrinkage before the test, friction and relaxation during it; slopes by all parameters at once."""
    values = {
        "swaging": {"reduction": 0.3},
        "cure_shrinkage": {"shrinkage": 0.01},
        "viscoelasticity": {"g1": 0.3, "tau1": 3.0},
    }
    shape = bushing(length=20.0, outer_sleeve=sleeve)
    model = prepare(shape, modes()["axial"], YEOH, COARSE, features=features(**values))
    path = Program(np.array([1.0, 2.0, 0.5, -1.0]), np.array([1.0, 2.0, 4.0, 9.0]))
    given = dict(YEOH.parameters) | {f"{n}.{k}": v for n, p in values.items() for k, v in p.items()}
    exact = march(model, path, tolerance=SHARP, sensitivity=tuple(given)).sensitivity

    def force(name, value):
        model.set_parameters(given | {name: value})
        return march(model, path, tolerance=SHARP).force

    for column, (name, value) in enumerate(given.items()):
        step = 1e-3 * abs(value)
        found = (force(name, value + step) - force(name, value - step)) / (2 * step)
        # The difference errs with the second order of the step: 1e-6 of the slope.
        np.testing.assert_allclose(
            found, exact[:, column], atol=1e-5 * np.abs(exact[:, column]).max(), rtol=0, err_msg=name
        )


def test_swaging_to_where_the_model_ends():
    """Axial stiffness relative to that without reduction, from FElupe: three fields, 8 x 28 biquadratic elements.

    Its meshes of 4 x 14 to 12 x 44 elements differ by 4 % at a reduction of a ninth of the thickness, and fail or give
    negative stiffness beyond an eighth.
    """
    shape = shapes()["plain"](inner_radius=9.0, outer_radius=18.0, length=34.0)
    neo = Rubber(law("neo_hookean"), {"C10": 0.3}, 2000.0)
    reference = {0.25: 166.910 / 173.989, 0.5: 157.088 / 173.989, 1.0: 130.623 / 173.989}
    plain = curve(shape, "axial", neo, [0.01], Refinement()).force[0]
    for reduction, expected in reference.items():
        swaged = features(swaging={"reduction": reduction})
        found = curve(shape, "axial", neo, [0.01], Refinement(), swaged).force[0] / plain
        assert found == pytest.approx(expected, rel=0.015 if reduction < 1 else 0.04)
    highest = effect("swaging").parameter("reduction").bounds(shape)[1]
    assert 1.0 < highest < 9.0 / 8
