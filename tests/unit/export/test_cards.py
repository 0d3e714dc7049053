"""Material cards read back with each program's own formulas: the stress, the bulk modulus, relaxation and softening.

The readers below follow the manuals (named in each), not the writers: a card is split into its fields, and the energy
that the program computes from them is evaluated.
"""

import re
from dataclasses import dataclass, field, replace
from xml.etree import ElementTree

import numpy as np
import pytest

from bushcli.case import Material, load_case
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effect
from bushcli.effects.exported import OgdenRoxburgh
from bushcli.errors import InputError
from bushcli.export import Order, all_writers, unit_system, writer_for
from bushcli.export.rubber import ExportedRubber, rubber_of
from bushcli.export.units import SYSTEMS
from bushcli.simulate.dynamic import vibrate
from cases.stability import nominal_stress
from forms.law import law

CARDS = [name for name, one in all_writers().items() if one.kind == "card"]
LAWS = {
    "neo_hookean": {"C10": 0.5},
    "mooney_rivlin": {"C10": 0.4, "C01": 0.1},
    "yeoh": {"C10": 0.5, "C20": -0.05, "C30": 0.01},
    "ogden": {"mu1": 0.6, "alpha1": 1.3, "mu2": 0.005, "alpha2": 5.0, "mu3": -0.02, "alpha3": -2.0},
    "arruda_boyce": {"mu": 1.0, "lambda_m": 3.0},
    "gent": {"mu": 1.0, "Jm": 30.0},
}
BULK = 2000.0
SERIES = ((0.2, 10.0), (0.1, 0.5))
SOFTENING = OgdenRoxburgh(inverse_r=0.4, m=0.08, beta=0.15)
# Precision of a field of ten characters.
DIGITS = 2e-5


@dataclass
class Read:
    """The material that a program reads from a card, in the card's units."""

    energy: object
    bulk: float  # as the program uses it, after its own defaults
    series: list = field(default_factory=list)
    instantaneous: bool = False
    softening: tuple = ()
    further: list = field(default_factory=list)  # D2, D3

    def stress(self, stretch):
        """Nominal stress in uniaxial tension without change of volume."""
        h = 1e-5
        values = [self.energy(*_uniaxial(stretch + d)) for d in (-h, h)]
        return (values[1] - values[0]) / (2 * h)

    def shear_modulus(self):
        """Initial shear modulus of the law on the card: d2W/dshear2 of a pure shear stretch."""
        h = 1e-3
        return 2 * (self.energy(1 + h, 1 / (1 + h), 1.0) - self.energy(1, 1, 1)) / (2 * np.log1p(h)) ** 2

    def relaxation(self, time):
        """Shear modulus at small strain, this time after a step."""
        mu = self.shear_modulus()
        if self.instantaneous:  # shares of the law's modulus
            return mu * (1 - sum(a * (1 - np.exp(-time / tau)) for a, tau in self.series))
        return mu + sum(g * np.exp(-time / tau) for g, tau in self.series)  # moduli added to it


def _uniaxial(stretch):
    return stretch, stretch**-0.5, stretch**-0.5


def polynomial(C):
    """W = sum C_ij (I1 - 3)^i (I2 - 3)^j."""

    def energy(a, b, c):
        I1, I2 = a * a + b * b + c * c, a**-2 + b**-2 + c**-2
        return sum(value * (I1 - 3) ** i * (I2 - 3) ** j for (i, j), value in C.items())

    return energy


def powers(terms):
    """W = sum k (l1^alpha + l2^alpha + l3^alpha - 3), terms (k, alpha)."""
    return lambda *stretches: sum(k * (sum(s**alpha for s in stretches) - 3) for k, alpha in terms)


def chains(mu, links):
    """Five terms of Arruda and Boyce, N = links."""

    def energy(a, b, c):
        I = a * a + b * b + c * c  # noqa: E741
        return mu * (
            (I - 3) / 2
            + (I**2 - 9) / (20 * links)
            + 11 * (I**3 - 27) / (1050 * links**2)
            + 19 * (I**4 - 81) / (7000 * links**3)
            + 519 * (I**5 - 243) / (673750 * links**4)
        )

    return energy


def gent(mu, limit):
    return lambda a, b, c: -mu * limit / 2 * np.log(1 - (a * a + b * b + c * c - 3) / limit)


