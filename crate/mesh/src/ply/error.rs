//! What can be wrong with a PLY file, said so that its owner can mend it.

/// Why a PLY file could not be read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlyError {
    /// The bytes are something else.
    #[error("not a PLY file: expected the first line to be \"ply\", found {found}")]
    NotPly {
        /// How the file starts.
        found: String,
    },
    /// A header line that makes no sense.
    #[error("PLY header, line {line}: expected {expected}, found \"{found}\"")]
    Header {
        /// Line number, from 1.
        line: usize,
        /// What the format asks for there.
        expected: &'static str,
        /// The line as it is.
        found: String,
    },
    /// Something the format has and this reader has not.
    #[error("PLY: {what}; export it again as {instead}")]
    Unsupported {
        /// What was found.
        what: String,
        /// What to choose in the exporting program.
        instead: &'static str,
    },
    /// Data ends before the header's count is reached.
    #[error(
        "PLY: expected {expected} of element \"{element}\", the file ends within number {found} (counted from 0); \
         it is truncated: copy or export it again"
    )]
    Truncated {
        /// Name of the element.
        element: String,
        /// How many the header promises.
        expected: u64,
        /// The one that is incomplete.
        found: u64,
    },
    /// A value of a text file that is no number of the declared type, or is missing.
    #[error(
        "PLY, line {line}, {element} {index}: expected {expected} for \"{property}\", found {found}"
    )]
    Value {
        /// Line number, from 1.
        line: usize,
        /// Name of the element.
        element: String,
        /// Which one, from 0.
        index: u64,
        /// Name of the property.
        property: String,
        /// The declared type.
        expected: &'static str,
        /// The text found.
        found: String,
    },
    /// A face that names a vertex that is not there.
    #[error("PLY, face {face}: expected vertex indices from 0 to {last}, found {found}", last = vertices - 1)]
    IndexRange {
        /// Which face, from 0.
        face: u64,
        /// How many vertices there are.
        vertices: usize,
        /// The index found.
        found: i64,
    },
    /// A vertex without a place.
    #[error(
        "PLY, vertex {vertex}: expected a finite position, found ({x}, {y}, {z}); remove such vertices first"
    )]
    NotFinite {
        /// Which vertex, from 0.
        vertex: u64,
        /// Its first coordinate.
        x: f64,
        /// Its second coordinate.
        y: f64,
        /// Its third coordinate.
        z: f64,
    },
}
