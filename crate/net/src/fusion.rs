//! Planes to voxels: what each view says of a voxel, and what they say together.
