//! The parts, with figures from their datasheets.

use serde_json::{Value, json};

use super::calibration::Isa;

/// Processor cores, which differ in cycles an instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Core {
    /// Cortex-M0: two-cycle loads, three-cycle branches.
    M0,
    /// Cortex-M0+: two-cycle loads, two-cycle branches.
    M0Plus,
    /// Cortex-M4 with FPU.
    M4F,
    /// Cortex-M7 with FPU: two instructions a cycle at best.
    M7F,
    /// Cortex-M33 with FPU.
    M33F,
    /// RV32IMC, in order, without FPU.
    RiscV,
    /// RV32IMAFC, in order.
    RiscVF,
}

impl Core {
    /// The core's instruction set.
    pub fn isa(self) -> Isa {
        match self {
            Self::M0 | Self::M0Plus => Isa::Armv6M,
            Self::M4F | Self::M7F | Self::M33F => Isa::Armv7MFpu,
            Self::RiscV => Isa::RiscV,
            Self::RiscVF => Isa::RiscVFpu,
        }
    }

    /// Whether it has an FPU for `f32`.
    pub fn has_fpu(self) -> bool {
        !matches!(self, Self::M0 | Self::M0Plus | Self::RiscV)
    }

    /// Cycles an instruction with code and stack in memory without wait states: lowest, expected, highest. These are
    /// not measured on the parts: the M4's range is that of libm's functions, the others follow from the cores'
    /// pipelines.
    pub fn cycles_per_instruction(self) -> [f64; 3] {
        match self {
            Self::M0 => [1.4, 1.7, 2.0],
            Self::M0Plus => [1.2, 1.5, 1.8],
            Self::M4F => [1.2, 1.45, 1.7],
            Self::M33F => [1.1, 1.3, 1.6],
            Self::M7F => [0.6, 0.8, 1.2],
            Self::RiscV | Self::RiscVF => [1.1, 1.35, 1.7],
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::M0 => "Cortex-M0",
            Self::M0Plus => "Cortex-M0+",
            Self::M4F => "Cortex-M4F",
            Self::M7F => "Cortex-M7F",
            Self::M33F => "Cortex-M33F",
            Self::RiscV => "RV32IMC",
            Self::RiscVF => "RV32IMAFC",
        }
    }
}

/// Memory-mapped external memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct External {
    /// Largest size, bytes.
    pub bytes: u64,
    /// Clock of its bus, MHz.
    pub bus_mhz: f64,
    /// Width of the bus, bits a clock.
    pub lanes: u32,
    /// Bytes fetched at a cache miss: a cache line, or a bus access without a cache.
    pub line_bytes: u32,
    /// Clocks of a fetch before its first data: address, mode, dummy cycles.
    pub latency_clocks: u32,
    /// True for RAM, to which the blob is copied once.
    pub ram: bool,
}

impl External {
    /// Megabytes a second of random reads: line by line, each with its own address.
    pub fn bandwidth_mb_s(&self) -> f64 {
        let data_clocks = f64::from(self.line_bytes) * 8.0 / f64::from(self.lanes);
        f64::from(self.line_bytes) * self.bus_mhz / (f64::from(self.latency_clocks) + data_clocks)
    }
}

/// A microcontroller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Name for `--board`.
    pub name: &'static str,
    /// Core.
    pub core: Core,
    /// Clock, MHz: the datasheet's highest, or that of a product.
    pub clock_mhz: f64,
    /// Internal RAM, KiB, all banks.
    pub ram_kib: u32,
    /// Internal flash, KiB.
    pub flash_kib: u32,
    /// Megabytes a second of random data reads from the internal flash.
    pub flash_mb_s: f64,
    /// External memory.
    pub external: Option<External>,
    /// Where the figures are from.
    pub source: &'static str,
}

const MIB: u64 = 1024 * 1024;

/// QSPI flash in fast quad read: six address clocks, two mode clocks, and dummy clocks.
const fn quad(bytes: u64, bus_mhz: f64, line_bytes: u32, dummy_clocks: u32) -> Option<External> {
    Some(External { bytes, bus_mhz, lanes: 4, line_bytes, latency_clocks: 8 + dummy_clocks, ram: false })
}

