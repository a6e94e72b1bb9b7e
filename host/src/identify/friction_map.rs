//! Friction against speed, from a recording with stretches of constant speed.
