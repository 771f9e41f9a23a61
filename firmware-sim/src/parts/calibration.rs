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
                    19.32, 12.88, 0.00, 86.70, 69.09, 1627.2, 1191.1, 1973.0, 1255.5, 210.0, 13.62, 1089.2,
                    7249.1, 4.92, 0.11, 20.88, 112.5, 445.1, 2.45, 506.2, 762.9, 232.8,
                ]),
                error_percent: 12.0,
                worst: Some([1.12, 1.40, 1.20, 1.05, 1.10, 1.58, 1.12, 1.29]),
                measured_on: "mps2-an386 (Cortex-M4F)",
            },
            Self::RiscVFpu => Calibration {
                unit_costs: UnitCosts([
                    23.44, 14.45, 0.00, 119.3, 71.15, 2317.9, 1653.7, 2535.4, 1551.0, 254.0, 18.84, 1483.1,
                    9379.5, 5.94, 2878.0, 12.9, 118.1, 699.7, 4.98, 761.1, 1232.5, 406.9,
                ]),
                error_percent: 12.0,
                worst: None,
                measured_on: "virt-rv32imafc",
            },
            Self::RiscV => Calibration {
                unit_costs: UnitCosts([
                    53.69, 14.97, 0.00, 187.6, 71.86, 4742.3, 2831.2, 12995.0, 15436.1, 439.6, 1061.2,
                    2805.8, 110525.5, 5.33, 8975.0, 50.93, 233.8, 12_000.5, 35.62, 12_116.8, 16_606.0,
                    9023.2,
                ]),
                error_percent: 9.0,
                worst: None,
                measured_on: "virt-rv32imac",
            },
            Self::Armv6M => Calibration {
                unit_costs: UnitCosts([
                    100.3, 20.45, 0.00, 286.9, 116.7, 9277.5, 7441.7, 26327.2, 27901.8, 587.8, 1887.9,
                    7187.6, 200240.0, 7.79, 13_864.0, 82.3, 355.5, 21_702.4, 63.18, 21_918.9, 29_909.7,
                    16_777.6,
                ]),
                error_percent: 9.0,
                worst: None,
                measured_on: "mps2-an386-armv6m (Armv6-M code on a Cortex-M4)",
            },
        }
    }
}
