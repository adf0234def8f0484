"""OBJ files as people have them: each case with its right value, found by hand."""

import numpy as np
import pytest
from mesh_cases import (
    BLUE,
    GREEN,
    QUARTERS,
    RED,
    SQUARE,
    UPRIGHT,
    UVS,
    WHITE,
    YELLOW,
    area,
    load,
    picture,
    quarters,
    write,
)

from prnav.errors import SceneError

MTL = "newmtl m\nKd 1 1 1\nmap_Kd p.png\n"
TEXTURED = "mtllib a.mtl\n" + SQUARE + "usemtl m\nf 1/1 2/2 3/3 4/4\n"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf -4 -3 -2 -1\nv 5 5 0\nv 6 5 0\nv 6 6 0\nf -3 -2 -1\n", 4.5),
        ("v -1 -1 0 # corner\nv 1 -1 0\nv 1 1 0#corner\nf 1 2 3 # face\n", 2.0),
        ("v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 \\\n  3 4\n", 4.0),
        ("# C:\\meshes\\\nv -1 -1 0\r\nv 1 -1 0\r\nv 1 1 0\r\nv -1 1 0\r\nf 1 2 3 4\r\n", 4.0),
        ("v -1 -1 0\rv 1 -1 0\rv 1 1 0\rv -1 1 0\rf 1 2 3 4\r", 4.0),
        ("v\t-1\t-1\t0\nv  1 -1  0\n  v 1 1 0\nv -1 1 0 \n\tf\t1\t2 3\t4 \n", 4.0),
        ("v -1e0 -1.0E+0 .0\nv +1 -1. 0\nv 1 1 0\nv -1 1 -0\nf 1//1 2//2 3//3 4//4\n", 4.0),
        (SQUARE + "f 1/1/ 2/2/ 3/3/ 4/4/\n", 4.0),
        (SQUARE + "f 1/1/7 2/2/8 3/3/9 4/4/-7\n", 4.0),
        ("g a\no b\ns off\nv -1 -1 0 1.0\nv 1 -1 0 1.0\nv 1 1 0 1.0\nfo 1 2 3\nl 1 2 3\np 1\n", 2.0),
        (SQUARE + "f 1 2 3 4\nf 1 2\nf 3\n", 4.0),
    ],
)
def test_lines(tmp_path, text, expected):
    scene = load(write(tmp_path, a_obj=text))
    assert area(scene) == pytest.approx(expected)


@pytest.mark.parametrize("mark", ["utf-16", "utf-8-sig", "utf-16-le", "utf-16-be", "utf-32"])
def test_encodings(tmp_path, mark):
    path = write(tmp_path, a_obj=TEXTURED.encode(mark), a_mtl=MTL.encode(mark), p_png=picture())
    assert quarters(load(path)) == UPRIGHT


def test_relative_texture_coordinates(tmp_path):
    text = (
        "mtllib a.mtl\nusemtl m\n" + SQUARE + "f -4/-4 -3/-3 -2/-2 -1/-1\nv 5 5 0\nvt 0 0\nvt 0 0\nv 6 5 0\nv 6 6 0\n"
    )
    scene = load(write(tmp_path, a_obj=text + "f -3/-1 -2/-1 -1/-1\n", a_mtl=MTL, p_png=picture()))
    assert quarters(scene) == UPRIGHT and area(scene) == pytest.approx(4.5)


U_SHAPE = [(0, 0), (0, 6), (8, 6), (8, 0), (6, 0), (6, 4), (2, 4), (2, 0)]
POLYGONS = {
    "U": (U_SHAPE, 32.0),
    "L": ([(-1, -1), (1, -1), (1, 0), (0, 0), (0, 1), (-1, 1)], 3.0),
    "collinear corners": ([(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2)], 4.0),
    "arrow head": ([(0, 0), (4, 0), (1, 1), (0, 4)], 4.0),
    "comb": ([(0, 0), (5, 0), (5, 3), (4, 3), (4, 1), (3, 1), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)], 11.0),
    "ring with a double edge": ([(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)], 12.0),
    "spike": ([(0, 0), (2, 0), (2, 2), (2, 5), (2, 2), (0, 2)], 4.0),
}


