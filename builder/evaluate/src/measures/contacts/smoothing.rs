//! Contacts of a stream by each way of smoothing its votes.

use gestus_core::methods::mixture::contact_votes::DELAY_FRAMES;
use gestus_database::{
    registration::contact::{GAUSSIAN_S, smoothed},
    stream::Streamed,
};

/// The contacts of a stream by each smoothing of its votes, with the mean delay in frames.
pub(super) fn smoothings(streamed: &Streamed, rate_hz: f64) -> [(&'static str, Vec<[bool; 2]>, f64); 3] {
    let likelihoods: Vec<[f64; 2]> =
        streamed.steps.iter().map(|s| s.report.contact_likelihood.map(f64::from)).collect();
    let causal: Vec<[bool; 2]> = streamed.steps.iter().map(|s| s.report.contacts).collect();
    let bare: Vec<[bool; 2]> = likelihoods.iter().map(|l| l.map(|l| l > 0.5)).collect();
    let gaussian = smoothed(&likelihoods, GAUSSIAN_S * rate_hz);
    [("causal", causal, f64::from(DELAY_FRAMES)), ("unsmoothed", bare, 0.0), ("gaussian", gaussian, 0.0)]
}
