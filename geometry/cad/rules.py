"""Rules of the case file that select faces: by radius, normal, box, name or colour."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, field_validator, model_validator

from geometry.cad.axis import Axis, from_axis, own_line
from geometry.cad.sampling import Sampled

#: A radius or a box is met within this share of the part's size, a normal within this sine.
NEAR, STRAIGHT = 2e-3, 1e-2


def _vector(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _corners(value: Any) -> Any:
    return tuple(map(_vector, value)) if isinstance(value, list) else value


Vector = Annotated[tuple[float, float, float], BeforeValidator(_vector)]
Corners = Annotated[tuple[Vector, Vector], BeforeValidator(_corners)]


class Rule(BaseModel):
    """Faces that meet every condition given."""

    model_config = ConfigDict(frozen=True, defer_build=True, extra="forbid", allow_inf_nan=False)

    radius: float | None = Field(
        default=None, gt=0, description="of cylinders about the axis or a parallel, mm"
    )
    normal: Vector | None = Field(
        default=None, description="of plane faces, out of the rubber, in the file's axes"
    )
    box: Corners | None = Field(
        default=None, description="two corners of a box around the faces, file's axes, mm"
    )
    face: str | None = Field(default=None, description="name of faces in the file")
    colour: str | None = Field(default=None, description='of faces in the file, as "#rrggbb"')

    @field_validator("colour")
    @classmethod
    def _hexadecimal(cls, value: str | None) -> str | None:
        if value is not None and not re.fullmatch("#[0-9a-fA-F]{6}", value):
            raise ValueError('write a colour as "#rrggbb", such as "#ff0000" for red')
        return value

    @model_validator(mode="after")
    def _require_condition(self) -> Any:
        if not self.model_fields_set:
            raise ValueError("give radius, normal, box, face or colour")
        return self

    @property
    def is_box(self) -> bool:
        """Whether it says no more than where the faces lie."""
        return self.model_fields_set == {"box"}

    @property
    def text(self) -> str:
        """The conditions as in the case file."""
        conditions = self.model_dump(exclude_none=True)
        return ", ".join(f"{name} = {value}" for name, value in conditions.items())

    def selects(
        self,
        face: Sampled,
        axis: Axis,
        size: float,
        names: Mapping[int, str],
        colours: Mapping[int, tuple[int, int, int]],
        parallel: bool = False,
    ) -> bool:
        """Whether a face meets all conditions.

        Parameters
        ----------
        face : Sampled
            Sampled face.
        axis : Axis
            Axis of the bushing.
        size : float
            Largest extent of the part, mm.
        names : Mapping[int, str]
            Names of faces by their tag.
        colours : Mapping[int, tuple[int, int, int]]
            Colours of faces (red, green, blue, 0 to 255) by their tag.
        parallel : bool
            Whether the radius may be about any line that is parallel to the axis.
        """
        return all(
            (
                self.radius is None or _at_radius(face, axis, self.radius, size, parallel),
                self.normal is None or _looks(face, self.normal),
                self.box is None or _within(face, self.box, size),
                self.face is None or names.get(face.tag, "").lower() == self.face.lower(),
                self.colour is None or hexadecimal(colours.get(face.tag)) == self.colour.lower(),
            )
        )


def _rules(value: Any) -> Any:
    return (value,) if isinstance(value, dict) else tuple(value) if isinstance(value, list) else value


Rules = Annotated[tuple[Rule, ...], BeforeValidator(_rules)]


def matching_faces(
    rules: Sequence[Rule],
    faces: Sequence[Sampled],
    axis: Axis,
    size: float,
    names: Mapping[int, str],
    colours: Mapping[int, tuple[int, int, int]],
) -> list[int]:
    """Faces that meet one of the rules.

    Where no cylinder about the axis has the radius of a rule, those about lines parallel to it count, as an eccentric
    bore does.

    Parameters
    ----------
    rules : Sequence[Rule]
        Conditions of the case file.
    faces : Sequence[Sampled]
        Sampled faces of the part.
    axis : Axis
        Axis of the bushing.
    size : float
        Largest extent of the part, mm.
    names : Mapping[int, str]
        Names of faces by their tag.
    colours : Mapping[int, tuple[int, int, int]]
        Colours of faces (red, green, blue, 0 to 255) by their tag.
    """
    tags: list[int] = []
    for rule in rules:
        for parallel in (False, True):
            matches = [f.tag for f in faces if rule.selects(f, axis, size, names, colours, parallel)]
            if matches:
                break
        tags += matches
    return [face.tag for face in faces if face.tag in tags]


def hexadecimal(colour: tuple[int, int, int] | None) -> str:
    """Write a colour as in the case file."""
    return "" if colour is None else "#" + "".join(f"{part:02x}" for part in colour)


def _at_radius(face: Sampled, axis: Axis, radius: float, size: float, parallel: bool) -> bool:
    line = own_line(face, axis, size)
    if line is None or (line is not axis and not parallel):
        return False
    distance = np.linalg.norm(from_axis(face.points, line), axis=1)
    return bool(np.all(np.abs(distance - radius) < NEAR * size))


def _looks(face: Sampled, normal: Sequence[float]) -> bool:
    n = np.asarray(normal, dtype=float)
    sines = np.linalg.norm(np.cross(face.normals, n / np.linalg.norm(n)), axis=1)
    return bool(len(sines) and sines.max() < STRAIGHT and float(face.normals[0] @ n) > 0)


def _within(face: Sampled, box: Corners, size: float) -> bool:
    corners = np.array(box, dtype=float)
    low, high = corners.min(axis=0) - NEAR * size, corners.max(axis=0) + NEAR * size
    return bool(len(face.points) and np.all((face.points >= low) & (face.points <= high)))