def abaqus(text):
    """Abaqus Analysis User's Guide; CalculiX has the same."""
    blocks = {}
    for line in text.splitlines():
        if line.startswith("*") and not line.startswith("**"):
            head = line.upper().replace(" ", "")
            blocks[head] = []
        elif not line.startswith("**"):
            blocks[head] += [float(x) for x in line.split(",")]
    head, numbers = next((h, n) for h, n in blocks.items() if h.startswith("*HYPERELASTIC"))
    if "NEOHOOKE" in head:
        energy, D = polynomial({(1, 0): numbers[0]}), numbers[1]
    elif "MOONEY" in head:
        energy, D = polynomial({(1, 0): numbers[0], (0, 1): numbers[1]}), numbers[2]
    elif "YEOH" in head:
        energy, D = polynomial({(i + 1, 0): numbers[i] for i in range(3)}), numbers[3]
    elif "OGDEN" in head:
        n = int(re.search(r"N=(\d)", head)[1])
        pairs = [(numbers[2 * i], numbers[2 * i + 1]) for i in range(n)]
        energy, D = powers([(2 * mu / a**2, a) for mu, a in pairs]), numbers[2 * n]
    else:
        energy, D = chains(numbers[0], numbers[1] ** 2), numbers[2]
    found = Read(energy, 2 / D if D else np.inf)
    found.further = numbers[-2:] if "YEOH" in head else numbers[2 * n + 1 :] if "OGDEN" in head else []
    prony = blocks.get("*VISCOELASTIC,TIME=PRONY", [])
    found.series = [(prony[i], prony[i + 2]) for i in range(0, len(prony), 3)]
    if found.series:
        # Shares refer to the instantaneous modulus, which follows from the given long-term one.
        assert "MODULI=LONGTERM" in head
        rest = 1 - sum(g for g, _ in found.series)
        mu = found.shear_modulus()
        found.series = [(g * mu / rest, tau) for g, tau in found.series]
    found.softening = tuple(blocks.get("*MULLINSEFFECT", ()))
    return found


def calculix(text):
    """hyperelastics.f of CalculiX: each D_i below 1e-10 becomes (0.1 / mu)^i, in any system of units."""
    found = abaqus(text)
    mu = found.shear_modulus()
    if 2 / found.bulk < 1e-10:
        found.bulk = 20 * mu
    found.further = [(0.1 / mu) ** i if D < 1e-10 else D for i, D in enumerate(found.further, start=2)]
    return found


def ansys(text):
    """Mechanical APDL Material Reference: TB,HYPER with TB,PRONY is the instantaneous law."""
    tables = {}
    for line in text.splitlines():
        parts = line.split(",")
        if parts[0] == "TB":
            table = tables[parts[1]] = (parts, [])
        elif parts[0] == "TBDATA":
            assert int(parts[1]) == len(table[1]) + 1
            table[1].extend(map(float, parts[2:]))
    parts, C = tables["HYPER"]
    option, n = parts[5], int(parts[4])
    energy, d = {
        "NEO": lambda: (polynomial({(1, 0): C[0] / 2}), C[1]),
        "MOONEY": lambda: (polynomial({(1, 0): C[0], (0, 1): C[1]}), C[2]),
        "YEOH": lambda: (polynomial({(i + 1, 0): C[i] for i in range(3)}), C[3]),
        "OGDEN": lambda: (powers([(C[2 * i] / C[2 * i + 1], C[2 * i + 1]) for i in range(n)]), C[2 * n]),
        "BOYCE": lambda: (chains(C[0], C[1] ** 2), C[2]),
        "GENT": lambda: (gent(C[0], C[1]), C[2]),
    }[option]()
    found = Read(energy, 2 / d)
    prony = tables.get("PRONY", (None, []))[1]
    found.series, found.instantaneous = [*zip(prony[::2], prony[1::2], strict=True)], bool(prony)
    found.softening = tuple(tables["CDM"][1]) if "CDM" in tables else ()
    return found


