//! Gestus builder: from annotated motion capture to one flat blob that `gestus-core` reads in place.

pub mod annotate;
pub mod bvh;
pub mod corpus;
pub mod motion;
