//! Statistical transfer: a style is the mean and the standard deviation of every joint's rotation, and any clip can serve
//! as a style. The source, "the paper" in these modules, is the one that defines style as "statistic properties of mean
//! and standard variance of joint quaternions in 4D unit sphere space".
//!
//! [`mean`] computes mean and standard deviation on the sphere of unit quaternions; [`transfer`](mod@transfer) gives a
//! whole clip the statistics of another, by the paper's pipeline; [`euler`] does the same with Euler angles, which the
//! paper compares; [`table`] encodes the statistics of each style of a corpus for streams.

pub mod euler;
pub mod mean;
pub mod table;
pub mod transfer;
