//! Whole-system tests of Gestus; helpers that they share.
