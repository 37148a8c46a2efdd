"""Objects and obstacles from files, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from muslin.core.bending import SheetBending
from muslin.core.body import Body, cloth_grid, solid_box
from muslin.core.errors import BrokenPluginError, InputError, MissingFileError
from muslin.core.importing import mesh as reading
from muslin.core.importing.mesh import read_body, read_closed_surface

trimesh = pytest.importorskip("trimesh")

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n"
TEXTURED = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nf 2/1 3/2 4/3\n"


def obj(folder: Path, text: str) -> Path:
    path = folder / "a.obj"
    path.write_text(text)
    return path


def test_a_surface_keeps_the_order_and_the_holes_of_its_file(tmp_path: Path) -> None:
    ring = trimesh.creation.annulus(r_min=0.1, r_max=0.3, height=0.2)
    corners = [f"v {x} {y} {z}" for x, y, z in ring.vertices]
    faces = [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in ring.faces[5:]]  # and a hole
    body = read_body(obj(tmp_path, "\n".join(corners + faces)))
    assert body.kind == "cloth" and body.grid is None
    np.testing.assert_allclose(body.vertices, ring.vertices, atol=1e-9)
    np.testing.assert_array_equal(body.elements, ring.faces[5:])
    assert np.isfinite(body.warp_directions(body.vertices)).all()


def test_vertices_that_are_cut_along_a_seam_are_one(tmp_path: Path) -> None:
    """As texture coordinates have them: each vertex of the seam twice, the numbers those of the first."""
    texture = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 0.5 0.5\n"
    cut = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 0 0\nv 1 1 1e-9\nv 0 1 0\n"
    body = read_body(obj(tmp_path, cut + texture + "f 1/1 2/2 3/3\nf 4/5 5/3 6/4\n"))
    np.testing.assert_allclose(body.vertices, [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], atol=1e-8)
    assert body.elements.tolist() == [[0, 1, 2], [0, 2, 3]]
    same = read_body(obj(tmp_path, SQUARE.replace("1 2 3", "1/1 2/2 3/3").replace("1 3 4", "1/5 3/3 4/4") + texture))
    assert same.elements.tolist() == body.elements.tolist()


def test_triangles_of_a_piece_are_turned_to_look_to_one_side(tmp_path: Path) -> None:
    """The bend of a sheet has a sign, and exporters do not always agree on which."""
    sheet = cloth_grid(0.3, 0.3, 6, 6)
    mixed = sheet.elements.copy()
    turned = np.random.default_rng(0).random(len(mixed)) < 0.5
    turned[0] = False
    mixed[turned] = mixed[turned][:, [0, 2, 1]]
    text = "\n".join(f"v {x} {y} {z}" for x, y, z in sheet.vertices) + "\n"
    body = read_body(obj(tmp_path, text + "\n".join(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mixed)))
    p = body.vertices[body.elements]
    normals = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    assert (normals @ normals[0] > 0).all()
    np.testing.assert_array_equal(np.sort(body.elements, axis=1), np.sort(mixed, axis=1))
    x, _, z = sheet.vertices.T
    rolled = 0.1 * np.stack([np.sin(10 * x), 1 - np.cos(10 * x), 10 * z], axis=1)
    bends = [SheetBending(one) for one in (sheet, body)]
    for one in bends:
        one.follow(rolled)
    assert np.abs(bends[0].curvature).max() > 9.0
    np.testing.assert_allclose(bends[1].curvature, bends[0].curvature, atol=1e-9)


@pytest.mark.parametrize("ending", ["stl", "ply", "off", "glb"])
def test_the_other_formats(tmp_path: Path, ending: str) -> None:
    box = trimesh.creation.box((0.1, 0.2, 0.3))
    box.export(tmp_path / f"box.{ending}")
    body = read_body(tmp_path / f"box.{ending}")
    assert len(body.vertices) == 8 and len(body.elements) == 12
    assert body.measures.sum() == pytest.approx(0.22)


def test_scale_and_axis(tmp_path: Path) -> None:
    body = read_body(obj(tmp_path, SQUARE.replace("v 1 1 0", "v 1 1 0.5")), scale=0.5, up="y")
    assert body.vertices[2].tolist() == [0.25, 0.5, 0.5]  # z x y of the file
    with pytest.raises(InputError, match=r"1000 m large .*mesh_scale = 0\.001"):
        read_body(obj(tmp_path, SQUARE), scale=1000.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "holds no triangles"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 nan\nf 1 2 3\n", "vertex 2 is not finite"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "damaged or not a .obj file"),
        (SQUARE + "v 5 5 5\n", r"1 vertices belong to nothing, as vertex 4 at \(5, 5, 5\) m"),
        ("v 5 5 5\n" + TEXTURED, "1 vertices belong to nothing"),
        (SQUARE + "v 2 2 0\nf 1 3 5\n", r"1 of 3 triangles have no area, as triangle 2 at \(1, 1, 0\) m"),
        (
            SQUARE + "v 0 0 1\nf 1 3 5\n",
            r"1 edges belong to more than two .* vertices 0 and 2 at \(0.5, 0.5",
        ),
        (SQUARE + "f 3 2 1\nf 1 3 2\n", "more than two triangles"),
    ],
)
def test_surfaces_that_no_cloth_can_have(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        read_body(obj(tmp_path, text))
    assert "a.obj" in str(caught.value) and "\n" not in str(caught.value)


def test_files_that_are_no_objects(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(MissingFileError, match="there is no mesh"):
        read_body(tmp_path / "nix.obj")
    (tmp_path / "a.step").write_text("x")
    with pytest.raises(InputError, match=r"no reader for \.step"):
        read_body(tmp_path / "a.step")
    with pytest.raises(InputError, match=r"vertices = \[7\] is for ropes"):
        read_body(obj(tmp_path, SQUARE), count=7)
    (tmp_path / "a.stl").write_bytes(b"solid " + b"\xff" * 100)
    with pytest.raises(InputError, match=r"a\.stl"):
        read_body(tmp_path / "a.stl")

    def missing(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(reading.importlib, "import_module", missing)
    with pytest.raises(BrokenPluginError, match=r"needs trimesh; install it with: pip install 'muslin\[mesh\]'"):
        read_body(obj(tmp_path, SQUARE))


def test_a_rope_from_a_polyline(tmp_path: Path) -> None:
    path = tmp_path / "rope.csv"
    path.write_text("x,y,z\n0,0,0\n300,0,0\n300,0,-100\n")
    rope = read_body(path, scale=0.001, count=9)
    assert rope.kind == "rope" and len(rope.vertices) == 9
    np.testing.assert_allclose(rope.vertices[6], [0.3, 0, 0], atol=1e-12)
    assert len(read_body(path, scale=0.001).vertices) == 3
    path.write_text("x,y,z\n0,0,0\n0,0,0\n")
    with pytest.raises(InputError, match=r"rope\.csv: a rope needs a length"):
        read_body(path)
    path.write_text("x,y,z\n0,0,0\n0,no,0\n")
    with pytest.raises(InputError, match="line 3: y must be a finite number"):
        read_body(path)


@pytest.mark.parametrize("ending", ["vtk", "vtu", "msh"])
def test_a_solid_from_tetrahedra(tmp_path: Path, ending: str) -> None:
    meshio = pytest.importorskip("meshio")
    box = solid_box(np.zeros(3), np.array([0.1, 0.2, 0.3]), (2, 3, 2))
    turned = box.elements.copy()
    turned[::2, :2] = turned[::2, 1::-1]
    path, how = tmp_path / f"a.{ending}", {"file_format": {"msh": "gmsh22"}.get(ending, ending)}
    meshio.Mesh(box.vertices, [("triangle", box.triangles), ("tetra", turned)]).write(path, **how)
    body = read_body(path)
    edges = body.vertices[body.elements[:, 1:]] - body.vertices[body.elements[:, :1]]
    assert body.kind == "solid" and (np.linalg.det(edges) > 0).all()
    assert body.measures.sum() == pytest.approx(0.006)
    meshio.Mesh(box.vertices, [("triangle", box.triangles)]).write(path, **how)
    with pytest.raises(InputError, match="no linear tetrahedra but triangle"):
        read_body(path)
    flat = box.vertices * [1, 1, 0]
    meshio.Mesh(flat, [("tetra", turned)]).write(path, **how)
    with pytest.raises(InputError, match=r"tetrahedron 0 .* has no volume"):
        read_body(path)
    path.write_text("nothing of the kind\n")
    with pytest.raises(InputError, match="damaged or not a"):
        read_body(path)


def test_a_closed_surface_looks_outward(tmp_path: Path) -> None:
    box = trimesh.creation.box((0.1, 0.2, 0.3))
    text = "\n".join(f"v {x} {y} {z}" for x, y, z in box.vertices) + "\n"
    inward = [f[::-1] for f in box.faces.tolist()]

    def written(faces: list[list[int]]) -> Path:
        return obj(tmp_path, text + "\n".join("f " + " ".join(str(v + 1) for v in f) for f in faces))

    vertices, triangles = read_closed_surface(written(inward), scale=2.0)
    assert np.linalg.det(vertices[triangles]).sum() / 6 == pytest.approx(0.048)
    with pytest.raises(InputError, match="do not all look to the same side"):
        read_closed_surface(written([*inward[:-1], inward[-1][::-1]]))


def test_merging_keeps_what_is_near_but_apart(tmp_path: Path) -> None:
    body = read_body(obj(tmp_path, SQUARE.replace("v 1 1 0", "v 1 1e-4 0")))
    assert isinstance(body, Body) and len(body.vertices) == 4
