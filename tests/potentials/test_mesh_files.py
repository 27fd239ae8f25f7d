"""Files of meshes: what they hold is read, and what is damaged or hostile is refused in plain words."""

import contextlib
import io
import json
import struct
import tracemalloc

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.potentials.meshes.readers import glb as glb_reader
from fieldsim.potentials.meshes.readers import read as readers

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]], dtype=float)
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def stl(corners=CORNERS, faces=FACES, header=b""):
    rows = np.zeros(len(faces), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    rows["corners"] = corners[faces]
    return header.ljust(80, b"\0") + struct.pack("<I", len(faces)) + rows.tobytes()


def stl_text(end="endsolid a rock\n"):
    facets = "".join(
        "facet normal 0 0 0\n outer loop\n"
        + "".join(f"  vertex {x:g} {y:g} {z:g}\n" for x, y, z in CORNERS[face])
        + " endloop\nendfacet\n"
        for face in FACES
    )
    return f"solid a rock\n{facets}{end}".encode()


def obj(faces=FACES):
    rows = ["# made by hand", "mtllib ../../etc/passwd", "usemtl http://example.com/a.png"]
    rows += [f"v {x} {y} {z} 1.0" for x, y, z in CORNERS] + ["vt 0 0", "vn 0 0 1", "o a", "s off", "l 1 2"]
    return "\n".join(rows + [f"f {a + 1}/1/1 {b + 1}//1 {c - 4} # a face" for a, b, c in faces]).encode()


def off(head="OFF\n4 4 0"):
    rows = [f"{x} {y} {z}" for x, y, z in CORNERS] + [f"3 {a} {b} {c} 255 0 0" for a, b, c in FACES]
    return "\n".join([head, "# a comment", *rows, ""]).encode()


PLY_HEAD = """ply
format {form} 1.0
comment by hand
element thing 2
property list uchar short numbers
property uchar alone
element vertex {vertices}
property uchar red
property double x
property double y
property double z
element face {faces}
property list uchar int vertex_indices
end_header
"""


def ply(form="ascii", vertices=4, faces=4, quads=()):
    head = PLY_HEAD.format(form=form, vertices=vertices, faces=faces + len(quads)).encode()
    polygons = [*FACES.tolist(), *quads]
    if form == "ascii":
        rows = ["1 7 1", "2 7 8 1"] + [f"3 {x} {y} {z}" for x, y, z in CORNERS]
        rows += [" ".join(map(str, (len(p), *p))) for p in polygons]
        return head + "\n".join([*rows, ""]).encode()
    order = {"binary_little_endian": "<", "binary_big_endian": ">"}[form]
    body = struct.pack(f"{order}BhBBhhB", 1, 7, 1, 2, 7, 8, 1)
    body += b"".join(struct.pack(f"{order}B3d", 3, *row) for row in CORNERS)
    return head + body + b"".join(struct.pack(f"{order}B{len(p)}i", len(p), *p) for p in polygons)


def glb(change=lambda tree: None, content=None, corners=CORNERS):
    content = corners.astype("<f4").tobytes() + FACES.astype("<u2").tobytes() if content is None else content
    tree = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}, {"mode": 0, "attributes": {}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 24},
        ],
        "buffers": [{"byteLength": len(content)}],
    }
    change(tree)
    text = json.dumps(tree).encode()
    chunks = b"".join(struct.pack("<I4s", len(d), k) + d for k, d in ((b"JSON", text), (b"BIN\0", content)))
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


SOUND = {
    "binary.stl": stl(),
    "solid in a binary.stl": stl(header=b"solid"),
    "text.stl": stl_text(),
    "a.obj": obj(),
    "marked.obj": b"\xef\xbb\xbf" + obj()[obj().index(b"v ") :],
    "a.off": off(),
    "one line.off": off("COFF 4 4 0"),
    "text.ply": ply(),
    "little.ply": ply("binary_little_endian"),
    "big.ply": ply("binary_big_endian"),
    "a.glb": glb(),
    "UPPER.STL": stl(),
}


def read(tmp_path, name, data):
    path = tmp_path / name
    path.write_bytes(data)
    return fs.mesh(path)


