//! The numbers of what a board counts. They are part of the protocol: a number's meaning never changes.

use super::{Damage, Statistic};

macro_rules! counters {
    ($($(#[$doc:meta])* $name:ident = $number:literal, $text:literal;)*) => {
        $($(#[$doc])* pub const $name: u16 = $number;)*

        /// Every number that has a name, and its name.
        pub const NAMES: &[(u16, &str)] = &[$(($name, $text)),*];
    };
}

counters! {
    /// Frames that arrived whole.
    FRAMES = 0, "frames";
    /// Requests answered, those refused included.
    REQUESTS = 1, "requests";
    /// Poses stepped.
    STEPS = 2, "steps";
    /// Requests that the host repeated after they had been carried out: their answers were lost or late.
    REPEATED = 3, "repeated";
    /// Frames that the line doubled: the same attempt came twice.
    DOUBLED = 4, "doubled";
    /// Attempts that did not arrive whole before the one that did: lost, cut or corrupted on their way here.
    LOST = 5, "lost";
    /// Frames of requests long answered.
    STALE = 6, "stale";
    /// Frames that were cut.
    CUT = 7, "cut";
    /// Frames whose checksum disagreed.
    CORRUPTED = 8, "corrupted";
    /// Frames longer than the buffer.
    OVERLONG = 9, "overlong";
    /// Frames of another protocol version, and replies.
    FOREIGN = 10, "foreign";
    /// Requests answered with a fault.
    FAULTS = 11, "faults";
    /// Bytes of the stylizer.
    STYLIZER_BYTES = 32, "stylizer_bytes";
    /// Bytes of the server, its buffers included.
    SERVER_BYTES = 33, "server_bytes";
    /// Bytes of RAM that the image takes: data, bss.
    STATIC_BYTES = 34, "static_bytes";
    /// Most bytes of stack used, by painting.
    STACK_BYTES = 35, "stack_bytes";
    /// Bytes of code and constants.
    CODE_BYTES = 36, "code_bytes";
    /// Instructions of all steps.
    INSTRUCTIONS = 64, "instructions";
    /// Most instructions of a step.
    INSTRUCTIONS_MAX = 65, "instructions_max";
    /// Instructions of all steps in the query.
    INSTRUCTIONS_QUERY = 66, "instructions_query";
    /// Instructions of all steps in the search.
    INSTRUCTIONS_SEARCH = 67, "instructions_search";
    /// Instructions of all steps in decoding rows.
    INSTRUCTIONS_DECODE = 68, "instructions_decode";
    /// Instructions of all steps in the regression.
    INSTRUCTIONS_REGRESSION = 69, "instructions_regression";
    /// Instructions of all steps in the timing.
    INSTRUCTIONS_TIMING = 70, "instructions_timing";
    /// Instructions of all steps in the rest.
    INSTRUCTIONS_REST = 71, "instructions_rest";
    /// Instructions of opening the database.
    INSTRUCTIONS_OPEN = 72, "instructions_open";
    /// Instructions of all steps in the votes on contacts.
    INSTRUCTIONS_CONTACTS = 73, "instructions_contacts";
    /// Instructions of all steps in holding feet.
    INSTRUCTIONS_LOCK = 74, "instructions_lock";
    /// Deadlines missed.
    DEADLINES_MISSED = 96, "deadlines_missed";
}

/// The first of the numbers that are a board's own: they have no name here.
pub const OWN: u16 = 1024;

/// Name of a number.
pub fn name(number: u16) -> Option<&'static str> {
    NAMES.iter().find(|(n, _)| *n == number).map(|(_, name)| *name)
}

/// A server's counts of its line. Counters stop at their largest value.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LinkCounts {
    /// [`FRAMES`].
    pub frames: u32,
    /// [`REQUESTS`].
    pub requests: u32,
    /// [`STEPS`].
    pub steps: u32,
    /// [`REPEATED`].
    pub repeated: u32,
    /// [`DOUBLED`].
    pub doubled: u32,
    /// [`LOST`].
    pub lost: u32,
    /// [`STALE`].
    pub stale: u32,
    /// [`CUT`].
    pub cut: u32,
    /// [`CORRUPTED`].
    pub corrupted: u32,
    /// [`OVERLONG`].
    pub overlong: u32,
    /// [`FOREIGN`].
    pub foreign: u32,
    /// [`FAULTS`].
    pub faults: u32,
}

impl LinkCounts {
    /// Adds one to a counter.
    pub(super) fn increment(counter: &mut u32) {
        *counter = counter.saturating_add(1);
    }

    /// Counts a damaged frame.
    pub fn damaged(&mut self, damage: Damage) {
        Self::increment(match damage {
            Damage::Cut => &mut self.cut,
            Damage::Corrupted => &mut self.corrupted,
            Damage::Overlong => &mut self.overlong,
        });
    }

    /// The counts as statistics, by number.
    pub fn statistics(&self) -> [Statistic; 12] {
        [
            (FRAMES, self.frames),
            (REQUESTS, self.requests),
            (STEPS, self.steps),
            (REPEATED, self.repeated),
            (DOUBLED, self.doubled),
            (LOST, self.lost),
            (STALE, self.stale),
            (CUT, self.cut),
            (CORRUPTED, self.corrupted),
            (OVERLONG, self.overlong),
            (FOREIGN, self.foreign),
            (FAULTS, self.faults),
        ]
        .map(|(number, value)| (number, u64::from(value)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_names_are_unique() {
        for (i, (number, text)) in NAMES.iter().enumerate() {
            assert!(NAMES[..i].iter().all(|(n, t)| n != number && t != text), "{number} {text}");
            assert!(*number < OWN);
        }
        assert_eq!(name(LOST), Some("lost"));
        assert_eq!(name(OWN), None);
    }

    #[test]
    fn counters_stop_at_their_largest() {
        let mut counts = LinkCounts { cut: u32::MAX - 1, ..LinkCounts::default() };
        counts.damaged(Damage::Cut);
        counts.damaged(Damage::Cut);
        assert_eq!(counts.cut, u32::MAX);
    }
}