def lsdyna(text):
    """Keyword User's Manual, volume II: fields of ten characters; K follows from PR."""
    lines = [line for line in text.splitlines() if not line.startswith("$")]
    keyword, rows = lines[0], [[float(x or 0) for x in fields(line, 10)] for line in lines[2:]]
    if keyword.startswith("*MAT_127"):
        _, _, K, G, N = rows[0][:5]
        energy, rest = chains(G, N), rows[2:]
        return Read(energy, K, [(g, 1 / beta) for g, beta in rest])
    PR = rows[0][2]
    if keyword.startswith("*MAT_077_H"):
        C10, C01, C11, C20, C02, C30 = rows[1]
        C = {(1, 0): C10, (0, 1): C01, (1, 1): C11, (2, 0): C20, (0, 2): C02, (3, 0): C30}
        energy, mu, rest = polynomial(C), 2 * (C10 + C01), rows[2:]
    else:
        pairs = [(mu, alpha) for mu, alpha in zip(rows[1], rows[2], strict=True) if alpha]
        energy, rest = powers([(mu / alpha, alpha) for mu, alpha in pairs]), rows[3:]
        mu = sum(mu * alpha for mu, alpha in pairs) / 2
    return Read(energy, 2 * mu * (1 + PR) / (3 * (1 - 2 * PR)), [(g, 1 / beta) for g, beta in rest])


def radioss(text):
    """Radioss Reference Guide: fields of twenty characters; no comment counts as a line, an empty one does."""
    blocks, current = {}, None
    for line in text.splitlines():
        if line.startswith("/"):
            current = blocks[line.rsplit("/", 1)[0]] = []
        elif not line.startswith("#"):
            current.append(line)
    head, lines = next((h, b) for h, b in blocks.items() if h.startswith("/MAT/"))
    series = []

    def real(number):
        return [float(x) for x in fields(lines[number], 20)]

    if head == "/MAT/LAW42":
        nu, terms = float(lines[2][:20]), [(m, a) for m, a in zip(real(3), real(5), strict=True) if a]
        assert lines[4] == lines[6] == ""
        count = int(lines[2][80:90])
        assert lines[2][40:60].split() == ["0"]
        energy = powers([(m / a, a) for m, a in terms])
        mu = sum(m * a for m, a in terms) / 2
        nu = nu or 0.495  # hm_read_mat42.F
        bulk = 2 * mu * (1 + nu) / (3 * (1 - 2 * nu))
        series = [*zip(real(7)[:count], real(8)[:count], strict=True)] if count else []
    elif head == "/MAT/LAW94":
        assert lines[2] == ""
        energy, bulk = polynomial({(i + 1, 0): real(3)[i] for i in range(3)}), 2 / real(4)[0]
    elif head == "/MAT/LAW92":
        mu, D, stretch = real(2)
        energy, bulk = chains(mu, stretch**2), 2 / D
        visc = blocks.get("/VISC/PRONY", [])
        for line in visc[1:]:
            G, beta, K, _ = (float(x) for x in fields(line, 20))
            assert K == 0
            series.append((G, 1 / beta))
        assert not visc or int(visc[0][:10]) == len(series)
    else:
        assert head == "/MAT/LAW100"
        flags, C = [int(x) for x in fields(lines[2], 10)], real(3)
        names = {3: [(1, 0)], 4: [(1, 0), (0, 1)], 5: [(1, 0), (2, 0), (3, 0)]}[flags[1]]
        energy, bulk = polynomial(dict(zip(names, C, strict=False))), 2 / C[len(names)]
    soft = (
        [float(x) for x in fields(blocks["/FAIL/MULLINS_OR"][0], 20)] if "/FAIL/MULLINS_OR" in blocks else []
    )
    return Read(energy, bulk, series, softening=(soft[0], soft[2], soft[1]) if soft else ())


def febio(text):
    """FEBio User Manual; its Yeoh and Gent as in FEYeoh.cpp and FEGentMaterial.cpp."""
    material = ElementTree.fromstring(text.encode()).find("Material/material")
    bulk = float(material.find("k").text)
    elastic = material.find("elastic") if material.get("type") == "uncoupled viscoelastic" else material
    values = {one.tag: float(one.text) for one in elastic if one.tag != "elastic"}
    kind = elastic.get("type")
    if kind == "Mooney-Rivlin":
        energy = polynomial({(1, 0): values["c1"], (0, 1): values["c2"]})
    elif kind == "Yeoh":
        energy = polynomial({(i, 0): values[f"c{i}"] for i in (1, 2, 3)})
    elif kind == "Ogden":
        numbers = [name[1:] for name in values if name.startswith("m")]
        energy = powers([(values[f"c{i}"] / values[f"m{i}"] ** 2, values[f"m{i}"]) for i in numbers])
    elif kind == "Arruda-Boyce":
        energy = chains(values["mu"], values["N"])
    else:
        energy = gent(values["G"], values["Jm"])
    found = Read(energy, bulk)
    if elastic is not material:
        # G(t) = g0 + sum g_i exp(-t/t_i), g0 = 1 unless given.
        mu = found.shear_modulus()
        outer = {one.tag: float(one.text) for one in material if one.tag != "elastic"}
        assert "g0" not in outer
        count = sum(tag.startswith("g") for tag in outer)
        found.series = [(mu * outer[f"g{i}"], outer[f"t{i}"]) for i in range(1, count + 1)]
    return found


