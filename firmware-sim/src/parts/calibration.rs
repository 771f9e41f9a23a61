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
                    18.85, 12.83, 0.0, 88.56, 86.99, 1566.2, 1205.0, 1172.8, 980.1, 242.4, 0.0, 1083.9,
                    6670.7, 4.92, 0.11, 20.88, 112.5, 445.1, 2.45, 506.2, 762.9, 232.8,
                ]),
                error_percent: 12.0,
                worst: Some([1.14, 1.44, 1.17, 1.15, 1.13, 1.56, 1.12, 1.32]),
                measured_on: "mps2-an386 (Cortex-M4F)",
            },
            Self::RiscVFpu => Calibration {
                unit_costs: UnitCosts([
                    41.8, 12.6, 7950.5, 114.8, 101.0, 1677.0, 1252.0, 1430.0, 1153.3, 312.0, 347.4, 1247.0,
                    9507.6, 5.94, 2878.0, 12.9, 118.1, 699.7, 4.98, 761.1, 1232.5, 406.9,
                ]),
                error_percent: 12.0,
                worst: None,
                measured_on: "virt-rv32imafc",
            },
            Self::RiscV => Calibration {
                unit_costs: UnitCosts([
                    57.0, 13.8, 14_200.0, 192.0, 173.0, 2204.0, 4065.0, 1556.0, 12_521.4, 254.4, 3139.4,
                    3644.0, 107_587.3, 5.33, 8975.0, 50.93, 233.8, 12_000.5, 35.62, 12_116.8, 16_606.0,
                    9023.2,
                ]),
                error_percent: 9.0,
                worst: None,
                measured_on: "virt-rv32imac",
            },
            Self::Armv6M => Calibration {
                unit_costs: UnitCosts([
                    112.7, 20.4, 25_000.0, 287.0, 263.0, 4983.0, 9650.0, 2580.1, 23_297.0, 448.5, 5547.9,
                    8358.0, 202_974.3, 7.79, 13_864.0, 82.3, 355.5, 21_702.4, 63.18, 21_918.9, 29_909.7,
                    16_777.6,
                ]),
                error_percent: 9.0,
                worst: None,
                measured_on: "mps2-an386-armv6m (Armv6-M code on a Cortex-M4)",
            },
        }
    }
}
