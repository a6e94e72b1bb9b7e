//! Several scalars side by side.