/// The table.
pub const PARTS: [Part; 15] = [
    Part {
        name: "rp2040",
        core: Core::M0Plus,
        clock_mhz: 133.0,
        ram_kib: 264,
        flash_kib: 0,
        flash_mb_s: 0.0,
        // The QSPI clock is half of the system's; lines of the XIP cache are 8 bytes.
        external: quad(16 * MIB, 66.5, 8, 4),
        source: "RP2040 datasheet, 2.6 Memory (XIP cache), 4.10 SSI",
    },
    Part {
        name: "rp2350",
        core: Core::M33F,
        clock_mhz: 150.0,
        ram_kib: 520,
        flash_kib: 0,
        flash_mb_s: 0.0,
        external: quad(16 * MIB, 75.0, 8, 4),
        source: "RP2350 datasheet, 4.4 External flash and PSRAM (XIP), 12.14 QMI",
    },
    Part {
        name: "stm32f405",
        core: Core::M4F,
        clock_mhz: 168.0,
        ram_kib: 192,
        flash_kib: 1024,
        // Lines of 16 bytes at five wait states.
        flash_mb_s: 448.0,
        external: None,
        source: "STM32F405xx datasheet DS8626; RM0090, 3.4 (wait states, ART accelerator)",
    },
    Part {
        name: "stm32h743",
        core: Core::M7F,
        clock_mhz: 480.0,
        ram_kib: 1060,
        flash_kib: 2048,
        // Lines of 32 bytes behind the 240 MHz bus at four wait states.
        flash_mb_s: 1536.0,
        external: quad(256 * MIB, 133.0, 32, 6),
        source: "STM32H743xI datasheet DS12110 (RAM, QUADSPI 133 MHz); RM0433, 4.3 (flash)",
    },
    Part {
        name: "stm32u585",
        core: Core::M33F,
        clock_mhz: 160.0,
        ram_kib: 786,
        flash_kib: 2048,
        flash_mb_s: 512.0,
        // Octal, one bit a clock and lane; 16-byte lines of DCACHE.
        external: Some(External {
            bytes: 256 * MIB,
            bus_mhz: 80.0,
            lanes: 8,
            line_bytes: 16,
            latency_clocks: 16,
            ram: false,
        }),
        source: "STM32U585xx datasheet DS13086; RM0456, 28 (OCTOSPI), 14 (DCACHE)",
    },
    Part {
        name: "nrf52840",
        core: Core::M4F,
        clock_mhz: 64.0,
        ram_kib: 256,
        flash_kib: 1024,
        // Words at two wait states; the cache is for instructions.
        flash_mb_s: 85.0,
        external: quad(128 * MIB, 32.0, 4, 4),
        source: "nRF52840 product specification v1.7, 4.2 Memory, 4.3 NVMC, 6.19 QSPI",
    },
    Part {
        name: "esp32-c3",
        core: Core::RiscV,
        clock_mhz: 160.0,
        ram_kib: 400,
        flash_kib: 0,
        flash_mb_s: 0.0,
        external: quad(16 * MIB, 80.0, 32, 6),
        source: "ESP32-C3 datasheet, 1 and 3.1 (SRAM 400 KB, 16 KB of it cache; SPI0/1)",
    },
    Part {
        name: "playdate",
        core: Core::M7F,
        clock_mhz: 168.0,
        ram_kib: 320,
        flash_kib: 1024,
        flash_mb_s: 448.0,
        // Program and data are loaded into the external RAM, 16 bits wide; cache lines are 32 bytes.
        external: Some(External {
            bytes: 16 * MIB,
            bus_mhz: 84.0,
            lanes: 16,
            line_bytes: 32,
            latency_clocks: 10,
            ram: true,
        }),
        source: "Playdate tech specs (168 MHz, 16 MB, 32 KB L1); STM32F746 datasheet DS10916; bus of the RAM assumed",
    },
    Part {
        name: "nrf51822",
        core: Core::M0,
        clock_mhz: 16.0,
        ram_kib: 16,
        flash_kib: 256,
        flash_mb_s: 64.0,
        external: None,
        source: "nRF51822 product specification v3.1 (micro:bit v1)",
    },
    Part {
        name: "nrf5340",
        core: Core::M33F,
        clock_mhz: 128.0,
        ram_kib: 512,
        flash_kib: 1024,
        flash_mb_s: 85.0,
        external: quad(128 * MIB, 96.0, 4, 4),
        source: "nRF5340 product specification v1.3, application core, QSPI",
    },
    Part {
        name: "stm32g474",
        core: Core::M4F,
        clock_mhz: 170.0,
        ram_kib: 128,
        flash_kib: 512,
        flash_mb_s: 272.0,
        external: quad(256 * MIB, 133.0, 4, 6),
        source: "STM32G474xE datasheet DS12288; RM0440, 3.3 (wait states)",
    },
    Part {
        name: "samd51",
        core: Core::M4F,
        clock_mhz: 120.0,
        ram_kib: 256,
        flash_kib: 1024,
        flash_mb_s: 320.0,
        external: quad(16 * MIB, 60.0, 4, 6),
        source: "SAM D5x/E5x datasheet DS60001507 (SAMD51x20, QSPI, NVMCTRL)",
    },
    Part {
        name: "imxrt1062",
        core: Core::M7F,
        clock_mhz: 600.0,
        ram_kib: 1024,
        flash_kib: 0,
        flash_mb_s: 0.0,
        external: quad(8 * MIB, 133.0, 32, 6),
        source: "i.MX RT1060 datasheet IMXRT1060CEC, FlexSPI (Teensy 4.1: 8 MB)",
    },
    Part {
        name: "ra4m1",
        core: Core::M4F,
        clock_mhz: 48.0,
        ram_kib: 32,
        flash_kib: 256,
        flash_mb_s: 96.0,
        external: None,
        source: "RA4M1 group datasheet R01DS0355 (Arduino UNO R4)",
    },
    Part {
        name: "ch32v307",
        core: Core::RiscVF,
        clock_mhz: 144.0,
        ram_kib: 64,
        flash_kib: 256,
        flash_mb_s: 288.0,
        external: None,
        source: "CH32V307 datasheet (64 KB RAM, 256 KB flash without wait states)",
    },
];

