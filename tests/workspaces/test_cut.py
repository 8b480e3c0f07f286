"""Cutting a mesh at a plane: a box, a ball and meshes that the plane misses."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from polypod.workspaces.cut import above


def cut(mesh, axis, value):
    return above(np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64), axis, value)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_box_keeps_its_upper_part(axis):
    part = cut(trimesh.creation.box((2.0, 2.0, 2.0)), axis, 0.25)
    assert part.vertices[:, axis].min() == 0.25
    assert part.vertices[:, axis].max() == 1.0
    mesh = trimesh.Trimesh(part.vertices, part.faces, process=False)
    assert mesh.area == pytest.approx(4.0 + 4 * 2.0 * 0.75, rel=1e-12)
    assert not mesh.is_watertight  # open at the cut
    # Seen from a point of the plane a lid would have no volume; normals look outside.
    corners = part.vertices[part.faces] - 0.25 * np.eye(3)[axis]
    assert np.linalg.det(corners).sum() / 6.0 == pytest.approx(3.0, rel=1e-12)


def test_faces_know_what_they_are_a_part_of():
    ball = trimesh.creation.icosphere(3)
    part = cut(ball, 2, 0.1)
    normals = np.cross(*(part.vertices[part.faces[:, k]] - part.vertices[part.faces[:, 0]] for k in (1, 2)))
    sizes = np.linalg.norm(normals, axis=1)
    thick = sizes > 1e-9
    np.testing.assert_allclose(
        (normals / np.where(thick, sizes, 1.0)[:, None])[thick],
        ball.face_normals[part.parent][thick],
        atol=1e-6,
    )
    assert set(range(len(part.vertices))) == set(part.faces.ravel())  # no vertex is left over


def test_a_plane_beside_the_mesh():
    ball = trimesh.creation.icosphere(2)
    whole = cut(ball, 2, -2.0)
    np.testing.assert_array_equal(whole.vertices[whole.faces], ball.vertices[ball.faces])
    nothing = cut(ball, 2, 2.0)
    assert nothing.vertices.shape == (0, 3)
    assert nothing.faces.shape == (0, 3)
