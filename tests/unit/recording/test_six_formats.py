"""Recordings of six motions in every format that a rig writes; in MDF with different rasters."""

from pathlib import Path

import numpy as np
import pytest

from bushcli.case import load_case
from bushcli.errors import InputError
from bushcli.recording import read_recording

pytestmark = pytest.mark.usefixtures("in_this_process")

TIME = np.linspace(0.0, 20.0, 401)
#: The motions are linear in time between corners that are stamps of both rasters, so that interpolation is exact.
MOTIONS = {
    "ux_mm": np.interp(TIME, [0, 5, 10, 15, 20], [0, 1.5, 0, -1.0, 0]),
    "uz_mm": np.interp(TIME, [0, 5, 15, 20], [0, 0, 3.0, 0]),
    "rz_deg": np.interp(TIME, [0, 10, 15, 20], [0, 0, 8.0, 4.0]),
}
FORCES = {
    "fx_N": 2500.0 * MOTIONS["ux_mm"] + 30.0 * np.sin(3.0 * TIME),
    "fz_N": 350.0 * MOTIONS["uz_mm"] + 5.0 * np.sin(2.0 * TIME),
    "mz_Nmm": 1600.0 * MOTIONS["rz_deg"] + 20.0 * np.sin(TIME),
}
COARSE, EVERY_FIFTH = TIME[::5], {name: values[::5] for name, values in MOTIONS.items()}
CASE = """
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[material]
law = "yeoh"
[[recordings]]
mode = "path"
file = "{file}"
"""


def write_mdf(path, *groups):
    """Write groups of (time, columns), one raster each."""
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        for time, columns in groups:
            signals = []
            for name, values in columns.items():
                plain, _, unit = name.rpartition("_")
                signals.append(asammdf.Signal(samples=values, timestamps=time, name=plain, unit=unit))
            file.append(signals)
        Path(file.save(path, overwrite=True)).replace(path)


def write_xlsx(path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["Notes of the test"])
    sheet = book.create_sheet("Run 7")
    sheet.append(["time_s", *MOTIONS, *FORCES])
    for row in zip(TIME, *MOTIONS.values(), *FORCES.values(), strict=True):
        sheet.append([float(value) for value in row])
    book.save(path)


def write_tdms(path):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as file:
        channels = {"time_s": TIME, **MOTIONS, **FORCES}
        file.write_segment(
            [
                nptdms.ChannelObject(
                    "Run",
                    name.rpartition("_")[0],
                    values,
                    properties={"unit_string": name.rpartition("_")[2]},
                )
                for name, values in channels.items()
            ]
        )


