//! The blob: one flat image that the builder writes and the stylizer reads in place.
//!
//! [`Database::open`] checks everything once; after that every read is in range, and none can fail. The bytes
//! stay where they are (flash, a memory map, a `Vec`); a `Database` is a handful of slices and counts, `Copy`.
//!
//! [`layout`] names every byte, [`layout::section`] is the table of sections, `sections` reads them, `validate` checks
//! them. `docs/FORMAT.md` describes the format.

pub(crate) mod check;
pub mod crc;
mod database;
pub mod layout;
mod mark;
mod numbers;
pub mod read;
pub(crate) mod sections;
mod validate;

pub use database::{Counts, Database};
pub use mark::Mark;
pub use numbers::Numbers;
pub use sections::{
    Class, Counterpart, DofScale, Joint, Leg, LinearModel, Manifest, Moment, Names, PhaseTables, Table,
    TimingDof, TrustLimits, Unit,
};
