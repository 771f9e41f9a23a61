//! Instructions a unit of work ([`cost`](super::cost)) for each instruction set, as `examples/calibrate.rs` prints
//! them. Images for parts without an FPU have the feature `soft-float` of the core.

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
                    18.18, 12.97, 0.00, 87.39, 69.30, 1615.0, 1194.7, 2204.6, 1722.2, 163.5, 0.00, 1095.6,
                    10_032.1, 3.84, 1296.0, 8.82, 88.51, 1019.0, 2.45, 1019.1, 1356.6, 540.5,
                ]),
                error_percent: 12.0,
                worst: Some([1.15, 1.39, 1.25, 1.05, 1.09, 1.81, 1.21, 1.26]),
                measured_on: "mps2-an386 (Cortex-M4F)",
            },
            Self::RiscVFpu => Calibration {
                unit_costs: UnitCosts([
                    23.17, 14.54, 0.00, 120.4, 71.55, 2295.5, 1658.3, 2808.1, 2259.9, 199.2, 0.00, 1488.5,
                    15_031.8, 6.39, 1700.0, 11.70, 106.3, 1504.8, 4.97, 1490.3, 2124.9, 920.6,
                ]),
                error_percent: 12.0,
                worst: None,
                measured_on: "virt-rv32imafc",
            },
            Self::RiscV => Calibration {
                unit_costs: UnitCosts([
                    33.52, 15.02, 0.00, 185.0, 71.89, 4571.5, 2763.2, 12_850.2, 8358.8, 357.6, 262.8, 2792.5,
                    63_027.7, 5.98, 5315.4, 54.16, 228.6, 5527.1, 30.21, 6211.9, 7140.0, 1821.4,
                ]),
                error_percent: 9.0,
                worst: None,
                measured_on: "virt-rv32imac",
            },
            Self::Armv6M => Calibration {
                unit_costs: UnitCosts([
                    51.05, 19.93, 0.00, 239.4, 115.2, 6112.9, 5143.0, 17_783.0, 10_793.2, 374.2, 259.7,
                    4898.2, 81_557.8, 7.01, 5895.8, 54.43, 275.2, 7778.4, 31.28, 8412.1, 10_085.1, 3967.9,
                ]),
                error_percent: 9.0,
                worst: None,
                measured_on: "mps2-an386-armv6m (Armv6-M code on a Cortex-M4)",
            },
        }
    }
}
