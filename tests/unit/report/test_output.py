"""The folder of results: its contents, and files that are not touched."""

import json

import numpy as np
import pytest

from bushcli.errors import InputError
from bushcli.recording import read_recording
from bushcli.recording.source import Source
from bushcli.report.json.direct import direct_json
from bushcli.report.json.fit import fit_json
from bushcli.report.results import FitResult, MeshResult
from bushcli.report.views.direct import direct_document
from bushcli.report.views.fit import fit_document
from bushcli.report.writers.files import check_output, direct_files, fit_files, mesh_files, write
from bushcli.report.writers.folder import NotDrawn
from bushcli.runtime.names import file_names
from bushcli.simulate.meshes import Meshed


@pytest.fixture
def written_direct(answer, channel):
    def make(folder, *channels):
        # A channel without a surface is drawn in a third of the time.
        found = answer(*(channels or (channel("axial", 130.0, 100.0, surface=None),)))
        result = direct_json(found)
        return write(folder, result, direct_files(found), lambda: direct_document(found))

    return make


def test_the_folder_holds_result_report_curves_and_pictures(written_direct, channel, tmp_path):
    written = written_direct(tmp_path / "a" / "b", channel("axial", 130.0, 100.0))
    names = {path.name for path in (tmp_path / "a" / "b").iterdir()}
    assert names == {path.name for path in written}
    pictures = {f"axial-{kind}.{form}" for kind in ("curve", "deformed", "mesh") for form in ("png", "svg")}
    assert names == {"result.json", "report.html", "axial.csv", "axial-comparison.csv"} | pictures
    assert json.loads((tmp_path / "a" / "b" / "result.json").read_text())["command"] == "direct"


def test_curves_read_back_in_the_same_units(written_direct, channel, tmp_path):
    written_direct(tmp_path / "out", channel("torsional", 18000.0, surface=None))
    back = read_recording(Source("torsional", tmp_path / "out" / "torsional.csv"))
    assert back.displacement == pytest.approx(np.linspace(-4.0, 4.0, 21))
    assert back.force == pytest.approx(18000.0 * back.displacement)


def test_the_comparison_stands_at_the_recorded_displacements(written_direct, tmp_path):
    written_direct(tmp_path / "out")
    lines = (tmp_path / "out" / "axial-comparison.csv").read_text().splitlines()
    assert lines[0] == "displacement_mm,recorded_force_N,simulated_force_N"
    assert lines[1] == "-4,-400,-520"
    assert len(lines) == 42


def test_a_folder_of_results_is_written_again_and_other_files_are_left_alone(written_direct, tmp_path):
    written_direct(tmp_path / "out")
    other = tmp_path / "out" / "notes.txt"
    other.write_text("mine")
    written_direct(tmp_path / "out")
    assert other.read_text() == "mine"
    assert not [path for path in (tmp_path / "out").iterdir() if path.suffix == ".part"]


def test_a_file_in_place_of_the_folder_is_refused(written_direct, case, tmp_path):
    (tmp_path / "out").write_text("mine")
    with pytest.raises(InputError, match="is a file"):
        written_direct(tmp_path / "out")
    with pytest.raises(InputError, match="is a file"):
        check_output(tmp_path / "out" / "deeper", case())
    assert (tmp_path / "out").read_text() == "mine"


def test_an_input_of_the_case_is_never_replaced(written_direct, case, tmp_path):
    # The recording beside the case file is axial.csv, and so would be the simulated curve.
    before = (case().path.parent / "axial.csv").read_text()
    for attempt in (
        lambda: written_direct(case().path.parent),
        lambda: check_output(case().path.parent, case()),
    ):
        with pytest.raises(InputError, match=r"axial\.csv: is an input of the case"):
            attempt()
    assert (case().path.parent / "axial.csv").read_text() == before
    assert not (case().path.parent / "result.json").exists()


def test_files_that_no_run_has_written_are_not_replaced(written_direct, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "axial.csv").write_text("mine")
    with pytest.raises(InputError, match="not written by an earlier run"):
        written_direct(tmp_path / "out")
    assert (tmp_path / "out" / "axial.csv").read_text() == "mine"


def test_a_new_or_an_empty_folder_is_accepted(case, tmp_path):
    check_output(tmp_path / "new" / "folder", case())
    check_output(tmp_path, case())


@pytest.mark.parametrize(
    ("command", "file"),
    [
        ("direct", "measured-comparison.csv"),
        ("inverse", "measured-identified.csv"),
        ("diagnose", "measured-diagnosis.csv"),
    ],
)
def test_every_command_is_refused_its_own_files_before_it_begins(case, tmp_path, command, file):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / file).write_text("mine")
    with pytest.raises(InputError, match="not written by an earlier run"):
        check_output(tmp_path / "out", case(), command)
    others = {"direct", "fit", "inverse", "diagnose", "check"} - {command}
    for other in others:
        check_output(tmp_path / "out", case(), other)


@pytest.mark.parametrize("command", ["inverse", "diagnose"])
def test_results_may_be_written_beside_the_case(case, command):
    # These commands write files whose names differ from the recordings'.
    check_output(case().path.parent, case(), command)


def test_a_failure_in_the_middle_leaves_no_part_behind(written_direct, tmp_path):
    written_direct(tmp_path / "out")
    (tmp_path / "out" / "report.html").unlink()
    (tmp_path / "out" / "report.html").mkdir()
    with pytest.raises(NotDrawn, match="is a folder, where a file of the result belongs"):
        written_direct(tmp_path / "out")
    assert not [path for path in (tmp_path / "out").iterdir() if path.name.endswith(".part")]


def test_names_stay_in_the_folder_and_apart():
    names = file_names(["../../etc/passwd", "a/b", "a b", "A_b", "", "schräg 1", "x" * 300])
    assert len({name.casefold() for name in names.values()}) == len(names)
    assert not any(set(name) & set('/\\:*?"<>| ') or name.startswith(".") for name in names.values())
    assert max(map(len, names.values())) <= 110
    assert names["schräg 1"] == "schräg_1"


def test_a_map_of_several_channels_gets_a_name_that_no_channel_has():
    # As in `write_diagnosis`: the map of a single channel has the channel's name.
    names = file_names(["axial", "radial", "axial_radial", "axial", "axial + radial"])
    assert names["axial"] == "axial"
    assert names["axial + radial"] == "axial_radial_2"


def test_a_fit_writes_recorded_and_fitted_stress(case, fit, tmp_path):
    found = FitResult(case(), fit)
    write(tmp_path / "out", fit_json(found), fit_files(found), lambda: fit_document(found))
    lines = (tmp_path / "out" / "planar-fit.csv").read_text().splitlines()
    assert lines[0] == "stretch,recorded_nominal_stress_MPa,fitted_nominal_stress_MPa"
    assert lines[-1] == "3,2,2.4"
    assert (tmp_path / "out" / "coupons.svg").exists()


def test_meshes_write_pictures(case, ring, tmp_path):
    mesh = Meshed("section", ("axial",), 2, 2, 6, {}, {}, ring)
    written = write(tmp_path / "out", {"command": "mesh"}, mesh_files(MeshResult(case(), [mesh])), None)
    assert {path.name for path in written} == {"result.json", "mesh-section.png", "mesh-section.svg"}
