//! Does a database fit a part, and how many frames a second would it give there?
//!
//! ```text
//! seconds a frame = instructions · cycles an instruction / clock + bytes read of the blob / bandwidth
//! ```
//!
//! with the instructions of [`cost`](super::cost), the bytes that the step has counted, and the part's figures
//! ([`table`](super::table)). It is arithmetic, not emulation: what is left out are the waits of code that does not
//! run from RAM or a cache, and whatever else the board does. The range says what the cycles an instruction leave open,
//! with half and twice the bytes read, since a cache may save some and lines may fetch too many.

use gestus_core::{Database, Method, Report};
use gestus_database::stream::Request;
use serde_json::{Value, json};

use super::{
    cost::units,
    state::{link_bytes, state_bytes},
    table::Part,
    worst::Shape,
};

/// Bytes of stack that are set aside: the worst painted on emulated boards is 5,336.
pub const STACK_BYTES: u64 = 6 * 1024;
/// Bytes of code and constants: the image for a Cortex-M4F with link and counters.
pub const CODE_BYTES: u64 = 128 * 1024;

/// Where the blob would lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// In the flash on the chip, behind the code.
    Internal,
    /// In memory outside.
    External,
    /// Nowhere.
    None,
}

impl Place {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Internal => "internal flash",
            Self::External => "external memory",
            Self::None => "nowhere",
        }
    }
}

/// What a part needs to have, and whether it does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fit {
    /// Bytes of the stylizer.
    pub state_bytes: u64,
    /// Bytes of RAM needed: stylizer, link, stack, and code where there is no flash on the chip.
    pub ram_needed: u64,
    /// Bytes of RAM there.
    pub ram_bytes: u64,
    /// Bytes of the blob.
    pub blob_bytes: u64,
    /// Where it would lie.
    pub place: Place,
}

impl Fit {
    /// Whether a database of that size, with room for `k` neighbors a class, fits the part.
    pub fn new(part: &Part, database: &Database<'_>, blob_bytes: u64, k: u16) -> Self {
        let counts = database.counts();
        let state_bytes = state_bytes(counts.joints, usize::from(k), counts.classes) as u64;
        let flash = u64::from(part.flash_kib) * 1024;
        let code_in_ram = if flash == 0 { CODE_BYTES } else { 0 };
        let external = part.external.map_or(0, |e| e.bytes);
        // A program that starts from outside lies there too, even if it runs from RAM.
        let beside = if flash == 0 { CODE_BYTES } else { 0 };
        let place = if CODE_BYTES + blob_bytes <= flash {
            Place::Internal
        } else if beside + blob_bytes <= external {
            Place::External
        } else {
            Place::None
        };
        Self {
            state_bytes,
            ram_needed: state_bytes + link_bytes(counts.joints) as u64 + STACK_BYTES + code_in_ram,
            ram_bytes: u64::from(part.ram_kib) * 1024,
            blob_bytes,
            place,
        }
    }

    /// RAM and blob both.
    pub fn fits(&self) -> bool {
        self.ram_needed <= self.ram_bytes && self.place != Place::None
    }

    /// Why not; empty where it fits.
    pub fn reasons(&self) -> Vec<String> {
        let mut reasons = Vec::new();
        if self.ram_needed > self.ram_bytes {
            reasons.push(format!(
                "it needs {} bytes of RAM and has {}: fewer joints, a smaller K or fewer classes",
                self.ram_needed, self.ram_bytes
            ));
        }
        if self.place == Place::None {
            reasons.push(format!(
                "there is no room for the blob's {} bytes: build with fewer actions, styles or frames (--limit)",
                self.blob_bytes
            ));
        }
        reasons
    }
}

/// A frame's cost on a part, or several frames'.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Instructions.
    pub instructions: f64,
    /// Bytes read of the blob.
    pub bytes_read: f64,
    /// Seconds: least, expected, most.
    pub seconds: [f64; 3],
}

impl Cost {
    /// Of that work on that part, the blob being in that place.
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

/// What a stream would cost on a part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The part.
    pub part: &'static Part,
    /// Whether it fits.
    pub fit: Fit,
    /// The frame in the middle.
    pub median: Cost,
    /// The frame that costs most.
    pub worst: Cost,
    /// The most instructions that any frame of any stream can take, where that is known ([`Shape::most`]).
    pub bound: Option<f64>,
    /// Frames a second of the stream.
    pub rate_hz: f64,
}

/// What is streamed: what the units of work depend on besides the reports.
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
    /// Of a stream with those reports, one a step.
    pub fn new<'r>(
        part: &'static Part,
        stream: &Stream<'_>,
        reports: impl Iterator<Item = &'r Report>,
    ) -> Self {
        let k = stream.request.config.k;
        let fit = Fit::new(part, stream.database, stream.blob_bytes, k);
        let prices = part.core.isa().calibration().prices;
        let cost = |report: &Report| {
            let units = units(stream.database, stream.request, report);
            Cost::new(part, fit.place, prices.total(&units), f64::from(report.bytes_read))
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
                .then(|| Shape::of(stream.database, stream.request))
                .and_then(|shape| shape.most(part.core.isa())),
            rate_hz: f64::from(stream.database.rate_hz()),
        }
    }

    /// Frames a second if every frame took the bound, at the most cycles an instruction.
    fn slowest(&self) -> Option<f64> {
        let [_, _, most] = self.part.core.cycles_per_instruction();
        Some(self.part.clock_mhz * 1e6 / (self.bound? * most))
    }

    /// The figures.
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
            "frames_per_second_bound": self.slowest(),
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

    /// The figures in words.
    pub fn words(&self) -> String {
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
        let bound = match (self.bound, self.slowest()) {
            (Some(bound), Some(rate)) => format!(
                "\nno frame of any stream takes more than {:.2} million instructions: {rate:.0} frames a second at least, reading apart",
                bound / 1e6
            ),
            _ => String::new(),
        };
        format!(
            "{name}: {fit}\nestimated, not measured: {} frames a second in the middle, {} in the worst frame; the \
             stream has {:.0}\n{:.2} million instructions a frame in the middle, {:.2} at most, by prices counted on {} \
             (nine frames of ten within {:.0}% there), {:?} cycles an instruction{bound}",
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