#: Commands of Mentat that set a material, in the order and form of public scripts.
MENTAT = (
    r"\*new_mater standard",
    r"\*mater_option general:state:solid",
    r"\*mater_option general:skip_structural:off",
    r"\*mater_name [A-Za-z]\w*",
)
MENTAT_LAW = re.compile(
    r"\*mater_option structural:(type:(mooney|ogden)|mooney_model:five_term)"
    r"|\*mater_param (structural:(mooney_c(10|01|11|20|30)|ogden_(nterm|(modulus|exp)_[1-6]))|general:mass_density)"
    r" [-+.\de]+"
)


def marc(text):
    """Marc, volume A: some constants are set by commands, the others are to be entered under the manual's names."""
    lines = text.splitlines()
    commands = [line for line in lines if not line.startswith("|")]
    for line, form in zip(commands, MENTAT, strict=False):
        assert re.fullmatch(form, line), line
    assert all(MENTAT_LAW.fullmatch(line) for line in commands[4:]), commands
    values = {}
    for line in commands[4:]:
        key, _, value = line.partition(" ")[2].partition(" ")
        if value:
            values[key.partition(":")[2]] = float(value)
    typed = dict(
        [part.strip() for part in line[1:].split(" = ")]
        for line in lines[lines.index(commands[-1]) :]
        if line.startswith("| ") and " = " in line
    )
    assert commands[3].endswith("_incomplete") == bool(typed)
    number = {name: float(value) for name, value in typed.items() if re.fullmatch(r"[-+.\de]+", value)}
    if "*mater_option structural:type:mooney" in commands:
        assert "*mater_option structural:mooney_model:five_term" in commands
        places = {"c10": (1, 0), "c01": (0, 1), "c11": (1, 1), "c20": (2, 0), "c30": (3, 0)}
        energy = polynomial({at: values[f"mooney_{name}"] for name, at in places.items()})
    elif "*mater_option structural:type:ogden" in commands:
        count = int(values["ogden_nterm"])
        pairs = [(values[f"ogden_modulus_{i}"], values[f"ogden_exp_{i}"]) for i in range(1, count + 1)]
        energy = powers([(mu / alpha, alpha) for mu, alpha in pairs])
    elif typed["model"] == "ARRUDBOYCE":
        energy = chains(number["nkT"], number["N"])
    else:
        assert typed["model"] == "GENT"
        energy = gent(number["E"] / 3, number["Im"])
    found = Read(energy, number["bulk modulus"])
    for i in (1, 2, 3):
        if f"term {i}: deviatoric multiplier" in number:
            time = number[f"term {i}: deviatoric relaxation time"]
            found.series.append((number[f"term {i}: deviatoric multiplier"], time))
    found.instantaneous = bool(found.series)
    return found


def fields(line, width):
    return [line[i : i + width].strip() for i in range(0, len(line.rstrip()), width)]


READERS = {
    "abaqus": abaqus,
    "calculix": calculix,
    "ansys": ansys,
    "lsdyna": lsdyna,
    "radioss": radioss,
    "febio": febio,
    "marc": marc,
}


def written(program, rubber, units="N-mm-s", form="time-prony"):
    one = writer_for(program)
    one.check(rubber, form)
    order = Order("A rubber, 60 ShA", "case.toml", unit_system(units), rubber, form=form)
    return one.text(order).decode("ascii")


def rubber_with(name, **further):
    called = {"series": ("viscoelasticity",), "softening": ("mullins",)}
    effects = {part: called[part] for part in further if part in called}
    return ExportedRubber(name, LAWS[name], BULK, effects=effects, **further)


def allowed(program):
    return [(program, name) for name in LAWS if name in writer_for(program).laws]


