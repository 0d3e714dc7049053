"""The report of a diagnosis in a real browser: it renders, its plots are visible and zoom, it fetches nothing."""

import base64
import io
import re
import time

import numpy as np
import pytest
from matplotlib import image

from bushcli import report
from bushcli.case import load_case
from bushcli.report.writers.files import write


@pytest.fixture(scope="module")
def folder(tmp_path_factory, diagnoses):
    """Results of a diagnosis of two channels, with rivals, a map, and the recommended next recording."""
    place = tmp_path_factory.mktemp("case")
    (place / "axial.csv").write_text(
        "displacement_mm,force_N\n" + "".join(f"{q},{100 * q}\n" for q in range(6))
    )
    (place / "case.toml").write_text(diagnoses.CASE)
    found = diagnoses.rivalling(load_case(place / "case.toml"))
    result, files = report.as_json(found), report.as_files(found)
    write(place / "out", result, files, lambda: report.as_document(found))
    return place / "out"


@pytest.fixture
def page(browser, folder):
    with browser.page(folder / "report.html") as found:
        yield found


def seen(page, plot="axial-diagnosis-curve-0"):
    return [
        float(v)
        for v in page.value(f"document.querySelector('#{plot} .pane').getAttribute('viewBox')").split()
    ]


def clicked(page, selector):
    page.value(f"document.querySelector('{selector}').click()")


def middle(page, plot="axial-diagnosis-curve-0"):
    """Centre of a plot's pane on the screen."""
    return page.value(
        f"(() => {{ const e = document.querySelector('#{plot} .edge'); e.scrollIntoView({{block: 'center'}});"
        " const b = e.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()"
    )


def mouse(page, kind, x, y, **more):
    page.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)


def at_rest(page):
    """Wait until the page has stopped scrolling."""
    places = [float("nan")]
    while places[-3:].count(places[-1]) < 3:
        time.sleep(0.1)
        places.append(page.value("scrollY"))


def test_it_renders_without_an_error_and_asks_the_network_for_nothing(page, folder):
    assert page.troubles() == []
    asked = page.requests()
    assert asked[0] == (folder / "report.html").as_uri()
    assert all(address.startswith("data:image/") for address in asked[1:])
    assert page.value("[...document.images].every((i) => i.complete && i.naturalWidth > 100)")
    # A map in the bushing; all else is drawn by plots.
    assert page.value("document.images.length") == 1
    assert page.value("document.documentElement.scrollWidth <= innerWidth")


def test_every_channel_has_its_plots_with_all_lines(page):
    for plot, lines in (
        ("axial-diagnosis-curve-0", 3),
        ("radial-diagnosis-curve-1", 3),
        ("axial-diagnosis-misfit-0", 2),
        ("radial-diagnosis-misfit-1", 2),
    ):
        paths = f"[...document.querySelectorAll('#{plot} .pane path.line')]"
        assert page.value(f"{paths}.length") == lines
        # At least as long as the plot is wide: no line is collapsed.
        assert page.value(f"{paths}.every((p) => p.getTotalLength() > 700)")
    assert page.value("document.querySelectorAll('.region[data-number]').length") == 2 * page.value(
        "document.querySelectorAll('#axial-diagnosis-curve-0 .place, #radial-diagnosis-curve-1 .place').length"
    )


def test_buttons_zoom_about_the_middle_and_back(page):
    x, y, w, h = seen(page)
    before = page.value("document.querySelector('#axial-diagnosis-curve-0 .grid').textContent")
    clicked(page, '#axial-diagnosis-curve-0 [data-zoom="in"]')
    closer = seen(page)
    assert closer == pytest.approx([x + 0.2 * w, y + 0.2 * h, 0.6 * w, 0.6 * h])
    assert page.value("document.querySelector('#axial-diagnosis-curve-0 .grid').textContent") != before
    clicked(page, '#axial-diagnosis-curve-0 [data-zoom="all"]')
    assert seen(page) == [x, y, w, h]
    # The script draws the grid as Python did.
    assert page.value("document.querySelector('#axial-diagnosis-curve-0 .grid').textContent") == before


def test_a_place_fills_the_view_when_its_number_is_clicked(page):
    _, _, w, h = seen(page)
    clicked(page, "#axial-diagnosis-curve-0 .place")
    at = seen(page)
    assert at[2] < 0.8 * w
    assert at[3] < 0.9 * h
    box = page.value(
        "(({x, width}) => [x, width])(document.querySelector('#axial-diagnosis-curve-0 .region').getBBox())"
    )
    assert at[0] < box[0]
    assert at[0] + at[2] > box[0] + box[1]


def test_wheel_and_drag_act_where_the_pointer_is(page):
    x, y, w, h = seen(page)
    px, py = middle(page)
    mouse(page, "mouseWheel", px, py, deltaX=0, deltaY=-400)
    assert seen(page) == [x, y, w, h]  # the page scrolls until the plot has been chosen
    at_rest(page)
    px, py = middle(page)
    mouse(page, "mousePressed", px, py, button="left", clickCount=1)
    mouse(page, "mouseReleased", px, py, button="left", clickCount=1)
    mouse(page, "mouseWheel", px, py, deltaX=0, deltaY=-400)
    # 1.0015 ** -400 = 0.549
    assert seen(page)[2] == pytest.approx(0.549 * w, rel=0.01)
    before = seen(page)
    mouse(page, "mousePressed", px, py, button="left", clickCount=1)
    mouse(page, "mouseMoved", px + 60, py, button="left", buttons=1)
    mouse(page, "mouseReleased", px + 60, py, button="left", clickCount=1)
    # The curve follows the pointer, so that the view moves the opposite way.
    assert seen(page)[0] < before[0] - 10
    assert seen(page)[1:] == pytest.approx(before[1:], abs=1.0)
    assert page.troubles() == []


def test_a_line_can_be_hidden(page):
    shown = "getComputedStyle(document.querySelector('#axial-diagnosis-curve-0 path.as-before')).display"
    assert page.value(shown) != "none"
    clicked(page, '#axial-diagnosis-curve-0 [data-key="as-before"]')
    assert page.value(shown) == "none"
    assert (
        page.value(
            "document.querySelector('#axial-diagnosis-curve-0 [data-key=as-before]').getAttribute('aria-pressed')"
        )
        == "false"
    )
    clicked(page, '#axial-diagnosis-curve-0 [data-key="as-before"]')
    assert page.value(shown) != "none"


def test_dark_mode_is_dark(browser, folder):
    with browser.page(folder / "report.html", dark=True) as page:
        colour = page.value("getComputedStyle(document.body).backgroundColor")
        assert max(int(v) for v in re.findall(r"\d+", colour)) < 60


def test_what_is_drawn_is_seen_on_the_screen(page):
    """Pixels of the plot's own colours, in a picture of the page."""
    middle(page)
    rectangle = page.value(
        "(({x, y, width, height}) => ({x: x + scrollX, y: y + scrollY, width, height, scale: 1}))"
        "(document.querySelector('#axial-diagnosis-curve-0 .edge').getBoundingClientRect())"
    )
    reply = page.call("Page.captureScreenshot", format="png", clip=rectangle, captureBeyondViewport=True)
    pixels = image.imread(io.BytesIO(base64.b64decode(reply["data"])))[..., :3]
    for colour in ((0xE6, 0x9F, 0x00), (0x94, 0x9C, 0xA5)):  # plain law, recording
        near = np.abs(pixels - np.array(colour) / 255).max(axis=-1) < 0.12
        assert near.sum() > 200
