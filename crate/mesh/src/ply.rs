//! PLY, the exchange format of scanning: our meshes out, and meshes and point clouds of other tools in.

mod body;
mod error;
mod header;
mod read;
mod write;

pub use error::PlyError;
pub use read::read;
pub use write::write;