@pytest.mark.parametrize("name", POLYGONS)
def test_polygons_keep_their_area_from_any_corner_on_and_in_any_plane(tmp_path, name):
    outline, expected = POLYGONS[name]
    generator = np.random.default_rng(0)
    for first in range(len(outline)):
        turn = np.linalg.qr(generator.normal(size=(3, 3)))[0] if first else np.eye(3)
        points = np.array([(x, y, 0.0) for x, y in outline]) @ turn.T + 10.0 * bool(first)
        order = (np.arange(len(outline)) + first) % len(outline)
        for turned in (order, order[::-1]):
            text = "".join(f"v {x:.9f} {y:.9f} {z:.9f}\n" for x, y, z in points)
            text += "f " + " ".join(str(k + 1) for k in turned) + "\n"
            scene = load(write(tmp_path, a_obj=text))
            assert area(scene) == pytest.approx(expected, rel=1e-4) and not scene.notes
            a, b, c = (scene.vertices[scene.faces[:, k]].astype(float) for k in range(3))
            normals = np.cross(b - a, c - a)
            total = normals.sum(axis=0)
            assert np.linalg.norm(total) / 2 == pytest.approx(expected, rel=1e-4)  # all turn the same way


def test_a_bent_quad_is_split_the_same_way_from_any_corner_on(tmp_path):
    areas = []
    for first in range(4):
        order = " ".join(str((k + first) % 4 + 1) for k in range(4))
        areas.append(area(load(write(tmp_path, a_obj=f"v 0 0 0\nv 1 0 1\nv 1 1 0\nv 0 1 2\nf {order}\n"))))
    assert len(set(areas)) == 1


def test_a_polygon_that_crosses_itself_is_noted(tmp_path):
    text = "v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 1 0\nf 1 2 3 4\n"
    assert "polygons cross themselves" in load(write(tmp_path, a_obj=text)).notes[0]


