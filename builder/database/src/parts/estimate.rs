//! Estimates whether a database fits a part, and how many frames a second the part would reach.
//!
//! ```text
//! seconds a frame = instructions · cycles an instruction / clock + bytes read of the blob / bandwidth
//! ```
//!
//! with the instructions of [`cost`](super::cost), the bytes read as the step's report counts them, and the part's
//! figures ([`table`](super::table)). It leaves out the wait states of code that does not run from RAM or a cache, and
//! all other work of the board. The range follows from the range of cycles an instruction, and from half and twice the
//! bytes read: a cache may save reads, and cache lines may fetch more than is needed.

use crate::stream::Request;
use gestus_core::{Database, Method, Report};
use serde_json::{Value, json};

use super::{
    cost::units,
    state::{link_bytes, state_bytes},
    table::Part,
    worst,
};

/// Bytes reserved for the stack: the most measured on emulated boards is 4,244 (`budgets.toml`). A robot takes up to 7,912.
pub const STACK_BYTES: u64 = 6 * 1024;
/// Bytes reserved for code and constants: room for the image of a Cortex-M4F with link and counters.
pub const CODE_BYTES: u64 = 128 * 1024;

/// Where the blob would be stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// In the chip's own flash, after the code.
    Internal,
    /// In external memory.
    External,
    /// It fits in neither.
    None,
}

impl Place {
    /// Where a blob of that size would be stored.
    pub fn of(part: &Part, blob_bytes: u64) -> Self {
        let places = [Self::Internal, Self::External];
        places.into_iter().find(|place| blob_bytes <= place.room(part)).unwrap_or(Self::None)
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Internal => "internal flash",
            Self::External => "external memory",
            Self::None => "nowhere",
        }
    }

    /// Bytes that a blob can have there. Without internal flash the program is stored in external memory too, even if it
    /// runs from RAM.
    pub fn room(self, part: &Part) -> u64 {
        let flash = u64::from(part.flash_kib) * 1024;
        let stored_code = if flash == 0 { CODE_BYTES } else { 0 };
        match self {
            Self::Internal => flash.saturating_sub(CODE_BYTES),
            Self::External => part.external.map_or(0, |e| e.bytes.saturating_sub(stored_code)),
            Self::None => 0,
        }
    }

    /// Whether every board with the part has the place: it is in the chip, the program is stored there too, or it is RAM
    /// that the table lists with a whole device.
    pub fn is_always_there(self, part: &Part) -> bool {
        self == Self::Internal || part.flash_kib == 0 || part.external.is_some_and(|external| external.ram)
    }
}

/// What a database needs of a part, and what the part has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fit {
    /// Bytes of the stylizer.
    pub state_bytes: u64,
    /// Bytes of RAM needed: stylizer, link, stack, and the code if the chip has no flash.
    pub ram_needed: u64,
    /// Bytes of RAM of the part.
    pub ram_bytes: u64,
    /// Bytes of the blob.
    pub blob_bytes: u64,
    /// Where it would be stored.
    pub place: Place,
}

impl Fit {
    /// Compares the needs of a database of that size, with `k` neighbors a class, with what the part has.
    pub fn new(part: &Part, database: &Database<'_>, blob_bytes: u64, k: u16) -> Self {
        let counts = database.counts();
        Self::of(part, [counts.joints, usize::from(k), counts.classes], blob_bytes)
    }

    /// The same for capacities J, K and C.
    pub fn of(part: &Part, [j, k, c]: [usize; 3], blob_bytes: u64) -> Self {
        let state_bytes = state_bytes(j, k, c) as u64;
        let code_in_ram = if part.flash_kib == 0 { CODE_BYTES } else { 0 };
        Self {
            state_bytes,
            ram_needed: state_bytes + link_bytes(j) as u64 + STACK_BYTES + code_in_ram,
            ram_bytes: u64::from(part.ram_kib) * 1024,
            blob_bytes,
            place: Place::of(part, blob_bytes),
        }
    }

    /// True if the RAM suffices.
    pub fn fits_ram(&self) -> bool {
        self.ram_needed <= self.ram_bytes
    }

