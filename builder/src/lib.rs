//! Gestus builder: from annotated motion capture to one flat blob that `gestus-core` reads in place.
//!
//! A clip walks through the modules in this order: [`bvh`] reads it, [`annotate`] says what it is, [`register`]
//! gives it contacts and a canonical timeline ([`corpus`]), [`body`] takes it to dofs, [`pair`] finds its
//! counterparts in the other styles, [`features`] and [`index`] make it searchable, [`pack`] packs it, and
//! [`write`](mod@write) puts the blob together.

pub mod annotate;
pub mod arrays;
pub mod body;
pub mod build;
pub mod bvh;
pub mod capture;
pub mod cleanup;
pub mod contact;
pub mod corpus;
pub mod cut;
pub mod effort;
pub mod evaluate;
pub mod export;
pub mod features;
pub mod gltf;
pub mod groups;
pub mod index;
pub mod joints;
pub mod landmarks;
pub mod load;
pub mod models;
pub mod motion;
pub mod outputs;
pub mod pack;
pub mod pair;
pub mod parameters;
pub mod register;
pub mod report;
pub mod retarget;
pub mod robot;
pub mod segment;
pub mod stream;
pub mod synth;
pub mod trace;
pub mod translate;
pub mod urdf;
pub mod view;
pub mod warp;
pub mod wish;
pub mod write;