def write_hdf5(path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        other = file.create_group("earlier run")
        other["temperature"] = np.full(11, 23.0)
        run = file.create_group("run")
        for name, values in {"time_s": TIME, **MOTIONS, **FORCES}.items():
            run[name.rpartition("_")[0]] = values
            run[name.rpartition("_")[0]].attrs["unit"] = name.rpartition("_")[2]


def write_parquet(path):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    pandas.DataFrame({"time_s": TIME, **MOTIONS, **FORCES}).to_parquet(path)


def write_csv(path):
    table = np.column_stack([TIME, *MOTIONS.values(), *FORCES.values()])
    np.savetxt(path, table, delimiter=",", header=",".join(["time_s", *MOTIONS, *FORCES]), comments="")


def recordings(folder, name, further=""):
    file = folder / "case.toml"
    file.write_text(CASE.format(file=name) + further)
    return {source.label: read_recording(source) for source in load_case(file).recordings}


def assert_right(found, rtol=1e-12):
    assert list(found) == ["path.fx", "path.fz", "path.mz"]
    for name, moved, force in zip(found, MOTIONS.values(), FORCES.values(), strict=True):
        one = found[name]
        scale = np.pi / 180 if name == "path.mz" else 1.0
        kept = np.rint(one.time / TIME[1]).astype(int)
        np.testing.assert_allclose(TIME[kept], one.time, rtol=1e-12, atol=1e-9)
        np.testing.assert_allclose(one.displacement, scale * moved[kept], rtol=rtol, atol=1e-9)
        np.testing.assert_allclose(one.force, force[kept], rtol=rtol, atol=1e-9)
        poses = np.column_stack([MOTIONS["ux_mm"], MOTIONS["uz_mm"], np.radians(MOTIONS["rz_deg"])])[kept]
        np.testing.assert_allclose(one.six.motion[:, [0, 2, 5]], poses, rtol=rtol, atol=1e-9)
        assert not np.any(one.six.motion[:, [1, 3, 4]])


@pytest.mark.parametrize(
    "write", [write_csv, write_xlsx, write_tdms, write_hdf5, write_parquet], ids=lambda one: one.__name__
)
def test_each_format_gives_the_path_and_its_reactions(tmp_path, write):
    write(tmp_path / "run.dat")
    assert_right(recordings(tmp_path, "run.dat"))


def test_mdf_in_one_group_and_in_one_group_per_channel(tmp_path):
    write_mdf(tmp_path / "one.mf4", (TIME, {**MOTIONS, **FORCES}))
    assert_right(recordings(tmp_path, "one.mf4"))
    write_mdf(tmp_path / "each.mf4", *((TIME, {k: v}) for k, v in {**MOTIONS, **FORCES}.items()))
    assert_right(recordings(tmp_path, "each.mf4"))


def test_motions_in_rasters_of_their_own_are_interpolated_at_the_stamps_of_the_forces(tmp_path):
    coarse = TIME[::5]
    turns = (TIME[::10], {"rz_deg": MOTIONS["rz_deg"][::10]})
    moves = (coarse, {name: MOTIONS[name][::5] for name in ("ux_mm", "uz_mm")})
    write_mdf(tmp_path / "run.mf4", moves, (TIME, {**FORCES, "temp_degC": 0 * TIME}), turns)
    found = recordings(tmp_path, "run.mf4")
    assert_right(found)
    (said,) = {repair.text for one in found.values() for repair in one.repairs}
    assert "at the 401 time stamps of the reactions" in said
    # Motions that end earlier: the forces after them are left out, and counted.
    write_mdf(
        tmp_path / "run.mf4", (coarse[:61], {k: v[::5][:61] for k, v in MOTIONS.items()}), (TIME, FORCES)
    )
    found = recordings(tmp_path, "run.mf4")
    assert_right(found)
    assert len(found["path.fx"].force) == 301
    assert "100 of them" in found["path.fx"].repairs[0].text


def test_channels_of_any_name_can_be_chosen(tmp_path):
    names = {"Weg quer_mm": MOTIONS["ux_mm"][::5], "Weg laengs_mm": MOTIONS["uz_mm"][::5]}
    write_mdf(tmp_path / "run.mf4", (TIME[::5], names), (TIME, {"Kraft quer_N": FORCES["fx_N"]}))
    chosen = 'motions = { ux = "Weg quer", uz = "Weg laengs" }\nforces = { fx = "Kraft quer" }\n'
    found = recordings(tmp_path, "run.mf4", chosen)
    assert list(found) == ["path.fx"]
    np.testing.assert_allclose(found["path.fx"].force, FORCES["fx_N"], rtol=1e-12)
    np.testing.assert_allclose(found["path.fx"].six.motion[:, 2], MOTIONS["uz_mm"], rtol=1e-12, atol=1e-12)


def test_init_from_a_file_with_motions_and_reactions_writes_a_path(tmp_path):
    from bushcli.case.from_files import case_from_files

    write_mdf(tmp_path / "run.mf4", (COARSE, EVERY_FIFTH), (TIME, FORCES))
    text = case_from_files([tmp_path / "run.mf4"], tmp_path)
    assert 'mode = "path"' in text
    assert "motions and reactions found: ux, uz, rz, fx, fz, mz" in text
    (tmp_path / "case.toml").write_text(text)
    assert [one.label for one in load_case(tmp_path / "case.toml").recordings] == [
        "path.fx",
        "path.fz",
        "path.mz",
    ]


def test_a_file_that_was_written_anew_is_read_anew(tmp_path):
    write_mdf(tmp_path / "run.mf4", (TIME, {**MOTIONS, **FORCES}))
    before = recordings(tmp_path, "run.mf4")["path.fx"].force
    write_mdf(tmp_path / "run.mf4", (TIME, {**MOTIONS, **{k: 2.0 * v for k, v in FORCES.items()}}))
    np.testing.assert_allclose(recordings(tmp_path, "run.mf4")["path.fx"].force, 2.0 * before, rtol=1e-12)


@pytest.mark.parametrize(
    ("groups", "sentence"),
    [
        ([(TIME, MOTIONS), (TIME + 100.0, FORCES)], "do not overlap in time"),
        (
            [(COARSE, EVERY_FIFTH), (TIME, {"fx_N": FORCES["fx_N"]}), (TIME[::2], {"mz_Nmm": TIME[::2]})],
            "2 groups",
        ),
        (
            [(COARSE, EVERY_FIFTH), (TIME[::2], {"ux_mm": TIME[::2]}), (TIME, FORCES)],
            "ux is in several groups",
        ),
        (
            [
                (TIME, {**MOTIONS, **FORCES}),
                (TIME[::2], {k: v[::2] for k, v in {**MOTIONS, **FORCES}.items()}),
            ],
            "group = ",
        ),
        ([(TIME, {"Temp_degC": TIME}), (TIME[::2], {"Druck_bar": TIME[::2]})], "motions = {ux = ...}"),
    ],
)
def test_what_is_not_clear_is_refused_with_a_sentence(tmp_path, groups, sentence):
    write_mdf(tmp_path / "run.mf4", *groups)
    with pytest.raises(InputError, match=sentence.replace("{", r"\{").replace("...", r"\.\.\.")):
        recordings(tmp_path, "run.mf4")


def test_a_reaction_that_is_logged_slowly_has_the_motions_of_its_rows(tmp_path):
    """Without a time nothing can be interpolated: of the motions, too, the rows between two updates are left out."""
    slow = np.round(
        2500.0 * np.repeat(MOTIONS["ux_mm"][::2], 2)[:401] + 30.0 * np.sin(np.arange(401) // 2), 1
    )
    table = np.column_stack([*MOTIONS.values(), slow, *list(FORCES.values())[1:]])
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header=",".join([*MOTIONS, *FORCES]), comments="")
    one = recordings(tmp_path, "a.csv")["path.fx"]
    np.testing.assert_allclose(one.force, slow[::2])
    np.testing.assert_allclose(one.six.motion[:, 0], MOTIONS["ux_mm"][::2], atol=1e-9)