@pytest.mark.parametrize(
    "faces",
    [
        "f 1/1 2/2 3/3 4/4\n",
        "f 1 2 3 4\n",
        "usemtl n\nf 1 2 3 4\n",
        "mtllib a.mtl\nusemtl w\nf 1 2 3 4\n",
        "mtllib a.mtl\nusemtl w\nf 1/1 2/2 3/3 4/4\n",
        "mtllib a.mtl\nusemtl m\nf 1 2 3 4\n",
    ],
)
@pytest.mark.parametrize("values", ["1 0 0", "255 0 0", "1 0 0 1", "1.0 0.0 0.0 # red"])
def test_vertex_colours_are_never_dropped(tmp_path, faces, values):
    corners = "".join(f"v {x} {y} 0 {values}\n" for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
    path = write(tmp_path, a_obj=corners + UVS + faces, a_mtl=MTL + "newmtl w\nKd 1 1 1\n", p_png=picture())
    assert quarters(load(path)) == (RED,) * 4


def test_vertex_colour_times_kd_times_texel(tmp_path):
    corners = "".join(f"v {x} {y} 0 0.5 1 0.25\n" for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
    text = "mtllib a.mtl\n" + corners + UVS + "usemtl m\nf 1/1 2/2 3/3 4/4\n"
    mtl = "newmtl m\nKd 0.5 0.5 1\nmap_Kd p.png\n"
    found = quarters(load(write(tmp_path, a_obj=text, a_mtl=mtl, p_png=picture())))
    assert np.abs(np.array(found) - np.array(UPRIGHT) * [0.25, 0.5, 0.25]).max() <= 1


def test_vertices_with_and_without_colours(tmp_path):
    text = "v -1 -1 0\nv 1 -1 0 1 0 0\nv 1 1 0\nf 1 2 3\n"
    scene = load(write(tmp_path, a_obj=text))
    assert sorted(map(tuple, scene.colors.tolist())) == [RED, WHITE, WHITE]


OPTIONS = [
    "map_Kd p.png",
    "map_Kd\tp.png",
    "map_kd p.png",
    "  map_Kd   p.png  ",
    'map_Kd "p.png"',
    "map_Kd p.png # the wall",
    'map_Kd "p.png" # the wall',
    "map_Kd -s 1 1 1 -o 0 0 0 p.png",
    "map_Kd -s 1 1 p.png",
    "map_Kd -o 0 p.png",
    "map_Kd -o 1 -2 p.png",
    "map_Kd -t 0 0 0 p.png",
    "map_Kd -mm 0 1 p.png",
    "map_Kd -bm 1.5 p.png",
    "map_Kd -clamp on p.png",
    "map_Kd -clamp off -blendu on -blendv off -cc off -texres 256 -imfchan r -boost 2 p.png",
    "map_Kd -type sphere p.png",
    "map_Kd .\\p.png",
    "map_Kd ./p.png",
    "map_Kd P.PNG",
    "map_Kd C:\\Users\\someone\\textures\\p.png",
    "map_Kd C:/Users/someone/p.png",
    "map_Kd /home/someone/textures/p.png",
    "map_Kd \\\\server\\share\\p.png",
    "map_Kd file:///home/someone/p.png",
    "map_Kd textures/p.png",
    "map_Kd p.png -s 1 1 1",
]


@pytest.mark.parametrize("line", OPTIONS)
def test_ways_to_name_a_picture(tmp_path, line):
    path = write(tmp_path, a_obj=TEXTURED, a_mtl=f"newmtl m\nKd 1 1 1\n{line}\n", p_png=picture())
    assert quarters(load(path)) == UPRIGHT


@pytest.mark.parametrize(
    "name", ["two words.png", "a#b.png", "a #b.png", "dé cor.png", "12.png", "-x.png", "tex (1).PNG"]
)
def test_names_of_pictures(tmp_path, name):
    (tmp_path / name).write_bytes(picture())
    for line in (f"map_Kd {name}", f"map_Kd -s 1 1 1 {name}", f'map_Kd "{name}"'):
        path = write(tmp_path, a_obj=TEXTURED, a_mtl=f"newmtl m\n{line}\n")
        assert quarters(load(path)) == UPRIGHT


def test_options_that_move_a_picture(tmp_path):
    def found(options):
        return quarters(
            load(write(tmp_path, a_obj=TEXTURED, a_mtl=f"newmtl m\nmap_Kd {options} p.png\n", p_png=picture()))
        )

    assert found("-o 0.5 0") == (GREEN, RED, YELLOW, BLUE)
    assert found("-s -1 1") == (GREEN, RED, YELLOW, BLUE)
    assert found("-s 1 -1") == (BLUE, YELLOW, RED, GREEN)
    assert found("-clamp on -o 2 0") == (GREEN, GREEN, YELLOW, YELLOW)
    assert found("-clamp on -o 0 -3") == (BLUE, YELLOW, BLUE, YELLOW)
    assert found("-mm 0 0.2") == ((51, 0, 0), (0, 51, 0), (0, 0, 51), (51, 51, 0))
    assert found("-mm 0.2 0.8") == ((255, 51, 51), (51, 255, 51), (51, 51, 255), (255, 255, 51))


@pytest.mark.parametrize(
    "line",
    [
        "mtllib a.mtl b.mtl",
        "mtllib a.mtl\nmtllib b.mtl",
        "mtllib b.mtl a.mtl # both",
        'mtllib "a.mtl" "b.mtl"',
        "mtllib\ta.mtl\tb.mtl",
        "mtllib c.mtl a.mtl b.mtl",
        "mtllib A.MTL B.mtl",
        "mtllib C:\\work\\a.mtl\nmtllib /work/b.mtl",
        "mtllib a.mtl \\\n b.mtl",
    ],
)
def test_several_material_files(tmp_path, line):
    text = line + "\n" + SQUARE + "usemtl m\nf 1/1 2/2 3/3\nusemtl n\nf 1 3 4\n"
    path = write(tmp_path, a_obj=text, a_mtl="newmtl m\nmap_Kd p.png\n", b_mtl="newmtl n\nKd 0 1 0\n", p_png=picture())
    assert quarters(load(path)) == (GREEN, GREEN, BLUE, YELLOW) or quarters(load(path))[0] == GREEN
    assert quarters(load(path))[3] == YELLOW


def test_pictures_are_looked_for_beside_the_file_that_names_them(tmp_path):
    (tmp_path / "mats").mkdir()
    (tmp_path / "mats" / "a.mtl").write_text(MTL)
    (tmp_path / "mats" / "p.png").write_bytes(picture())
    (tmp_path / "p.png").write_bytes(picture(QUARTERS[::-1]))
    assert quarters(load(write(tmp_path, a_obj=TEXTURED.replace("a.mtl", "mats/a.mtl")))) == UPRIGHT


def test_the_first_of_two_definitions_counts_and_is_noted(tmp_path):
    text = "mtllib a.mtl b.mtl\n" + SQUARE + "usemtl m\nf 1 2 3 4\n"
    scene = load(write(tmp_path, a_obj=text, a_mtl="newmtl m\nKd 1 0 0\n", b_mtl="newmtl m\nKd 0 1 0\n"))
    assert quarters(scene) == (RED,) * 4 and "material 'm' is defined twice" in scene.notes[0]


def test_faces_with_and_without_texture_coordinates_in_one_material(tmp_path):
    text = "mtllib a.mtl\n" + SQUARE + "usemtl m\nf 1/1 2/2 3/3\nf 1 3 4\nv 3 3 0\nf 1/1 5 3/3\n"
    scene = load(write(tmp_path, a_obj=text, a_mtl="newmtl m\nKd 0 1 1\nmap_Kd p.png\n", p_png=picture()))
    assert scene.face_texture.tolist() == [1, 0, 0] and quarters(scene)[0] == (0, 255, 255)
    assert scene.notes == ("2 triangles have a picture and no texture coordinates, they show their colour alone",)


def test_faces_before_any_material_are_white(tmp_path):
    text = "mtllib a.mtl\n" + SQUARE + "f 1 2 3\nusemtl m\nf 1 3 4\n"
    scene = load(write(tmp_path, a_obj=text, a_mtl="newmtl m\nKd 1 0 0\n"))
    assert quarters(scene)[0] == RED and quarters(scene)[3] == WHITE and not scene.notes


def test_names_of_materials(tmp_path):
    for name in ("my mat", "Mat#1", "mat.001", "wänd", "m\tn"):
        text = f"mtllib a.mtl\n{SQUARE}usemtl {name}  \nf 1 2 3 4\n"
        assert quarters(load(write(tmp_path, a_obj=text, a_mtl=f"newmtl {name}\nKd 0 0 1\n"))) == (BLUE,) * 4
    text = f"mtllib a.mtl\n{SQUARE}usemtl m # wall\nf 1 2 3 4\n"
    assert quarters(load(write(tmp_path, a_obj=text, a_mtl="newmtl m\nKd 0 0 1\n"))) == (BLUE,) * 4


def test_latin_1_in_text_materials_and_names(tmp_path):
    (tmp_path / "décor.png").write_bytes(picture())
    obj = ("# façade\no mur_é\n" + TEXTURED.replace("usemtl m", "usemtl é")).encode("latin-1")
    mtl = "# matériaux\nnewmtl é\nKd 1 1 1\nmap_Kd décor.png\n".encode("latin-1")
    assert quarters(load(write(tmp_path, a_obj=obj, a_mtl=mtl))) == UPRIGHT


def test_kd(tmp_path):
    def found(lines, picture_too=False):
        mtl = f"newmtl m\n{lines}\n" + ("map_Kd p.png\n" if picture_too else "")
        scene = load(write(tmp_path, a_obj=TEXTURED, a_mtl=mtl, p_png=picture()))
        return quarters(scene)[0], scene.notes

    assert found("Kd 0 1 0") == (GREEN, ())
    assert found("Kd 0 1 0 # green") == (GREEN, ())
    assert found("\tKd\t0\t1\t0") == (GREEN, ())
    assert found("Kd 1")[0] == WHITE and found("Kd 0.2")[0] == (51, 51, 51)
    assert found("Kd 0 0 0", picture_too=True) == (RED, ())
    assert found("Kd 0 0 0\nKe 0 0 1")[0] == BLUE
    assert found("Kd 0 0 0\nKe 1 1 1\nmap_Ke p.png")[0] == RED
    assert found("Ke 0 0 1")[0] == WHITE
    color, notes = found("Kd spectral wall.rfl")
    assert color == WHITE and "is no colour and is not read" in notes[0]


def test_gazebo_layout_needs_an_explicit_root(tmp_path):
    (tmp_path / "model" / "meshes").mkdir(parents=True)
    (tmp_path / "model" / "materials").mkdir()
    (tmp_path / "model" / "materials" / "p.png").write_bytes(picture())
    mesh = tmp_path / "model" / "meshes" / "a.obj"
    mesh.write_text(TEXTURED)
    (mesh.parent / "a.mtl").write_text("newmtl m\nKd 0 1 1\nmap_Kd ../materials/p.png\n")
    scene = load(mesh)
    assert quarters(scene) == ((0, 255, 255),) * 4
    (note,) = scene.notes
    assert "'../materials/p.png' lies outside the mesh's folder and is not read" in note and "--data-root DIR" in note
    wanted = tuple(tuple(np.array(c) * np.array([0, 1, 1])) for c in UPRIGHT)
    assert quarters(load(mesh, tmp_path / "model")) == wanted
    assert load(mesh, tmp_path / "elsewhere").notes == scene.notes
    (tmp_path / "model" / ".prnav-root").touch()
    assert quarters(load(mesh)) == wanted and not load(mesh).notes


@pytest.mark.parametrize("name", ["gone.png", "../gone.png", "/gone.png", "https://a.b/gone.png", "a" * 300 + ".png"])
def test_a_missing_picture_refuses_no_mesh(tmp_path, name):
    scene = load(write(tmp_path, a_obj=TEXTURED, a_mtl=f"newmtl m\nKd 1 0 0\nmap_Kd {name}\n"))
    assert quarters(scene) == (RED,) * 4 and "what it colours stays plain" in scene.notes[0]


def test_unknown_materials_and_free_form_surfaces_are_noted(tmp_path):
    scene = load(write(tmp_path, a_obj=SQUARE + "usemtl x\nf 1 2 3 4\nusemtl y\nf 1 2 3\nsurf 0 1 0 1 1 2 3 4\n"))
    assert scene.notes == (
        "1 free-form curves and surfaces are not read",
        "materials 'x' and 1 more are used and no material file is named, their surfaces are white",
    )
    for name in ("", " (null)"):
        load(write(tmp_path, a_obj=SQUARE + f"usemtl{name}\nf 1 2 3 4\n"))


def test_a_polygon_of_too_many_corners_is_refused(tmp_path):
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf " + "1 2 3 " * 4000 + "\n"
    with pytest.raises(SceneError, match=r"a\.obj: line 4, a polygon of 12000 corners; at most 10000 are taken"):
        load(write(tmp_path, a_obj=text))


def test_yellow_is_where_it_should_be(tmp_path):
    assert quarters(load(write(tmp_path, a_obj=TEXTURED, a_mtl=MTL, p_png=picture())))[3] == YELLOW