    /// True if both RAM and blob fit.
    pub fn fits(&self) -> bool {
        self.fits_ram() && self.place != Place::None
    }

    /// Why it does not fit; empty if it does.
    pub fn reasons(&self) -> Vec<String> {
        let mut reasons = Vec::new();
        if !self.fits_ram() {
            reasons.push(format!(
                "it needs {} bytes of RAM and the part has {}: use fewer joints, a smaller K or fewer classes",
                self.ram_needed, self.ram_bytes
            ));
        }
        if self.place == Place::None {
            reasons.push(format!(
                "the blob's {} bytes fit neither the internal flash nor the external memory: build for the part (`gestus build --fit`), or with fewer actions, styles or frames (--limit)",
                self.blob_bytes
            ));
        }
        reasons
    }
}

/// The cost of a frame on a part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Instructions.
    pub instructions: f64,
    /// Bytes read from the blob.
    pub bytes_read: f64,
    /// Seconds: least, expected, most.
    pub seconds: [f64; 3],
}

impl Cost {
    /// The cost of that work on that part, with the blob stored in that place.
    pub fn new(part: &Part, place: Place, instructions: f64, bytes_read: f64) -> Self {
        let bandwidth = 1e6
            * match (place, part.external) {
                (Place::External, Some(external)) => external.bandwidth_mb_s(),
                _ => part.flash_mb_s.max(1.0),
            };
        let error = part.core.isa().calibration().error_percent / 100.0;
        let cycles = part.core.cycles_per_instruction();
        let scale = [(1.0 - error) * cycles[0], cycles[1], (1.0 + error) * cycles[2]];
        let bytes = [0.5, 1.0, 2.0];
        let seconds = std::array::from_fn(|i| {
            instructions * scale[i] / (part.clock_mhz * 1e6) + bytes[i] * bytes_read / bandwidth
        });
        Self { instructions, bytes_read, seconds }
    }

    /// Frames a second: least, expected, most.
    pub fn frames_per_second(&self) -> [f64; 3] {
        let [least, expected, most] = self.seconds;
        [1.0 / most, 1.0 / expected, 1.0 / least]
    }
}

/// The estimated cost of a stream on a part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The part.
    pub part: &'static Part,
    /// Whether it fits.
    pub fit: Fit,
    /// The median frame.
    pub median: Cost,
    /// The most expensive frame.
    pub worst: Cost,
    /// Upper bound of the instructions of any frame of any stream, if it is known ([`worst::bound`]).
    pub bound: Option<f64>,
    /// Frames a second of the stream.
    pub rate_hz: f64,
}

/// The properties of a stream, besides its reports, on which the units of work depend.
#[derive(Debug, Clone, Copy)]
pub struct Stream<'a> {
    /// The database.
    pub database: &'a Database<'a>,
    /// Bytes of its file.
    pub blob_bytes: u64,
    /// Styles, labels and parameters.
    pub request: &'a Request,
}

