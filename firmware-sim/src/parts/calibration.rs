//! Instructions a unit of work ([`cost`](super::cost)) for each instruction set, as `examples/calibrate.rs` prints
//! them. Those of the search by phase follow from three streams, since all tables of one database can have the same number
//! of knots.

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
                    11.65, 12.4, 3660.4, 90.27, 34.75, 321.8, 594.7, 308.9, 996.0, 162.9, 0.0, 434.3, 6889.6,
                    2.6, 2503.0, 8.66, 116.3, 482.2, 2.39, 544.0, 799.9, 235.3,
                ]),
                error_percent: 12.0,
                worst: Some([1.05, 1.31, 1.13, 1.05, 1.07, 1.56, 1.09, 1.28]),
                measured_on: "mps2-an386 (Cortex-M4F)",
            },
            Self::RiscVFpu => Calibration {
                unit_costs: UnitCosts([
                    25.87, 12.6, 7950.5, 114.8, 42.72, 344.9, 604.1, 339.1, 1153.3, 150.1, 347.4, 481.4,
                    9507.6, 5.94, 2878.0, 12.9, 118.1, 699.7, 4.98, 761.1, 1232.5, 406.9,
                ]),
                error_percent: 12.0,
                worst: None,
                measured_on: "virt-rv32imafc",
            },
            Self::RiscV => Calibration {
                unit_costs: UnitCosts([
                    232.0, 13.8, 14_200.0, 820.2, 1506.3, 6687.8, 13_224.9, 1556.0, 12_521.4, 254.4, 3139.4,
                    12_218.7, 107_587.3, 5.33, 8975.0, 50.93, 233.8, 12_000.5, 35.62, 12_116.8, 16_606.0,
                    9023.2,
                ]),
                error_percent: 9.0,
                worst: None,
                measured_on: "virt-rv32imac",
            },
            Self::Armv6M => Calibration {
                unit_costs: UnitCosts([
                    420.1, 20.4, 25_000.0, 1327.9, 2514.9, 13_048.0, 23_827.6, 2580.1, 23_297.0, 448.5,
                    5547.9, 22_398.9, 202_974.3, 7.79, 13_864.0, 82.3, 355.5, 21_702.4, 63.18, 21_918.9,
                    29_909.7, 16_777.6,
                ]),
                error_percent: 9.0,
                worst: None,
                measured_on: "mps2-an386-armv6m (Armv6-M code on a Cortex-M4)",
            },
        }
    }
}
