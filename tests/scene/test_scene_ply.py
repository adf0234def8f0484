"""PLY files as people have them: each case with its right value, found by hand."""

import struct

import numpy as np
import pytest
from mesh_cases import BLUE, GREEN, QUARTERS, RED, UPRIGHT, WHITE, area, load, picture, quarters, write

from prnav.errors import SceneError

XYZ = ["property float x", "property float y", "property float z"]
SQUARE = ["-1 -1 0", "1 -1 0", "1 1 0", "-1 1 0"]
LIST = "property list uchar int vertex_indices"


def ply(vertex=(), vertices=SQUARE, face=(LIST,), faces=("4 0 1 2 3",), comments=(), ends="\n", name="face"):
    """An ASCII PLY; ``vertex`` and ``face`` are property lines besides x, y and z."""
    header = ["ply", "format ascii 1.0", *comments, f"element vertex {len(vertices)}", *XYZ, *vertex]
    header += [f"element {name} {len(faces)}", *face, "end_header"]
    return ends.join([*header, *vertices, *faces, ""])


def with_colors(values, names=("red", "green", "blue"), kind="uchar"):
    properties = [f"property {kind} {name}" for name in names]
    return {"vertex": properties, "vertices": [f"{row} {values}" for row in SQUARE]}


@pytest.mark.parametrize("ends", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_line_ends(tmp_path, ends, form):
    text = ply(**with_colors("10 0 0"), ends=ends).encode()
    if form != "ascii":  # the body starts with a line feed
        order = "<" if "little" in form else ">"
        head = text[: text.index(b"end_header")] + b"end_header" + ends.encode()
        text = head.replace(b"ascii", form.encode()).replace(b"property float x", b"property uchar x", 1)
        rows = [
            struct.pack(order + "BffBBB", 10 + (x > 0), y, 0, 255, 0, 0)
            for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
        text += b"".join(rows) + struct.pack(order + "Biiii", 4, 0, 1, 2, 3)
    scene = load(write(tmp_path, a_ply=text))
    if form == "ascii":
        assert area(scene) == 4.0 and set(map(tuple, scene.colors.tolist())) == {(10, 0, 0)}
    else:
        assert area(scene) == 2.0 and scene.bounds[:, 0].tolist() == [10, 11] and (scene.colors == RED).all()


def test_headers(tmp_path):
    text = ply(comments=["comment made by hand", "obj_info num_cols 4", "comment", ""])
    assert area(load(write(tmp_path, a_ply=text))) == 4.0
    assert area(load(write(tmp_path, a_ply=text.replace("end_header\n", "end_header\n\n\n")))) == 4.0
    spaced = text.replace("element vertex 4", "element  vertex\t4  ").replace("ply\n", "ply  \n", 1)
    assert area(load(write(tmp_path, a_ply=spaced))) == 4.0
    assert area(load(write(tmp_path, a_ply=text.replace("by hand", "à la main").encode("latin-1")))) == 4.0
    for old, new, problem in (
        ("format ascii 1.0\n", "", "no format line"),
        ("format ascii", "format text", "'format text 1.0' is not format ascii or"),
        ("property float x", "property quad x", "'property quad x' is not property TYPE NAME"),
        ("list uchar", "list float", "is not property TYPE NAME or property list COUNT_TYPE TYPE NAME"),
        ("element face 1", "element vertex 1", "two elements of one name"),
        ("element face 1", "element face many", "'element face many' is not element NAME COUNT"),
        ("property float x", "property float w", "no vertices with x, y and z"),
        ("element face", "what is this\nelement face", "'what is this' is not format, element"),
        ("int vertex_indices", "int corners", "its face element has no list vertex_indices or vertex_index"),
        ("4 0 1 2 3", "4 0 1 2 4", "a face refers to vertex 4, valid are 0..3"),
        ("4 0 1 2 3", "4 0 1 2 -1", "a face refers to vertex -1, valid are 0..3"),
        ("4 0 1 2 3", "4 0 1 2 1.5", "a face refers to vertex 1.5, valid are 0..3"),
        ("4 0 1 2 3", "4 0 1 2", "face 0 of 1 has a list of a wrong length, or is cut off"),
        ("4 0 1 2 3", "-4 0 1 2 3", "face 0 of 1 has a list of a wrong length, or is cut off"),
        ("4 0 1 2 3", "4 0 1 2 3 9", "its body has 18 numbers where its PLY header describes 17"),
        ("-1 1 0", "-1 up 0", "'up' stands where a number is needed"),
    ):
        with pytest.raises(SceneError, match=r"scene .*a\.ply: ") as caught:
            load(write(tmp_path, a_ply=text.replace(old, new)))
        assert problem in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "names", [("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b")]
)
@pytest.mark.parametrize(
    ("kind", "values"),
    [
        ("uchar", "255 0 0"), ("uint8", "255 0 0"), ("char", "-1 0 0"), ("short", "255 0 0"), ("ushort", "65535 0 0"),
        ("ushort", "255 0 0"), ("int", "255 0 0"), ("uint", "4294967295 0 0"), ("float", "1 0 0"), ("float", "255 0 0"),
        ("double", "1.0 0 0"), ("float", "1.0000001 0 0"),
    ],
)  # fmt: skip
def test_colours_of_vertices_and_faces(tmp_path, names, kind, values):
    assert quarters(load(write(tmp_path, a_ply=ply(**with_colors(values, names, kind))))) == (RED,) * 4
    face = [LIST, *(f"property {kind} {name}" for name in names)]
    for faces in (["3 0 1 2", "3 0 2 3"], ["4 0 1 2 3"], ["5 0 1 2 3 3"]):
        text = ply(face=face, faces=[f"{row} {values}" for row in faces])
        assert quarters(load(write(tmp_path, a_ply=text))) == (RED,) * 4


def test_colours_are_multiplied(tmp_path):
    vertex = [f"property uchar {name}" for name in ("red", "green", "blue", "alpha")] + [
        "property float s",
        "property float t",
    ]
    rows = [f"{row} 255 255 0 7 {uv}" for row, uv in zip(SQUARE, ("0 0", "1 0", "1 1", "0 1"), strict=True)]
    face = [LIST, *(f"property float {name}" for name in ("red", "green", "blue"))]
    text = ply(vertex, rows, face, ["4 0 1 2 3 1 0.4 1"], ["comment TextureFile p.png"])
    found = quarters(load(write(tmp_path, a_ply=text, p_png=picture())))
    assert found == ((255, 0, 0), (0, 102, 0), (0, 0, 0), (255, 102, 0))


@pytest.mark.parametrize("names", [("s", "t"), ("u", "v"), ("texture_u", "texture_v")])
def test_vertex_colours_with_texture_coordinates_and_no_picture(tmp_path, names):
    vertex = [
        *(f"property float {name}" for name in names),
        *(f"property uchar {name}" for name in ("red", "green", "blue")),
    ]
    rows = [f"{row} {uv} 255 0 0" for row, uv in zip(SQUARE, ("0 0", "1 0", "1 1", "0 1"), strict=True)]
    assert quarters(load(write(tmp_path, a_ply=ply(vertex, rows)))) == (RED,) * 4
    scene = load(write(tmp_path, a_ply=ply(vertex, rows, comments=["comment TextureFile gone.png"])))
    assert quarters(scene) == (RED,) * 4
    assert scene.notes[0] == "'gone.png' is missing, what it colours stays plain"
    text = ply(vertex, [row.replace("255 0 0", "255 255 255") for row in rows], comments=["comment TextureFile p.png"])
    assert quarters(load(write(tmp_path, a_ply=text, p_png=picture()))) == UPRIGHT


def test_several_pictures(tmp_path):
    face = [LIST, "property list uchar float texcoord", "property int texnumber"]
    uv = "8 0 0 1 0 1 1 0 1"
    faces = [
        f"4 0 1 2 3 {uv} 0",
        f"4 4 5 6 7 {uv} 1",
        f"4 8 9 10 11 {uv} -1",
        "4 12 13 14 15 0 1",
        f"4 12 13 14 15 {uv} 2",
    ]
    vertices = [f"{x} {y} {z}" for z in range(4) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    files = {"p_png": picture(), "q_png": picture(QUARTERS[::-1])}
    text = ply(
        face=face, vertices=vertices, faces=faces, comments=["comment TextureFile p.png", "comment TextureFile q.png"]
    )
    scene = load(write(tmp_path, a_ply=text, **files))
    heights = scene.vertices[scene.faces][:, :, 2]
    pictures = {z: set(scene.face_texture[(heights == z).all(axis=1)].tolist()) for z in range(4)}
    assert pictures[0] == {1} and pictures[1] == {2} and pictures[2] == pictures[3] == {0}
    assert np.array_equal(scene.atlas.image(2)[..., :3], QUARTERS[::-1])
    assert scene.notes == (
        "2 triangles name a picture beyond the 2 that it names, they show their colour alone",
        "2 triangles have a picture and no texture coordinates, they show their colour alone",
    )
    with pytest.raises(SceneError, match="face 0 has 4 corners and 6 numbers of texture coordinates"):
        load(write(tmp_path, a_ply=ply(face=face, faces=["4 0 1 2 3 6 0 0 1 0 1 1 0"]), **files))


def test_quad_with_face_texture_coordinates(tmp_path):
    text = ply(
        face=[LIST, "property list uchar float texcoord"],
        faces=["4 0 1 2 3 8 0 0 1 0 1 1 0 1"],
        comments=["comment TextureFile p.png"],
    )
    assert quarters(load(write(tmp_path, a_ply=text, p_png=picture()))) == UPRIGHT


def test_strips(tmp_path):
    def strip(*lists):
        scene = load(
            write(tmp_path, a_ply=ply(face=["property list int int vertex_indices"], faces=lists, name="tristrips"))
        )
        a, b, c = (scene.vertices[scene.faces[:, k]] for k in range(3))
        assert (np.cross(b - a, c - a)[:, 2] > 0).all()
        return area(scene)

    assert strip("4 0 1 3 2") == 4.0
    assert strip("3 0 1 2", "3 0 2 3") == 4.0
    assert strip("7 0 1 2 -1 0 2 3") == 4.0
    assert strip("9 -1 0 1 3 2 -1 -1 0 1") == 4.0
    assert strip("6 0 1 3 2 2 2") == 4.0


def test_elements_and_properties_that_nobody_knows(tmp_path):
    header = ["ply", "format ascii 1.0", "element thing 2", "property list uchar float values", "property int k"]
    header += ["element face 1", LIST, "property float heat", "element vertex 4", *XYZ, "property float nx"]
    header += ["property float glow", "element tail 1", "property int end", "end_header"]
    rows = ["3 1 2 3 7", "0 8", "4 0 1 2 3 0.5", *(f"{row} 0 1" for row in SQUARE), "9"]
    scene = load(write(tmp_path, a_ply="\n".join([*header, *rows])))
    assert area(scene) == 4.0 and scene.notes == (
        "elements not read: tail, thing",
        "properties of faces not read: heat",
        "properties of vertices not read: glow",
    )


def test_concave_polygons_in_binary_of_mixed_sizes(tmp_path):
    outline = [(0, 0), (0, 6), (8, 6), (8, 0), (6, 0), (6, 4), (2, 4), (2, 0)]
    header = ["ply", "format binary_big_endian 1.0", "element vertex 8", *XYZ, "element face 3"]
    header += [
        "property uchar flags",
        "property list ushort uchar vertex_index",
        "property short tail",
        "end_header",
        "",
    ]
    body = b"".join(struct.pack(">fff", x, y, 0) for x, y in outline)
    for corners in (range(8), (0, 1, 2), (0, 2, 4, 7)):
        body += struct.pack(f">BH{len(corners)}Bh", 1, len(corners), *corners, -1)
    scene = load(write(tmp_path, a_ply="\n".join(header).encode() + body))
    assert area(scene) == pytest.approx(32 + 24 + 18)
    assert len(scene.faces) == 6 + 1 + 2


def test_faces_of_too_few_corners_are_noted(tmp_path):
    scene = load(write(tmp_path, a_ply=ply(faces=["4 0 1 2 3", "2 0 1", "0"])))
    assert area(scene) == 4.0 and scene.notes == ("2 faces of fewer than 3 corners are left out",)
    assert quarters(scene) == (WHITE,) * 4


def test_left_red_right_blue(tmp_path):
    vertices = ["-1 -1 0", "0 -1 0", "0 1 0", "-1 1 0", "1 -1 0", "1 1 0"]
    face = [LIST, *(f"property uchar {name}" for name in ("red", "green", "blue"))]
    scene = load(
        write(tmp_path, a_ply=ply(vertices=vertices, face=face, faces=["4 0 1 2 3 255 0 0", "4 1 4 5 2 0 0 255"]))
    )
    assert quarters(scene) == (RED, BLUE, RED, BLUE)
    assert GREEN not in set(map(tuple, scene.colors.tolist()))
