//! Helpers that the integration tests under `tests/` have in common.
