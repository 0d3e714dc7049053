"""Lines of a case file that `bushcli init` asked the user to complete."""

from __future__ import annotations

from bushcli.case.load import unedited_lines


def test_marked_lines_are_named(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(
        "# lines marked <-- are to be completed\n[geometry]  # <-- dimensions\nlength = 40.0\na = 1 # <-- b\n"
    )
    (found,) = unedited_lines(path)
    assert found.name == "unedited_case"
    assert "lines 2, 4" in found.message


def test_a_case_without_marks_and_a_part_are_left_alone(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text("[geometry]  # lengths < 40\n")
    assert unedited_lines(path) == ()
    assert unedited_lines(tmp_path / "part.step") == ()