/// A part's row as JSON.
pub fn json(part: &Part) -> Value {
    json!({
        "name": part.name,
        "core": part.core.name(),
        "fpu": part.core.has_fpu(),
        "clock_mhz": part.clock_mhz,
        "ram_bytes": u64::from(part.ram_kib) * 1024,
        "flash_bytes": u64::from(part.flash_kib) * 1024,
        "flash_mb_s": part.flash_mb_s,
        "external_bytes": part.external.map(|e| e.bytes),
        "external_mb_s": part.external.map(|e| e.bandwidth_mb_s()),
        "external_is_ram": part.external.is_some_and(|e| e.ram),
        "cycles_per_instruction": part.core.cycles_per_instruction()[1],
        "source": part.source,
    })
}

/// The table as text. Bandwidths are those of random reads.
pub fn summary() -> String {
    let mut text = format!(
        "{:<10} {:<12} {:>5} {:>4} {:>8} {:>9} {:>9} {:>10} {:>9}  {}\n",
        "part", "core", "MHz", "FPU", "RAM KB", "flash KB", "MB/s", "extern. MB", "MB/s", "source"
    );
    for part in &PARTS {
        let external = |value: fn(&External) -> f64, digits: usize| {
            part.external.as_ref().map_or_else(|| "-".to_owned(), |e| format!("{:.digits$}", value(e)))
        };
        text += &format!(
            "{:<10} {:<12} {:>5} {:>4} {:>8} {:>9} {:>9} {:>10} {:>9}  {}\n",
            part.name,
            part.core.name(),
            part.clock_mhz,
            if part.core.has_fpu() { "yes" } else { "no" },
            part.ram_kib,
            part.flash_kib,
            part.flash_mb_s,
            external(|e| e.bytes as f64 / MIB as f64, 0),
            external(|e| e.bandwidth_mb_s(), 1),
            part.source
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_possible() {
        for (i, part) in PARTS.iter().enumerate() {
            assert!(PARTS[..i].iter().all(|p| p.name != part.name), "{}", part.name);
            assert!((10.0..1000.0).contains(&part.clock_mhz) && part.ram_kib >= 16, "{}", part.name);
            assert_eq!(part.flash_kib == 0, part.flash_mb_s == 0.0, "{}", part.name);
            assert!(part.flash_kib > 0 || part.external.is_some(), "{}: no memory for a program", part.name);
            assert!(!part.source.is_empty());
            if let Some(external) = part.external {
                let peak = external.bus_mhz * f64::from(external.lanes) / 8.0;
                assert!(external.bandwidth_mb_s() < peak, "{}", part.name);
                assert!(external.bandwidth_mb_s() > 0.1 * peak, "{}", part.name);
            }
            let [low, middle, high] = part.core.cycles_per_instruction();
            assert!(low < middle && middle < high);
        }
        // 8 bytes of an RP2040: 12 clocks of latency and 16 of data at 66.5 MHz.
        let external = PARTS[0].external.expect("an RP2040 has external flash");
        assert!((external.bandwidth_mb_s() - 19.0).abs() < 0.01);
    }
}
