//! Voxels to surface: the sparse 3D network of a level.