@pytest.mark.parametrize("name", SOUND)
def test_what_a_file_holds(tmp_path, name):
    found = read(tmp_path, name, SOUND[name])
    right = fs.mesh(CORNERS, FACES)
    assert len(found.vertices) == 4
    assert sorted(map(sorted, found.corners.tolist())) == sorted(map(sorted, right.corners.tolist()))
    assert found.volume == pytest.approx(1.0)


@pytest.mark.parametrize("kind", ["stl", "stl_ascii", "obj", "ply", "off", "glb"])
def test_as_trimesh_reads_them(tmp_path, kind):
    trimesh = pytest.importorskip("trimesh")
    path = tmp_path / f"a.{kind.removesuffix('_ascii')}"
    trimesh.creation.icosphere(1).export(path, file_type=kind)
    theirs = trimesh.load(path, force="mesh", process=False)
    vertices, faces = readers.read(str(path))
    np.testing.assert_array_equal(vertices[faces], np.asarray(theirs.vertices)[theirs.faces])


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
def test_polygons_are_fans(tmp_path, form):
    data = ply(form, faces=4, quads=[[0, 1, 2, 3]])
    (tmp_path / "a.ply").write_bytes(data)
    _, faces = readers.read(str(tmp_path / "a.ply"))
    assert faces[4:].tolist() == [[0, 1, 2], [0, 2, 3]]


