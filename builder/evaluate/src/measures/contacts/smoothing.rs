//! Contacts of a stream, as reported and by each way of smoothing its votes.

use gestus_database::{
    registration::contact::{GAUSSIAN_S, smoothed},
    stream::Streamed,
};

/// The contacts of a stream as it reports them, and by each smoothing of its votes.
pub(super) fn smoothings(streamed: &Streamed, rate_hz: f64) -> [(&'static str, Vec<[bool; 2]>); 3] {
    let likelihoods: Vec<[f64; 2]> =
        streamed.steps.iter().map(|s| s.report.contact_likelihood.map(f64::from)).collect();
    let reported: Vec<[bool; 2]> = streamed.steps.iter().map(|s| s.report.contacts).collect();
    let bare: Vec<[bool; 2]> = likelihoods.iter().map(|l| l.map(|l| l > 0.5)).collect();
    let gaussian = smoothed(&likelihoods, GAUSSIAN_S * rate_hz);
    [("stream", reported), ("unsmoothed", bare), ("gaussian", gaussian)]
}