@pytest.mark.parametrize("units", ["N-mm-s", "SI", "kN-mm-ms", "lbf-in-s"])
@pytest.mark.parametrize(("program", "name"), [pair for program in CARDS for pair in allowed(program)])
def test_a_card_has_the_stress_of_the_law(program, name, units):
    read = READERS[program](written(program, rubber_with(name), units))
    stretches = np.array([0.6, 0.9, 1.2, 1.8, 2.4])
    expected = nominal_stress(law(name), LAWS[name], "uniaxial", stretches)
    pascal = unit_system(units).force / unit_system(units).length ** 2
    found = np.array([read.stress(stretch) for stretch in stretches]) * pascal / 1e6
    assert found == pytest.approx(expected, rel=DIGITS)
    # A card without a field for the bulk modulus has Poisson's ratio to eight digits.
    assert read.bulk * pascal / 1e6 == pytest.approx(BULK, rel=1e-4)


@pytest.mark.parametrize("units", SYSTEMS)
@pytest.mark.parametrize(("program", "name"), [pair for program in CARDS for pair in allowed(program)])
def test_no_number_is_one_that_the_program_replaces(program, name, units):
    """In all units, for all bulk moduli: the program uses that of the rubber, or the card is refused."""
    written_once = False
    shear = ExportedRubber(name, LAWS[name], BULK).shear_modulus
    for bulk in (2.0 / 3.0 * shear, 1.0, 1000.0, 3000.0, 1e5, 1e9, 1e290):
        one = unit_system(units)
        try:
            read = READERS[program](written(program, ExportedRubber(name, LAWS[name], bulk), units))
        except InputError:
            assert not 1.0 <= bulk <= 3000.0
            continue
        written_once = True
        assert one.of_stress(bulk) == pytest.approx(read.bulk, rel=0.01)
        if program == "calculix":
            # The pressure of the further terms 1/D_i (J - 1)^(2 i) at J = 0.995, beside that of the first.
            further = sum(2 * i / D * 0.005 ** (2 * i - 1) for i, D in enumerate(read.further, start=2))
            assert further < 1e-6 * read.bulk * 0.005
    assert written_once


def test_mullins_of_ansys_refers_to_the_energy_of_the_instantaneous_law():
    read = ansys(written("ansys", rubber_with("yeoh", series=SERIES, softening=SOFTENING)))
    # The law is stiffer by 1 + sum g, and so are the energies that m is compared with.
    assert read.softening == pytest.approx((1 / 0.4, 1.3 * 0.08, 0.15))
    long_term = abaqus(written("abaqus", rubber_with("yeoh", series=SERIES, softening=SOFTENING)))
    assert long_term.softening == pytest.approx((1 / 0.4, 0.08, 0.15))


@pytest.mark.parametrize("units", ["N-mm-s", "kN-mm-ms"])
@pytest.mark.parametrize(
    ("program", "name"),
    [
        (program, name)
        for program in CARDS
        for program, name in allowed(program)
        if writer_for(program).series and name in (writer_for(program).series_laws or LAWS)
    ],
)
def test_a_card_relaxes_as_the_rubber(program, name, units):
    rubber = rubber_with(name, series=SERIES)
    read = READERS[program](written(program, rubber, units))
    system = unit_system(units)
    for seconds in (0.0, 0.3, 4.0, 20.0, 1e4):
        expected = rubber.shear_modulus * (1 + sum(g * np.exp(-seconds / tau) for g, tau in SERIES))
        found = read.relaxation(system.of_time(seconds))
        # The modulus of the law is a difference of energies over a shear of 0.2 %.
        assert found == pytest.approx(system.of_stress(expected), rel=1e-4), seconds


@pytest.mark.parametrize(
    ("program", "name"),
    [
        (program, name)
        for program in CARDS
        for program, name in allowed(program)
        if writer_for(program).softening and name in (writer_for(program).softening_laws or LAWS)
    ],
)
def test_a_card_softens_as_the_rubber(program, name):
    read = READERS[program](written(program, rubber_with(name, softening=SOFTENING), "SI"))
    r, m, beta = read.softening
    assert (r, m, beta) == pytest.approx((1 / 0.4, 0.08e6, 0.15), rel=DIGITS)
    # The stress again, because Radioss has another material model where there is softening.
    stress = nominal_stress(law(name), LAWS[name], "uniaxial", 1.7)
    assert read.stress(1.7) == pytest.approx(1e6 * float(stress), rel=DIGITS)