def test_a_scene_is_one_mesh(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.Scene()
    place = trimesh.transformations.rotation_matrix(0.3, (1, 2, 3))
    place[:3, 3] = 5, 6, 7
    scene.add_geometry(trimesh.creation.box(), transform=place)
    scene.add_geometry(trimesh.creation.icosphere(1), transform=np.diag([-1.0, 2.0, 1.0, 1.0]))
    stream = io.BytesIO(scene.export(file_type="glb"))
    theirs = trimesh.load(stream, file_type="glb", force="mesh", process=False)
    found = read(tmp_path, "a.glb", stream.getvalue())
    assert (found.volume, found.area) == pytest.approx((theirs.volume, theirs.area), rel=1e-6)


def test_turns_scales_and_places_of_nodes(tmp_path):
    half = np.sqrt(0.5)

    def change(tree):
        tree["nodes"] = [
            {"children": [1], "translation": [10, 0, 0], "rotation": [0, 0, half, half]},
            {"mesh": 0, "scale": [2, 1, 1]},
        ]

    found = read(tmp_path, "a.glb", glb(change))
    right = np.stack([10 - CORNERS[:, 1], 2 * CORNERS[:, 0], CORNERS[:, 2]], axis=1)
    np.testing.assert_allclose(np.unique(found.vertices.round(5), axis=0), np.unique(right, axis=0), atol=1e-5)


def changed(**kinds):
    """A GLB with other entries: accessors=(0, {...}) changes the first accessor."""

    def change(tree):
        for kind, (number, entries) in kinds.items():
            tree[kind][number] |= entries

    return glb(change)


def many(tree):
    tree["nodes"] = [{"mesh": 0}] * 10
    tree["scenes"] = [{"nodes": [1] * 10}]


BAD = {
    "empty.stl": (b"", "at least 84 bytes, it has 0"),
    "torn.stl": (bytes(80) + (1000).to_bytes(4, "little") + bytes(120), "1000 triangles, which take 50084 bytes, but"),
    "longer.stl": (stl() + b"\0", r"4 triangles, which take 284 bytes, but it has 285"),
    "bomb.stl": (bytes(80) + b"\xff" * 4 + bytes(50), "4294967295 triangles"),
    "torn text.stl": (stl_text()[:-200], "is cut off"),
    "endless text.stl": (stl_text(end=""), "is cut off"),
    "blank.stl": (b"solid" + b" \n" * 200_000, "is cut off"),
    "nan.stl": (stl(CORNERS * [1, 1, np.nan]), r"its vertex 0 is \(0\.0, 0\.0, nan\)"),
    "index.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99\n", r"its face 0 is \[0, 1, 98\].*there are 3 vertices"),
    "zero.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "its line 4 is no face: '0 1 2'"),
    "back.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "its line 4 is no face: '1 2 -4'"),
    "two.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "its line 4 is no face: '1 2'"),
    "flat.obj": (b"v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n", "its vertex 1, counted from 0, has 2 coordinates"),
    "words.obj": (b"v a b c\nf 1 1 1\n", "damaged, or no OBJ"),
    "empty.obj": (b"", "there are no faces"),
    "degenerate.obj": (b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", r"faces\[0\] is .* without area"),
    "huge.obj": (b"v 0 0 0\nv 1e200 0 0\nv 0 1 0\nf 1 2 3\n", "give coordinates of at most 1e"),
    "text.off": (b"hello", "does not begin with OFF"),
    "bomb.off": (b"OFF\n999999999999 1 0\n0 0 0\n", "should hold 999999999999 vertices, but has lines for 1"),
    "negative.off": (b"OFF\n-1 1 0\n0 0 0\n", "should hold -1 vertices"),
    "torn.off": (off()[:-20], "should hold 4 faces, but has lines for 3"),
    "longer.off": (off() + b"3 0 1 2\n", "more than it says"),
    "list.off": (b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n9999999999 0 1 2\n", "a list of 9999999999 numbers in a line of 4"),
    "noheader.ply": (b"0 0 0\n1 0 0\n", "has no header of a PLY"),
    "bomb.ply": (ply(vertices=10**15), "should hold 1000000000000000 elements 'vertex'"),
    "big bomb.ply": (ply("binary_big_endian", vertices=10**15), "should hold 1000000000000000 elements 'vertex'"),
    "negative.ply": (ply("binary_big_endian", vertices=-4), "should hold -4 elements 'vertex'"),
    "fewer.ply": (ply("binary_little_endian", faces=3), "more than it says"),
    "fewer text.ply": (ply(faces=3), "more than it says"),
    "torn.ply": (ply("binary_little_endian")[:-5], "should hold 4 elements 'face'|beyond its end"),
    "index.ply": (ply().replace(b"3 0 1 3", b"3 0 1 7"), r"its face 1 is \[0, 1, 7\].*there are 4 vertices"),
    "strips.ply": (ply().replace(b"element face", b"element tristrips"), "strips of triangles"),
    "floats.ply": (ply().replace(b"uchar int", b"uchar float"), "its vertex_indices are no whole numbers"),
    "kind.ply": (ply().replace(b"double y", b"quad y"), "damaged, or no PLY"),
    "flat.ply": (ply().replace(b"double z", b"double w"), "damaged, or no PLY"),
    "form.ply": (ply(form="ascii").replace(b"format ascii", b"format gzip"), "damaged, or no PLY"),
    "text.glb": (b"no such thing", "is no GLB of version 2"),
    "torn.glb": (glb()[:-3], r"should have \d+ bytes, but has \d+"),
    "uri.glb": (changed(buffers=(0, {"uri": "../secret.bin"})), "in another file; save it in one"),
    "net.glb": (changed(buffers=(0, {"uri": "http://example.com/a.bin"})), "in another file; save it in one"),
    "second buffer.glb": (changed(bufferViews=(0, {"buffer": 1})), "in another file"),
    "bomb.glb": (changed(accessors=(0, {"count": 10**12})), "should hold 1000000000000 rows"),
    "still bomb.glb": (
        changed(accessors=(0, {"count": 10**12}), bufferViews=(0, {"byteStride": 0})),
        "of an unknown kind",
    ),
    "zeros.glb": (changed(accessors=(0, {"bufferView": None})), "damaged|asks for bufferViews"),
    "sparse.glb": (changed(accessors=(0, {"sparse": {}})), "leaves out numbers that are zero"),
    "before.glb": (changed(bufferViews=(0, {"byteOffset": -48})), "ends before"),
    "index.glb": (glb(content=CORNERS.astype("<f4").tobytes() + b"\xff\xff" * 12), "its face 0 is .*65535"),
    "node.glb": (changed(scenes=(0, {"nodes": [7]})), "asks for nodes 7 of 1"),
    "last.glb": (changed(scenes=(0, {"nodes": [-1]})), "asks for nodes -1 of 1"),
    "cycle.glb": (changed(nodes=(0, {"children": [0]})), "its node 0 is in two places"),
    "twice.glb": (glb(many), "its node 1 is in two places"),
    "scale.glb": (changed(nodes=(0, {"rotation": [9, 9, 9, 9]})), "no unit quaternion"),
    "bent.glb": (changed(meshes=(0, {"weights": [0.5]})), "is bent by the weights"),
    "short view.glb": (changed(bufferViews=(0, {"byteLength": 12})), "ends before"),
    "copies.glb": (glb(lambda tree: tree.update(extensionsUsed=["EXT_mesh_gpu_instancing"])), "needs EXT_mesh_gpu"),
    "packed.glb": (glb(lambda tree: tree.update(extensionsRequired=["EXT_meshopt_compression"])), "needs EXT_meshopt"),
    "strips.glb": (changed(meshes=(0, {"primitives": [{"mode": 5, "attributes": {"POSITION": 0}}]})), "strips"),
    "deep.glb": (struct.pack("<4sIII4s", b"glTF", 2, 100020, 100000, b"JSON") + b"[" * 100000, "damaged, or no GLB"),
    "a.gltf": (b"{}", r"should end in one of \.stl, \.obj"),
    "a.zip": (b"PK\3\4", r"should end in one of \.stl, \.obj"),
    "a.pickle": (b"cos\nsystem\n(S'touch ran'\ntR.", r"should end in one of \.stl, \.obj"),
    "stl": (b"", r"should end in one of \.stl, \.obj"),
}


@pytest.mark.parametrize("name", BAD)
def test_unsound_files_are_refused_in_plain_words(tmp_path, name):
    data, words = BAD[name]
    with pytest.raises(fs.InputError, match=rf"mesh: '.*{name}'.*({words})"):
        read(tmp_path, name, data)


def test_a_part_that_is_shown_again_and_again_has_its_limit(tmp_path, monkeypatch):
    def change(tree):
        tree["nodes"] = [{"mesh": 0} for _ in range(10)]
        tree["scenes"] = [{"nodes": list(range(10))}]

    (tmp_path / "a.glb").write_bytes(glb(change))
    assert len(readers.read(str(tmp_path / "a.glb"))[1]) == 40
    monkeypatch.setattr(glb_reader, "MOST_TRIANGLES", 39)
    with pytest.raises(fs.InputError, match="shows more than 39 triangles"):
        fs.mesh(tmp_path / "a.glb")


@pytest.mark.parametrize("part", [{"mode": 1}, {"attributes": {"POSITION": 0}, "indices": 1}])
def test_parts_without_triangles_have_a_limit_too(tmp_path, monkeypatch, part):
    def change(tree):
        tree["accessors"][1]["count"] = 0
        tree["meshes"] = [{"primitives": [part] * 10}]
        tree["nodes"] = [{"mesh": 0} for _ in range(10)]
        tree["scenes"] = [{"nodes": list(range(10))}]

    monkeypatch.setattr(glb_reader, "MOST_PARTS", 99)
    (tmp_path / "a.glb").write_bytes(glb(change))
    with pytest.raises(fs.InputError, match="shows more than 99 parts"):
        fs.mesh(tmp_path / "a.glb")


@pytest.mark.parametrize("name", SOUND)
def test_damage_ends_in_plain_words_or_a_mesh(tmp_path, name):
    """Whatever single bytes say, nothing raw is raised, nothing is warned of and little memory is taken."""
    rng = np.random.default_rng(3)
    whole = np.frombuffer(SOUND[name], np.uint8)
    tracemalloc.start()
    for _ in range(100):
        bad = whole.copy()
        bad[rng.integers(0, len(bad), rng.integers(1, 6))] = rng.integers(0, 256)
        with contextlib.suppress(fs.InputError):
            read(tmp_path, name, bad[: rng.integers(1, 2 * len(bad))].tobytes())
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 10_000_000


def test_files_that_cannot_be_opened(tmp_path):
    for path, words in [(tmp_path, "there is no file"), ("a\0b.stl", "give the path"), ("no/such.stl", "there is no")]:
        with pytest.raises(fs.InputError, match=words):
            fs.mesh(path)
