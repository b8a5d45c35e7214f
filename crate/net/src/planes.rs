//! Pictures to feature planes: everything that is computed once a frame.