@pytest.mark.parametrize(
    ("program", "rubber", "words"),
    [
        ("abaqus", rubber_with("gent"), "Abaqus has no gent law"),
        ("calculix", rubber_with("yeoh", series=SERIES), "no model for the effect viscoelasticity"),
        ("calculix", rubber_with("yeoh", softening=SOFTENING), "no model for the effect mullins"),
        ("calculix", ExportedRubber("yeoh", LAWS["yeoh"], np.inf), "an exactly incompressible rubber"),
        ("radioss", rubber_with("yeoh", series=SERIES), "not with yeoh"),
        ("radioss", rubber_with("ogden", softening=SOFTENING), "not with ogden"),
        ("febio", rubber_with("ogden", softening=SOFTENING), "FEBio has no model for the effect mullins"),
        ("lsdyna", rubber_with("yeoh", softening=SOFTENING), "LS-DYNA has no model for the effect mullins"),
        ("abaqus", rubber_with("yeoh", inexpressible=("friction",)), "cannot express the effect friction"),
    ],
)
def test_what_a_program_cannot_express_is_refused_by_name(program, rubber, words):
    with pytest.raises(InputError, match=words):
        writer_for(program).check(rubber)


def abaqus_modulus(text, frequencies):
    """G* of an Abaqus card over its long-term modulus, at frequencies in cycles per unit of time (Frequency domain
    viscoelasticity: Gs = Ginf (1 - omega Im g*), Gl = Ginf omega Re g*; Prony: shares of G0, Ginf = G0 (1 - sum g))."""
    head, _, rows = text.partition("*VISCOELASTIC, FREQUENCY=")[2].partition("\n")
    numbers = np.array([[float(x) for x in row.split(",")] for row in rows.splitlines() if row[0] != "*"])
    if head == "TABULAR":
        assert (numbers[:, 2:4] == 0.0).all()  # no loss of the bulk modulus
        at = np.log(numbers[:, 4])
        loss, storage = (np.interp(np.log(frequencies), at, numbers[:, i]) for i in (0, 1))
        return 1.0 - storage + 1j * loss
    assert head == "PRONY"
    shares, taus = numbers[:, 0], numbers[:, 2]
    turned = 2j * np.pi * np.outer(frequencies, taus)
    instantaneous = 1.0 / (1.0 - shares.sum())
    return 1.0 + instantaneous * (shares * turned / (1.0 + turned)).sum(axis=1)


COUPON = """
[geometry]
shape = "coupon"
[material]
law = "yeoh"
parameters = { C10 = 0.5, C20 = -0.05, C30 = 0.01 }
[[effects]]
name = "viscoelasticity"
parameters = { g1 = 0.2, tau1 = 10.0, g2 = 0.1, tau2 = 0.5, g3 = 0.4, tau3 = 0.003 }
[[load_cases]]
mode = "uniaxial"
[load_cases.dynamic]
frequency = { from = 1e-4, to = 1e3, points = 57 }
"""


@pytest.mark.parametrize("units", ["N-mm-s", "kN-mm-ms"])
@pytest.mark.parametrize("form", ["frequency-prony", "frequency-tabular"])
def test_abaqus_vibrates_as_a_coupon_does(tmp_path, form, units):
    """E* = 3 G* of the card is that of `bushcli dynamic` within 0.1 %, also between the rows and beyond the table."""
    file = tmp_path / "case.toml"
    file.write_text(COUPON)
    case = load_case(file)
    (curve,) = vibrate(case).curves
    text = written("abaqus", rubber_of(case.material, case.effects), units, form)
    assert "MODULI=LONG TERM" in text
    found = 3 * abaqus(text).shear_modulus() * abaqus_modulus(text, curve.frequency * unit_system(units).time)
    pascal = unit_system(units).force / unit_system(units).length ** 2
    assert np.abs(found * pascal / 1e6 / curve.stiffness - 1).max() < 1e-3


def test_a_form_is_refused_by_programs_without_it_and_without_viscoelasticity():
    with pytest.raises(InputError, match=r"Ansys.* frequency-prony.*it is for abaqus"):
        writer_for("ansys").check_form("frequency-prony")
    with pytest.raises(InputError, match=r'did you mean "frequency-tabular"'):
        writer_for("abaqus").check_form("frequency-table")
    with pytest.raises(InputError, match="a rubber without viscoelasticity has no frequency-prony form"):
        written("abaqus", rubber_with("yeoh"), form="frequency-prony")


