"""FEBio: a file with one uncoupled material, viscoelastic if the rubber is.

The energies equal bushcli's except Ogden's: sum c_i/m_i^2 (l1^m_i + l2^m_i + l3^m_i - 3), so c_i = mu_i alpha_i.
Arruda-Boyce has N = lambda_m^2. The volumetric energy is k/2 (ln J)^2 instead of k/2 (J - 1)^2, which is the same at
small volume changes. The law is the long-term law (g0 = 1); the coefficients of "uncoupled viscoelastic" are bushcli's
g_i.
"""

from __future__ import annotations

from xml.etree import ElementTree

from bushcli.export.card import ogden_terms, rubber, stresses
from bushcli.export.writer import Order, Writer

LAWS = {
    "neo_hookean": "Mooney-Rivlin",
    "mooney_rivlin": "Mooney-Rivlin",
    "yeoh": "Yeoh",
    "ogden": "Ogden",
    "arruda_boyce": "Arruda-Boyce",
    "gent": "Gent",
}


def write(order: Order) -> str:
    """Return the file with the material as number 1."""
    material, units = rubber(order), order.units
    root = ElementTree.Element("febio_spec", version="4.0")
    ElementTree.SubElement(root, "Module", type="solid")
    element = ElementTree.SubElement(ElementTree.SubElement(root, "Material"), "material", id="1")
    element.set("name", order.name)
    _number(element, "density", units.of_density(material.density))
    elastic = element
    if material.series:
        element.set("type", "uncoupled viscoelastic")
        for i, (g, tau) in enumerate(material.series, start=1):
            _number(element, f"g{i}", g)
            _number(element, f"t{i}", units.of_time(tau))
        elastic = ElementTree.SubElement(element, "elastic")
    elastic.set("type", LAWS[material.law])
    values = stresses(order)
    if material.law in ("neo_hookean", "mooney_rivlin"):
        constants = {"c1": values["C10"], "c2": values.get("C01", 0.0)}
    elif material.law == "yeoh":
        constants = {"c1": values["C10"], "c2": values["C20"], "c3": values["C30"]}
    elif material.law == "ogden":
        numbered = list(enumerate(ogden_terms(values), start=1))
        constants = {f"c{i}": mu * alpha for i, (mu, alpha) in numbered} | {
            f"m{i}": a for i, (_, a) in numbered
        }
    elif material.law == "arruda_boyce":
        constants = {"mu": values["mu"], "N": values["lambda_m"] ** 2}
    else:
        constants = {"G": values["mu"], "Jm": values["Jm"]}
    for name, value in constants.items():
        _number(elastic, name, value)
    # FEBio expects the bulk modulus of the whole material in the outer material.
    _number(element, "k", units.of_stress(material.bulk_modulus))
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="ISO-8859-1"?>\n' + ElementTree.tostring(root, encoding="unicode")


def _number(parent: ElementTree.Element, name: str, value: float) -> None:
    ElementTree.SubElement(parent, name).text = f"{value:.10g}"


WRITER = Writer(
    name="febio",
    title="FEBio",
    kind="card",
    ending=".feb",
    comment=("<!--", " -->"),
    write=write,
    laws=LAWS,
    series="uncoupled viscoelastic",
    incompressible=False,
    remarks=("the volumetric energy is k/2 (ln J)^2",),
    source="FEBio User Manual: uncoupled materials, uncoupled viscoelastic; FEBio source, FEYeoh, FEGentMaterial",
)