impl Estimate {
    /// The estimate for a stream with those reports, one a step.
    pub fn new<'r>(
        part: &'static Part,
        stream: &Stream<'_>,
        reports: impl Iterator<Item = &'r Report>,
    ) -> Self {
        let k = stream.request.config.k;
        let fit = Fit::new(part, stream.database, stream.blob_bytes, k);
        let unit_costs = part.core.isa().calibration().unit_costs;
        let cost = |report: &Report| {
            let units = units(stream.database, stream.request, report);
            Cost::new(part, fit.place, unit_costs.total(&units), f64::from(report.bytes_read))
        };
        let mut costs: Vec<Cost> = reports.map(cost).collect();
        costs.sort_by(|a, b| a.seconds[1].total_cmp(&b.seconds[1]));
        let nothing = Cost { instructions: 0.0, bytes_read: 0.0, seconds: [f64::NAN; 3] };
        Self {
            part,
            fit,
            median: costs.get(costs.len() / 2).copied().unwrap_or(nothing),
            worst: costs.last().copied().unwrap_or(nothing),
            bound: (stream.request.config.method == Method::Mar)
                .then(|| worst::bound(part.core.isa(), stream.database, stream.request))
                .flatten(),
            rate_hz: f64::from(stream.database.rate_hz()),
        }
    }

    /// Frames a second if every frame took the upper bound, at the highest cycles an instruction.
    fn rate_at_bound(&self) -> Option<f64> {
        let [_, _, most] = self.part.core.cycles_per_instruction();
        Some(self.part.clock_mhz * 1e6 / (self.bound? * most))
    }

    /// The figures as JSON.
    pub fn json(&self) -> Value {
        let calibration = self.part.core.isa().calibration();
        let [low, cycles, high] = self.part.core.cycles_per_instruction();
        let [median_low, median, median_high] = self.median.frames_per_second();
        let [worst_low, worst, worst_high] = self.worst.frames_per_second();
        json!({
            "part": self.part.name,
            "core": self.part.core.name(),
            "clock_mhz": self.part.clock_mhz,
            "fpu": self.part.core.has_fpu(),
            "source": self.part.source,
            "fits": self.fit.fits(),
            "reasons": self.fit.reasons(),
            "state_bytes": self.fit.state_bytes,
            "ram_needed_bytes": self.fit.ram_needed,
            "ram_bytes": self.fit.ram_bytes,
            "blob_bytes": self.fit.blob_bytes,
            "blob_in": self.fit.place.name(),
            "instructions_median": self.median.instructions.round(),
            "instructions_max": self.worst.instructions.round(),
            "instructions_bound": self.bound.map(f64::round),
            "frames_per_second_bound": self.rate_at_bound(),
            "frames_per_second_median": median,
            "frames_per_second_median_range": [median_low, median_high],
            "frames_per_second_worst": worst,
            "frames_per_second_worst_range": [worst_low, worst_high],
            "keeps_rate_median": median >= self.rate_hz,
            "keeps_rate_worst": worst >= self.rate_hz,
            "model": {
                "cycles_per_instruction": cycles,
                "cycles_per_instruction_range": [low, high],
                "instructions_from": calibration.measured_on,
                "instructions_error_percent": calibration.error_percent,
            },
        })
    }

    /// The figures as text.
    pub fn summary(&self) -> String {
        let name = format!(
            "{} ({}, {} MHz, {})",
            self.part.name,
            self.part.core.name(),
            self.part.clock_mhz,
            if self.part.core.has_fpu() { "FPU" } else { "no FPU" }
        );
        let fit = if self.fit.fits() {
            format!(
                "fits, {} of {} KB of RAM, blob of {} KB in {}",
                self.fit.ram_needed / 1024,
                self.fit.ram_bytes / 1024,
                self.fit.blob_bytes / 1024,
                self.fit.place.name()
            )
        } else {
            format!("does not fit: {}", self.fit.reasons().join("; "))
        };
        let calibration = self.part.core.isa().calibration();
        let rate = |cost: &Cost| {
            let [low, expected, high] = cost.frames_per_second();
            format!("{expected:.0} ({low:.0} to {high:.0})")
        };
        let bound = match (self.bound, self.rate_at_bound()) {
            (Some(bound), Some(rate)) => format!(
                "\nno frame of any stream takes more than {:.2} million instructions: at least {rate:.0} frames a second, without the time to read the blob",
                bound / 1e6
            ),
            _ => "\nno bound of the worst frame: it is known for the mixture on a Cortex-M with an FPU"
                .to_owned(),
        };
        format!(
            "{name}: {fit}\nestimated, not measured: {} frames a second for the median frame, {} for the worst; the \
             stream has {:.0}\n{:.2} million instructions in the median frame, {:.2} in the worst, modelled from counts on \
             {} (error of nine frames in ten below {:.0}% there), {:?} cycles an instruction{bound}",
            rate(&self.median),
            rate(&self.worst),
            self.rate_hz,
            self.median.instructions / 1e6,
            self.worst.instructions / 1e6,
            calibration.measured_on,
            calibration.error_percent,
            self.part.core.cycles_per_instruction(),
        )
    }
}
