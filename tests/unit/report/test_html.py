"""The page: complete, escaped, and silent on the network."""

import base64
import hashlib
import html.parser
import re

import pytest

from bushcli.report.drawing.results import direct_pictures, pictures_of
from bushcli.report.json.direct import direct_json
from bushcli.report.json.fit import fit_json
from bushcli.report.plots.fit import fit_panels
from bushcli.report.results import FitResult
from bushcli.report.views.direct import direct_document
from bushcli.report.views.fit import fit_document
from bushcli.report.writers.page import page as page_of


@pytest.fixture
def page(answer, channel):
    def make(title="a bushing", fit=None, **changes):
        found = answer(channel("axial", 645.0, 363.0, **changes), title=title, fit=fit)
        result = direct_json(found) | {"timings_s": {"total": 1.0}}
        names = {c.name: "axial" for c in found.response.channels}
        pictures = pictures_of(direct_pictures(found, names))
        return page_of(direct_document(found), result, pictures)

    return make


class Tags(html.parser.HTMLParser):
    """Collect start tags, and check that every tag is closed."""

    VOID = frozenset({"meta", "img", "br"})

    def __init__(self, text):
        super().__init__()
        self.found, self.open = [], []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.mark.slow
def test_the_page_has_all_that_an_engineer_asks_for(page, fit):
    text = page(fit=fit)
    for words in (
        "Too stiff: axial outside the accepted 10 %",
        "78 % too stiff",
        "inner radius 9 mm",
        "Law identified from 3 coupon tests",
        "C20 lies on its bound",
        "choose another law",
        "dolfinx",
        "total 1.00 s",
    ):
        assert words in text
    tags = Tags(text).found
    # Bodies are pictures; curves and coupons are plots.
    assert sum(tag == "img" for tag, _ in tags) == 2
    assert sum("plot" in attrs.get("class", "").split() for tag, attrs in tags if tag == "figure") == 5


def test_the_page_fetches_and_runs_nothing(page):
    text = page()
    tags = Tags(text).found
    # Its own script, whose digest is in the content policy.
    (script,) = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert html.unescape(text).count(f"script-src 'sha256-{digest}'") == 1
    assert not {tag for tag, _ in tags} & {"link", "iframe", "object", "embed", "a", "base", "form"}
    sources = [attrs["src"] for _, attrs in tags if "src" in attrs]
    assert sources
    assert all(source.startswith("data:image/") for source in sources)
    assert not any(name.startswith("on") for _, attrs in tags for name in attrs)
    style = re.search(r"<style>(.*?)</style>", text, re.DOTALL)
    assert style is not None
    assert "url(" not in style[1]
    assert "@import" not in style[1]


def test_titles_and_names_are_escaped(page):
    title = '<script>alert("1")</script> & {{ title }} $x$'
    text = page(title, name="<img src=x onerror=alert(1)>", surface=None)
    assert "<script>alert" not in text
    assert "<img src=x" not in text
    assert "&lt;script&gt;" in text
    assert "{{ title }}" in text
    Tags(text)


def test_a_fit_has_a_page(case, fit):
    found = FitResult(case(), fit)
    text = page_of(fit_document(found), fit_json(found), pictures_of([fit_panels(fit)]))
    assert "yeoh fits 3 coupon tests to 20.0 % rms or better" in text
    Tags(text)
