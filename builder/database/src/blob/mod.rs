//! The blob: one encoder per section, assembly, reduction to models, and export.

pub mod assemble;
pub(crate) mod classes;
pub mod cut;
pub(crate) mod dofs;
pub mod export;
pub(crate) mod feet;
pub(crate) mod manifest;
pub(crate) mod pairs;
pub mod rows;
pub(crate) mod search;
pub(crate) mod skeleton;
pub(crate) mod timing;
pub(crate) mod trust;
