//! PLY as users have it: other programs' files in, ours out and in again, and broken ones refused with a reason.

use glam::Vec3;
use mesh::ply::{PlyError, read, write};
use mesh::{Mesh, ply};

fn colored_tetrahedron() -> Mesh {
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(0.1, -2.5, 3e-7)];
    Mesh {
        normals: positions.iter().map(|p| p.normalize_or(Vec3::Z)).collect(),
        colors: vec![[255, 0, 7], [0, 128, 255], [1, 2, 3], [254, 255, 0]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
        positions,
    }
}

#[test]
fn what_is_written_is_read_again_bit_by_bit() {
    let whole = colored_tetrahedron();
    let bare = Mesh {
        normals: Vec::new(),
        colors: Vec::new(),
        ..whole.clone()
    };
    let cloud = Mesh {
        triangles: Vec::new(),
        ..whole.clone()
    };
    for mesh in [whole, bare, cloud, Mesh::default()] {
        assert_eq!(read(&write(&mesh)).unwrap(), mesh);
    }
}

const TEXT: &str = "ply\r
format ascii 1.0\r
comment made by hand, with Windows line ends\r
element vertex 5\r
property double x\r
property double y\r
property float z\r
property float quality\r
property ushort red\r
property ushort green\r
property ushort blue\r
element material 1\r
property list uchar float shine\r
element face 2\r
property uchar flags\r
property list uchar int vertex_index\r
end_header\r
0 0 0 9.5 65535 0 257\r
1 0 0 9.5 0 0 0\r
1 1 0 9.5 0 0 0\r
\r
0 1 1e-1 9.5 0 0 0\r
-.5 .5 0 9.5 0 0 0\r
3 0.1 0.2 0.3\r
7 5 0 1 2 3 4\r
7 2 0 1\r
";

#[test]
fn text_with_polygons_and_unknown_properties() {
    let mesh = read(TEXT.as_bytes()).unwrap();
    assert_eq!(mesh.positions.len(), 5);
    assert_eq!(mesh.positions[3], Vec3::new(0.0, 1.0, 0.1));
    assert_eq!(mesh.positions[4], Vec3::new(-0.5, 0.5, 0.0));
    assert_eq!(mesh.colors[0], [255, 0, 1]);
    assert!(mesh.normals.is_empty());
    // The five-cornered face is a fan, the two-cornered one is no face.
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
}

#[test]
fn big_endian_doubles_and_float_colours() {
    let mut file = b"ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty double x\n\
        property double y\nproperty double z\nproperty float nx\nproperty float ny\nproperty float nz\n\
        property float red\nproperty float green\nproperty float blue\nelement face 1\n\
        property list ushort uint vertex_indices\nend_header\n"
        .to_vec();
    for x in [0.25_f64, 1.5, -2.0] {
        file.extend([x, 1.0, 2.0].iter().flat_map(|v| v.to_be_bytes()));
        let rest = [0.0_f32, f32::NAN, 1.0, 1.0, 0.5, 0.0];
        file.extend(rest.iter().flat_map(|v| v.to_be_bytes()));
    }
    file.extend(3_u16.to_be_bytes());
    file.extend([2_u32, 1, 0].iter().flat_map(|v| v.to_be_bytes()));
    let mesh = read(&file).unwrap();
    assert_eq!(mesh.positions[2], Vec3::new(-2.0, 1.0, 2.0));
    assert_eq!(mesh.colors[0], [255, 128, 0]);
    assert_eq!(
        mesh.normals[0],
        Vec3::ZERO,
        "a normal that is not finite is unknown"
    );
    assert_eq!(mesh.triangles, [[2, 1, 0]]);
}

/// The message for `text` with one passage replaced.
fn message(from: &str, to: &str) -> String {
    assert!(TEXT.contains(from), "{from}");
    let text = TEXT.replacen(from, to, 1);
    read(text.as_bytes()).map_or_else(|error| error.to_string(), |mesh| format!("{mesh:?}"))
}

#[test]
fn errors_say_where_and_what() {
    let cases = [
        (
            "ply\r",
            "plx\r",
            "not a PLY file: expected the first line to be \"ply\"",
        ),
        (
            "ascii 1.0",
            "binary 1.0",
            "line 2: expected ascii, binary_little_endian or",
        ),
        (
            "vertex 5",
            "vertex five",
            "line 4: expected \"element\", a name and a count, found \"element vertex five\"",
        ),
        (
            "property double y",
            "property real y",
            "line 6: expected number types and a name",
        ),
        (
            "list uchar float",
            "list float",
            "line 13: expected number types and a name",
        ),
        (
            "end_header",
            "end",
            "line 17: expected format, comment, element",
        ),
        (
            "1 1 0 9.5",
            "1 one 0 9.5",
            "line 20, vertex 2: expected a number for \"y\", found \"one\"",
        ),
        (
            "1 0 0 9.5 0 0 0",
            "1 0",
            "line 19, vertex 1: expected a number for \"z\", found end of line",
        ),
        (
            "1 0 0 9.5 0",
            "1 0 0 9.5 .5",
            "line 19, vertex 1: expected a whole number for \"red\", found \".5\"",
        ),
        (
            "1 1 0 9.5",
            "inf 1 0 9.5",
            "vertex 2: expected a finite position, found (inf, 1, 0)",
        ),
        (
            "5 0 1 2 3 4",
            "5 0 1 2 3 5",
            "face 0: expected vertex indices from 0 to 4, found 5",
        ),
        ("5 0 1 2 3 4", "5 0 1 2 3 -1", "found -1"),
        (
            "7 2 0 1\r\n",
            "",
            "expected 2 of element \"face\", the file ends within number 1",
        ),
        (
            "property float z",
            "property float h",
            "lacks the properties x, y and z",
        ),
        (
            "vertex_index",
            "corner_list",
            "lacks the list vertex_indices",
        ),
        ("element face", "element tristrips", "triangle strips"),
        (
            "element vertex",
            "element points",
            "there are faces but no element \"vertex\"",
        ),
    ];
    for (from, to, expected) in cases {
        let found = message(from, to);
        assert!(found.contains(expected), "{from} -> {to}: {found}");
    }
}

#[test]
fn a_file_cut_off_anywhere_is_an_error_and_never_a_panic() {
    for file in [write(&colored_tetrahedron()), TEXT.as_bytes().to_vec()] {
        // The last line of a text may lack its end, and a cut inside its last number cannot be seen.
        for length in 0..file.len() - 3 {
            assert!(read(&file[..length]).is_err(), "{length} of {}", file.len());
        }
    }
}

#[test]
fn a_false_count_costs_neither_memory_nor_time() {
    let head = "ply\nformat binary_little_endian 1.0\n";
    let vertices = "element vertex 18446744073709551615\nproperty float x\nproperty float y\nproperty float z\n";
    let error = read(format!("{head}{vertices}end_header\n1234").as_bytes()).unwrap_err();
    assert!(
        matches!(error, PlyError::Truncated { found: 0, .. }),
        "{error}"
    );
    let nothing = format!("{head}element nothing 18446744073709551615\nend_header\n");
    assert_eq!(read(nothing.as_bytes()).unwrap(), Mesh::default());
    let list = "element face 1\nproperty list uint int vertex_indices\nend_header\n";
    let mut list = format!("{head}{list}").into_bytes();
    list.extend(u32::MAX.to_le_bytes());
    assert!(matches!(ply::read(&list), Err(PlyError::Truncated { .. })));
}
