"""Files of binary formats read in the tests' own process."""

from __future__ import annotations

import io
import json
import warnings

import pytest

from bushcli.recording import isolated


@pytest.fixture
def in_this_process(monkeypatch):
    """Read files in this process, with the code of the child, which takes a second to load the library.

    For tests of contents; `test_formats.py` and `test_hostile_files.py` test the child with each format.
    """

    def asked(path, reader, format_name, wanted):
        output = io.BytesIO()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            isolated.copy_contents(format_name, path, json.loads(json.dumps(list(wanted))), output)
        return output.getvalue()

    monkeypatch.setattr(isolated, "child_output", asked)