def test_radioss_takes_no_series_beside_softening_but_with_arruda_boyce():
    with pytest.raises(InputError, match="--without viscoelasticity"):
        written("radioss", rubber_with("neo_hookean", series=SERIES, softening=SOFTENING))
    read = radioss(written("radioss", rubber_with("arruda_boyce", series=SERIES, softening=SOFTENING)))
    assert len(read.series) == 2
    assert read.softening


def test_an_incompressible_rubber_has_no_compliance():
    rubber = ExportedRubber("yeoh", LAWS["yeoh"], np.inf)
    assert "0.5, -0.05, 0.01, 0, 0, 0" in written("abaqus", rubber)


@pytest.mark.parametrize(
    ("program", "feature", "rubber"),
    [
        ("abaqus", "incompressible", {"bulk_modulus": np.inf}),
        ("ansys", "incompressible", {"bulk_modulus": np.inf}),
        ("ansys", "series", {"series": SERIES}),
        ("lsdyna", "series", {"series": SERIES}),
        ("lsdyna", "arruda_boyce", {"law": "arruda_boyce", "parameters": LAWS["arruda_boyce"]}),
        ("marc", "series", {"series": SERIES}),
    ],
)
def test_a_card_has_only_the_remarks_that_apply(program, feature, rubber):
    remark = writer_for(program).remarks_on[feature]
    assert remark not in written(program, rubber_with("neo_hookean"))
    assert remark in written(program, replace(rubber_with("neo_hookean"), **rubber))


def test_a_title_cannot_break_a_card():
    order = Order("-- *END <b> 3%", "case.toml", unit_system("SI"), rubber_with("yeoh"))
    for program in CARDS:
        text = writer_for(program).text(order).decode("ascii")
        assert READERS[program](text).bulk == pytest.approx(BULK * 1e6, rel=1e-4)
        assert order.name == "END__b__3"


def test_a_title_keeps_its_letters():
    title = "Lager Größe 1, Élan, Čačak, Ø 22, −5 °C"
    order = Order(title, "case.toml", unit_system("SI"), rubber_with("yeoh"))
    assert order.name == "Lager_Groesse_1__Elan__Cacak__Oe_22___5"
    assert b"Lager Groesse 1, Elan, Cacak, Oe 22, -5 ?C" in writer_for("abaqus").text(order)
    # Signs that Unicode decomposes to < and - stay out of the comment of an XML file.
    order = replace(order, title="\u2013\u2013\uff1e \u226e")
    assert ElementTree.fromstring(writer_for("febio").text(order)) is not None


def test_effects_of_the_rubber_go_into_the_card():
    active = [
        ActiveEffect(effect("batch_stiffness"), {"log_factor": np.log(1.5)}),
        ActiveEffect(effect("compressibility"), {"compliance": 5e-4}),
        ActiveEffect(effect("viscoelasticity"), {"g1": 0.2, "tau1": 3.0, "g2": 0.0, "tau2": 1.0}),
        ActiveEffect(effect("mullins"), {"inverse_r": 0.5, "m": 0.1, "beta": 0.1}),
        ActiveEffect(effect("friction"), {"g": 0.0, "slip": 0.1}),
        ActiveEffect(effect("swaging"), {"reduction": 0.2}),
    ]
    found = rubber_of(Material("yeoh", BULK, LAWS["yeoh"]), active)
    assert found.parameters == pytest.approx({"C10": 0.75, "C20": -0.075, "C30": 0.015})
    # 1/kappa is 1/2000 + 1/2000; another batch is stiffer in volume too.
    assert found.bulk_modulus == pytest.approx(1500.0)
    assert found.series == ((0.2, 3.0),)
    assert found.softening == OgdenRoxburgh(0.5, pytest.approx(0.15), 0.1)
    assert found.inexpressible == ()
    assert found.beside == ("swaging",)


def test_a_rate_that_grows_with_stress_is_no_series():
    active = ActiveEffect(effect("viscoelasticity"), {"g1": 0.2, "tau1": 3.0, "exponent": 3.0})
    found = rubber_of(Material("yeoh", BULK, LAWS["yeoh"]), [active])
    assert found.series == ()
    assert found.inexpressible == ("viscoelasticity",)
    with pytest.raises(InputError, match="cannot express the effect viscoelasticity"):
        written("abaqus", found)
    with pytest.raises(InputError, match="leave exponent out"):
        written("abaqus", found, form="frequency-prony")
