"""Local thickness of a part: the diameter of the ball that touches a face and the opposite face.

References
----------
Ma, Bae and Choi (2012), 3D medial axis point approximation using nearest neighbors and the normal field, Vis. Comput.
28:7-19, doi:10.1007/s00371-011-0594-7.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geometry.cad.sampling import Sampled

#: Two faces are opposite where the cosine of their normals is below this.
OPPOSITE = -0.5
#: Share of a face's points that must be near another face for the face to count as narrow.
SHARE = 0.5


def local_thickness(faces: Sequence[Sampled], thickness: float) -> dict[int, float]:
    """Distance to the opposite face (mm), for the faces where it is less than the thickness.

    Parameters
    ----------
    faces : Sequence[Sampled]
        Sampled faces of the part.
    thickness : float
        Distance beyond which faces are not opposite each other, mm.
    """
    points = np.concatenate([face.points for face in faces])
    normals = np.concatenate([face.normals for face in faces])
    narrow = {}
    for face in faces:
        if not len(face.points):
            continue
        way = points[None] - face.points[:, None]
        depth = -np.einsum("ijk,ik->ij", way, face.normals)
        opposite = (face.normals @ normals.T < OPPOSITE) & (depth > 1e-9 * thickness)
        squares = np.einsum("ijk,ijk->ij", way, way)
        diameter = np.where(opposite, squares / np.where(opposite, depth, 1.0), np.inf).min(axis=1)
        near = float(np.quantile(diameter, SHARE, method="lower"))
        if near < thickness:
            narrow[face.tag] = near
    return narrow
