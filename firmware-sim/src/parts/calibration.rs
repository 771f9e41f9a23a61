//! Instructions a unit of work ([`cost`](super::cost)) for each instruction set, as `examples/calibrate.rs` prints
//! them.

use gestus_core::Stage;

use super::cost::UnitCosts;

/// Instruction sets that the costs distinguish.
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

/// The calibration of the cost model for an instruction set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// Instructions a unit of work.
    pub unit_costs: UnitCosts,
    /// 90th percentile of the relative error of the modelled instructions, percent, on frames that were not fitted. It
    /// is larger for databases of other sizes.
    pub error_percent: f64,
    /// For each stage the largest ratio of counted to modelled instructions on worst-case streams, plus 5%
    /// ([`worst`](super::worst)); `None` where it was not measured.
    pub worst: Option<[f64; Stage::NAMES.len()]>,
    /// The board on which the instructions were counted.
    pub measured_on: &'static str,
}

impl Isa {
    /// Its calibration.
    pub fn calibration(self) -> Calibration {
        match self {
            Self::Armv7MFpu => Calibration {
                unit_costs: UnitCosts([
                    11.65, 15.79, 3660.4, 90.27, 34.75, 321.8, 594.7, 308.9, 996.0, 162.9, 0.0, 434.3, 6889.6,
                ]),
                error_percent: 12.0,
                worst: Some([1.05, 1.31, 1.13, 1.05, 1.07, 1.56, 1.09, 1.28]),
                measured_on: "mps2-an386 (Cortex-M4F)",
            },
            Self::RiscVFpu => Calibration {
                unit_costs: UnitCosts([
                    25.87, 15.71, 7950.5, 114.8, 42.72, 344.9, 604.1, 339.1, 1153.3, 150.1, 347.4, 481.4,
                    9507.6,
                ]),
                error_percent: 12.0,
                worst: None,
                measured_on: "virt-rv32imafc",
            },
            Self::RiscV => RISC_V,
            // Software floating point without a long multiplication takes more instructions than on RISC-V, which has
            // one.
            Self::Armv6M => Calibration {
                unit_costs: UnitCosts(RISC_V.unit_costs.0.map(|cost| ARMV6M_FACTOR * cost)),
                error_percent: 50.0,
                worst: None,
                measured_on: "virt-rv32imac, times a factor for Armv6-M",
            },
        }
    }
}

/// Instructions of Armv6-M for one of RV32IMC: not counted on this code, but derived from a long multiplication.
const ARMV6M_FACTOR: f64 = 1.3;

const RISC_V: Calibration = Calibration {
    unit_costs: UnitCosts([
        232.0, 270.6, 162_029.6, 820.2, 1506.3, 6687.8, 13_224.9, 1556.0, 12_521.4, 254.4, 3139.4, 12_218.7,
        107_587.3,
    ]),
    error_percent: 9.0,
    worst: None,
    measured_on: "virt-rv32imac",
};
