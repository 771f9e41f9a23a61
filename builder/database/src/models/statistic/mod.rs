//! Statistical transfer (the statistical-transfer paper): a style is the mean and the spread of every joint's rotation, and any clip is
//! a style.
//!
//! [`mean`] defines mean and spread on the sphere of unit quaternions; [`transfer`](mod@transfer) gives a clip the
//! statistics of another, the whole clip at once, along the paper's pipeline; [`euler`] does the same with Euler
//! angles, which the paper holds against it; [`table`] writes statistics of each style of a corpus into a blob, for
//! streams.

pub mod euler;
pub mod mean;
pub mod table;
pub mod transfer;
