//! Motor and gear.
