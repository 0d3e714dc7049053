"""The report of a study in a real browser: it renders, its pictures are visible, it fetches nothing."""

import pytest
from click.testing import CliRunner

from bushcli import cli

CASE = """
title = "tolerances & <b>words</b>"
[geometry]
shape = "plain"
inner_radius = 9.0
outer_radius = "18.0 +- 0.2"
length = "34.0 +- 0.4"
[mesh]
elements_across = 2
elements_along = 4
[material]
law = "yeoh"
bulk_modulus = 2000.0
[material.parameters]
C10 = 0.2087
C20 = -0.0108
C30 = 0.00074
[[load_cases]]
mode = "axial"
amplitude = 4.0
steps = 4
[[load_cases]]
mode = "torsional"
amplitude = 8.0
steps = 3
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A study by Saltelli's design with a law that fails, and limits."""
    pytest.importorskip("pyarrow")
    pytest.importorskip("SALib")
    place = tmp_path_factory.mktemp("study")
    (place / "case.toml").write_text(CASE)
    import sys

    run = sys.modules["bushcli.cli.run"]
    listen, run.listen = run.listen, lambda: None
    options = [
        "--vary",
        "hardness=60 +- 5",
        "--sampling",
        "saltelli",
        "--designs",
        "80",
        "--workers",
        "1",
        "-q",
    ]
    options += ["--limits", "axial.initial=120 +- 5 %"]
    try:
        done = CliRunner().invoke(
            cli.main, ["study", str(place / "case.toml"), *options, "-o", str(place / "out")]
        )
    finally:
        run.listen = listen
    assert done.exit_code == 0, done.output
    return place / "out"


@pytest.fixture
def page(browser, folder):
    with browser.page(folder / "report.html") as found:
        yield found


def test_the_page_renders_and_fetches_nothing(page):
    assert page.value("document.querySelector('h1').textContent") == "tolerances & <b>words</b>"
    headings = page.value("[...document.querySelectorAll('h2')].map(e => e.textContent)")
    assert headings[0].endswith("are within the limits of axial.initial")
    wanted = (
        "What matters",
        "Curves of all designs",
        "Answers against the varied keys",
        "Spread of the answers",
    )
    assert [heading for heading in wanted if heading not in headings] == []
    asked = [
        e["params"]["request"]["url"] for e in page.events if e.get("method") == "Network.requestWillBeSent"
    ]
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []
    assert [e for e in page.events if e.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded")] == []


def test_every_picture_is_drawn_within_the_page(page):
    kinds = page.value("[...document.querySelectorAll('.panels')].map(e => e.className.split(' ')[1])")
    assert kinds == ["tornado", "band", "band", "scatter", "histogram"]
    sizes = page.value(
        "[...document.querySelectorAll('.frame, figure img')].map(e => e.getBoundingClientRect())"
        ".map(({width, height, right}) => [width, height, right])"
    )
    assert all(width > 250 and height > 100 for width, height, _ in sizes)
    assert max(right for *_, right in sizes) <= page.value("document.documentElement.clientWidth")
    assert page.value("document.documentElement.scrollWidth <= document.documentElement.clientWidth")


def test_sobol_indices_and_the_yield_stand_in_the_tables(page):
    heads = page.value("[...document.querySelectorAll('thead')].map(e => e.textContent)")
    assert any("Sobol first" in head for head in heads)
    assert any("within" in head and "95 % interval" in head for head in heads)
    cells = page.value("[...document.querySelectorAll('td')].map(e => e.textContent)")
    assert "hardness" in cells
    assert "N mm/deg" in cells
