//! One measure a file.

pub mod ablation;
pub mod comparison;
pub mod compression;
pub mod contacts;
pub mod correspondence;
pub mod effort;
pub mod growth;
pub mod knn;
pub mod loo;
pub mod retarget;
pub mod servo;
pub mod skate;
pub mod timing;
