//! Readers of the sections: [`Database`](super::Database)'s methods, one file for each section or group of sections
//! that are read together.

mod classes;
mod dofs;
mod feet;
mod lti;
mod manifest;
mod pairs;
mod phase;
mod rows;
mod search;
mod skeleton;
mod statistic;
mod timing;
mod trust;

pub use classes::Class;
pub(crate) use classes::labels_match;
pub use feet::Leg;
pub use lti::{LinearModel, Unit};
pub use manifest::{Manifest, Names};
pub use pairs::{Counterpart, Moment};
pub use phase::{DofScale, PhaseTables};
pub use skeleton::Joint;
pub use statistic::Table;
pub use timing::TimingDof;
pub use trust::TrustLimits;

use super::layout::NONE;

/// The action of a model; `None` for a model of all actions.
fn labelled(action: u16) -> Option<u16> {
    (action != NONE).then_some(action)
}
