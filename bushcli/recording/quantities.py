"""Quantities of columns: their words in all languages, the kinds of their units, what they may be confused with.

Recordings have `STATIC` quantities, those of some coupon tests also `SPECIAL` ones, which mean nothing in other tests;
tables of dynamic stiffness have `DYNAMIC` ones.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from cases.mode import Mode


def phrases(text: str) -> tuple[str, ...]:
    """Return the phrases that commas separate in a text."""
    return tuple(phrase.strip() for phrase in text.split(",")) if text else ()


def word_set(words: str) -> frozenset[str]:
    """Return the words of a text."""
    return frozenset(words.split())


@dataclass(frozen=True)
class ColumnQuantity:
    """A quantity of a column.

    Attributes
    ----------
    names, kinds : str, tuple of frozenset of str
        Its words in lower case, that of this project first; kinds of units of a coupon, a rotation and a translation.
    title, example, unit : str
        Its name in messages, a column name that is always understood, and the unit where nothing gives one.
    endings : tuple of str
        Last parts of compounds, which determine their meaning: Standardkraft, 试验力. The longest one decides.
    weak : tuple of str
        Words that mean it where no column has a better name.
    excluding : frozenset of str
        Words beside which a name means another quantity.
    true, unconverted : frozenset of str
        Words of its true measure, and of measures that belong to no load over an area and to no change of a length.
    raw, size : str
        What the file of a machine has instead of that of a coupon; the dimension of the coupon that converts it.
    measured, test : str
        Of a special quantity: the one in place of which it stands, and the mode of the test.
    """

    names: str
    kinds: tuple[frozenset[str], ...] = ()
    title: str = ""
    example: str = ""
    unit: str = ""
    endings: tuple[str, ...] = ()
    weak: tuple[str, ...] = ()
    excluding: frozenset[str] = frozenset()
    true: frozenset[str] = frozenset()
    unconverted: frozenset[str] = frozenset()
    raw: str = ""
    size: str = ""
    measured: str = ""
    test: str = ""

    @cached_property
    def words(self) -> tuple[str, ...]:
        """The words one by one."""
        return phrases(self.names)

    @property
    def every_kind(self) -> frozenset[str]:
        """Kinds of units that it has in any mode."""
        return frozenset[str]().union(*self.kinds)

    def kinds_in(self, mode: Mode) -> frozenset[str]:
        """Return the kinds of units that it has in a mode."""
        return self.kinds[0 if mode.specimen == "coupon" else 1 if mode.rotational else 2]


def _kinds(*kinds: str) -> tuple[frozenset[str], ...]:
    """Return kinds of units of a coupon, a rotation and a translation, or the same of all."""
    return tuple(frozenset(phrases(text)) for text in (kinds if len(kinds) == 3 else kinds * 3))


# A nominal force is none that was measured, unlike a nominal stress; an absolute force is a magnitude, unlike an
# absolute position.
_NOMINAL = word_set("nominal nom stress stresses spannung nennkraft nennlast nennweg nennmoment nennwinkel")
_MAGNITUDE = word_set("abs absolute absolut absolutwert")

STATIC: Mapping[str, ColumnQuantity] = {
    "time": ColumnQuantity(
        "time, t, elapsed time, total time, running time, zeit, prüfzeit, testzeit, 时间, temps, tempo, tiempo, 時間",
        title="time", example="time_s", unit="s", endings=("zeit", "时间"), excluding=word_set("stress")),
    "length": ColumnQuantity(
        "displacement, disp, deflection, travel, stroke, extension, crosshead, weg, standardweg, verschiebung,"
        "auslenkung, federweg, 位移, déplacement, deplacement, course, spostamento, corsa, desplazamiento, 変位,"
        "ストローク",
        title="length", example="displacement_mm", unit="mm", endings=("weg", "位移", "行程"), excluding=_NOMINAL,
        weak=("position", "traverse", "hub", "einfederung"), size="gauge_length of the specimen in mm"),
    "angle": ColumnQuantity(
        "rotation, angle, twist, winkel, drehwinkel, verdrehung, phi, 角度, φ, θ, angolo, rotazione, ángulo, rotación",
        title="rotation", example="rotation_deg", unit="deg", endings=("winkel", "角度", "转角"), excluding=_NOMINAL),
    "force": ColumnQuantity(
        "force, load, f, kraft, standardkraft, last, 力, 载荷, effort, forza, carico, fuerza, carga, 荷重, 試験力",
        title="force", example="force_N", unit="N", endings=("kraft", "力", "载荷", "负荷"),
        excluding=_NOMINAL | _MAGNITUDE,
        size="area of the specimen in mm2 (or width and thickness, or diameter, in mm)"),
    "moment": ColumnQuantity(
        "moment, torque, drehmoment, 扭矩, couple, coppia, momento, トルク",
        title="moment", example="moment_Nmm", unit="Nmm", endings=("moment", "扭矩", "力矩"),
        excluding=_NOMINAL | _MAGNITUDE),
    "stretch": ColumnQuantity(
        "stretch, lambda, stretch ratio, extension ratio, streckung, verstreckung, λ", title="stretch"
    ),
    "strain": ColumnQuantity(
        "strain, nominal strain, engineering strain, dehnung, nenndehnung, technische dehnung, 应变, ε, déformation,"
        "deformazione, deformación, ひずみ",
        title="stretch or strain", example="stretch", unit="stretch", endings=("dehnung", "应变"),
        true=word_set("true wahre log logarithmic hencky logarithmische ln natural"),
        unconverted=word_set("green lagrange lagrangian almansi biot equivalent mises"),
        raw="length"),
    "stress": ColumnQuantity(
        "nominal stress, stress, engineering stress, nennspannung, spannung, technische spannung, 应力, σ,"
        "contrainte, 応力",
        title="stress", example="nominal_stress_MPa", unit="MPa", endings=("spannung", "应力"), excluding=_MAGNITUDE,
        true=word_set("true wahre cauchy"),
        unconverted=word_set("kirchhoff pk 2nd second pk2 mises equivalent deviatoric"),
        raw="force"),
}  # fmt: skip
SPECIAL: Mapping[str, ColumnQuantity] = {
    "shear": ColumnQuantity(
        "shear strain, amount of shear, shear amount, gamma, γ, scherung, schiebung, gleitung, schubverformung,"
        "scherverformung, schubwinkel gamma, cisaillement, scorrimento",
        title="shear strain", example="shear_strain", measured="strain", test="simple_shear"),
    "shear stress": ColumnQuantity(
        "shear stress, tau, τ, schubspannung, scherspannung",
        title="shear stress", example="shear_stress_MPa", measured="stress", test="simple_shear"),
    "volume ratio": ColumnQuantity(
        "volume ratio, volumetric ratio, j, v v0, v v 0, v vo, det f, detf, volumenverhältnis",
        title="volume ratio", measured="strain", test="volumetric"),
    "volume strain": ColumnQuantity(
        "volume strain, volumetric strain, volume change, volumetric change, change of volume, dv v0, dv v, δv v0,"
        "δv v, j 1, volumendehnung, volumenänderung, volumenaenderung, volumenstauchung, dilatation, dilation",
        title="volume strain", measured="strain", test="volumetric"),
    "pressure": ColumnQuantity(
        "pressure, hydrostatic pressure, p, druck, hydrostatischer druck, pression, pressione, presión, 压力",
        title="pressure", measured="stress", test="volumetric"),
}  # fmt: skip

#: Conditions of a row of a dynamic table, in the order of `DYNAMIC`.
CONDITIONS = ("frequency", "amplitude", "preload", "preload_force", "temperature")
_MOTION, _LOAD = _kinds("strain", "angle", "length"), _kinds("stress", "moment", "force")
_STIFFNESS = _kinds("stress", "rotational stiffness, moment", "stiffness")
#: The longest phrase that a name contains decides. "modulus" is one of |K*| and K', as a rig's "stiffness" is: the file
#: or the user has to say which. The last are of columns that a rig's table has too, and that are none of the others: a
#: force is no preload.
DYNAMIC: Mapping[str, ColumnQuantity] = {
    "frequency": ColumnQuantity(
        "frequency, freq, frequenz, fréquence, frequence, frecuencia, frequenza, 频率, 周波数, частота, omega, ω,"
        "kreisfrequenz, pulsation, f", _kinds("frequency")),
    "amplitude": ColumnQuantity(
        "amplitude, amplitudes, ampl, amp, amplitud, ampiezza, 振幅, dynamic strain, dyn strain, strain amplitude,"
        "dynamic displacement, dyn displacement, dehnungsamplitude, wegamplitude, schwingweg, doppelamplitude,"
        "schwingbreite, schwingweite, oscillation strain, oscillatory strain, strain, shear strain, dehnung, gamma, γ,"
        "dsa, dda, dynamic travel, displacement amplitude, a, dyn disp, dynamic disp, dynamic stroke", _MOTION),
    "preload": ColumnQuantity(
        "preload, pre load, vorlast, vorkraft, vorspannung, vorweg, mittellast, mittelkraft, mean, mean load,"
        "mean force, mean displacement, mean strain, mean position, static load, static force, static displacement,"
        "static strain, static deflection, prestrain, pre strain, vordehnung, précharge, precharge, precarico,"
        "precarga, offset, static offset, mean stress, static stress, prestress", _MOTION),
    "preload_force": ColumnQuantity("preload force", _LOAD),
    "temperature": ColumnQuantity(
        "temperature, temp, temperatur, température, temperatura, 温度, температура, t", _kinds("temperature")
    ),
    "stiffness": ColumnQuantity(
        "complex, kd, dynamic stiffness, dyn stiffness, dynamic rate, dynamic spring rate, kdyn, k dyn, cdyn, c dyn,"
        "dynamische steifigkeit, dyn steifigkeit, dynamische federrate, complex stiffness, complex modulus,"
        "komplexer modul, complex shear modulus, raideur dynamique, 动刚度, 動ばね定数", _STIFFNESS),
    "modulus": ColumnQuantity(
        "stiffness, spring rate, steifigkeit, drehsteifigkeit, federrate, rate, modulus, modul, e modulus, e modul,"
        "g modulus, g modul, k, dynamic modulus, raideur, rigidezza, 刚度, e, g", _STIFFNESS),
    "storage": ColumnQuantity(
        "storage, storage stiffness, storage modulus, elastic stiffness, elastic modulus, storage shear modulus,"
        "elastic rate, elastic spring rate, speichermodul, speichersteifigkeit, real, real part, in phase,"
        "in phase stiffness, stor, k1, re,"
        "module de conservation, 储能模量, 貯蔵弾性率, eprime, gprime, kprime, prime, estor, gstor", _STIFFNESS),
    "loss": ColumnQuantity(
        "loss, loss stiffness, loss modulus, loss shear modulus, verlustmodul, verluststeifigkeit, imaginary, imag,"
        "imaginary part, out of phase, quadrature, viscous modulus, viscous stiffness, viscous rate, k2, im,"
        "module de perte, 损耗模量, 損失弾性率, double prime, dprime, edoubleprime, gdoubleprime, eloss, gloss",
        _STIFFNESS),
    "loss_angle": ColumnQuantity(
        "loss angle, phase, phase angle, phase lag, phase shift, phase delay, delta, δ, verlustwinkel, phasenwinkel,"
        "phase difference, angle de perte, angle, phi, φ, 损耗角, 位相角, phasenverschiebung", _kinds("angle")),
    "tan_delta": ColumnQuantity(
        "tan delta, tan d, tand, tandelta, tan δ, tanδ, tan, loss factor, loss tangent, tan phi, tangent delta,"
        "verlustfaktor, facteur de perte, 损耗因子, 損失係数, tan loss angle", _kinds("strain")),
    "damping": ColumnQuantity(
        "damping, damping coefficient, damping constant, damping rate, dämpfung, dämpfungskonstante,"
        "dämpfungskoeffizient, viscous damping, c damping, amortissement, 阻尼, damping value",
        _kinds("damping", "rotational damping", "damping")),
    "storage_error": ColumnQuantity("", _STIFFNESS),
    "loss_error": ColumnQuantity("", _STIFFNESS),
    "": ColumnQuantity(
        "force amplitude, dynamic force, dyn force, kraftamplitude, dynamic load, stress amplitude, dynamic stress,"
        "force, kraft, stress, energy, energie, compliance, static stiffness, statische steifigkeit, static rate,"
        "tan delta ref, time, zeit, damping ratio, damping factor, viscosity, complex viscosity,"
        "complex compliance, set, index, nr, no, cycles, damping energy"),
}  # fmt: skip
