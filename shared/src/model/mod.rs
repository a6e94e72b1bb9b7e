//! Models used for identification.
