//! The emulated boards.

use thiserror::Error;

/// A board, its emulator, and how its image is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Board {
    /// Short name.
    pub name: &'static str,
    /// Title for messages.
    pub title: &'static str,
    /// QEMU's executable.
    pub emulator: &'static str,
    /// QEMU's machine. It also selects the board, if only one board has it.
    pub machine: &'static str,
    /// Further arguments of QEMU.
    pub arguments: &'static [&'static str],
    /// The compiler's target.
    pub target: &'static str,
    /// The compiler's `target-cpu`; the target's default if `None`.
    pub cpu: Option<&'static str>,
    /// Binary target of the image.
    pub binary: &'static str,
    /// Name that the firmware reports.
    pub reported: &'static str,
    /// Address at which the database is loaded; `None` if it is part of the image.
    pub blob_address: Option<u32>,
    /// Binary logarithm of an instruction's virtual time, nanoseconds. A timer of the board counts instructions by it.
    pub icount_shift: u8,
    /// Whether `--all --long-stream` includes the board. The micro:bit has no flash for the recording, and boards
    /// without an FPU need minutes for it, so one of them is enough.
    pub long_stream: bool,
}

impl Board {
    /// Whether the target's code computes with floats by instructions.
    pub fn has_fpu(&self) -> bool {
        self.target.ends_with("eabihf") || self.target.contains("imafc")
    }
}

const NO_FPU_CPU: &str = "rv32,f=false,d=false";
const FPU_CPU: &str = "rv32,d=false";
const NO_ATOMICS_CPU: &str = "rv32,a=false,f=false,d=false";

/// All boards.
pub const BOARDS: [Board; 8] = [
    Board {
        name: "m4f",
        title: "Cortex-M4F (MPS2 AN386)",
        emulator: "qemu-system-arm",
        machine: "mps2-an386",
        arguments: &[],
        target: "thumbv7em-none-eabihf",
        // Not "cortex-m4", for which LLVM splits VMLA into VMUL and VADD. VMLA takes 3 cycles on that core, and so do
        // the other two if one depends on the other, as in every hot loop here. Saves 10% of instructions and 5% of
        // flash.
        cpu: None,
        binary: "mps2",
        reported: "mps2-an386",
        blob_address: Some(0x2100_0000),
        icount_shift: 6,
        long_stream: true,
    },
    Board {
        name: "m7",
        title: "Cortex-M7 (MPS2 AN500)",
        emulator: "qemu-system-arm",
        machine: "mps2-an500",
        arguments: &[],
        target: "thumbv7em-none-eabihf",
        cpu: Some("cortex-m7"),
        binary: "mps2",
        reported: "mps2-an500",
        blob_address: Some(0x6000_0000),
        icount_shift: 6,
        long_stream: true,
    },
    Board {
        name: "m33",
        title: "Cortex-M33 (MPS2 AN505)",
        emulator: "qemu-system-arm",
        machine: "mps2-an505",
        arguments: &[],
        target: "thumbv8m.main-none-eabihf",
        cpu: Some("cortex-m33"),
        binary: "mps2",
        reported: "mps2-an505",
        blob_address: Some(0x8000_0000),
        icount_shift: 6,
        long_stream: true,
    },
    Board {
        name: "rv32imafc",
        title: "RISC-V with FPU (virt)",
        emulator: "qemu-system-riscv32",
        machine: "virt",
        arguments: &["-bios", "none", "-cpu", FPU_CPU],
        target: "riscv32imafc-unknown-none-elf",
        cpu: None,
        binary: "virt",
        reported: "virt-rv32imafc",
        blob_address: Some(0x8100_0000),
        icount_shift: 0,
        long_stream: true,
    },
    Board {
        name: "rv32imac",
        title: "RISC-V without FPU (virt)",
        emulator: "qemu-system-riscv32",
        machine: "virt",
        arguments: &["-bios", "none", "-cpu", NO_FPU_CPU],
        target: "riscv32imac-unknown-none-elf",
        cpu: None,
        binary: "virt",
        reported: "virt-rv32imac",
        blob_address: Some(0x8100_0000),
        icount_shift: 0,
        long_stream: true,
    },
    Board {
        name: "rv32imc",
        title: "RISC-V without FPU or atomics (virt)",
        emulator: "qemu-system-riscv32",
        machine: "virt",
        arguments: &["-bios", "none", "-cpu", NO_ATOMICS_CPU],
        target: "riscv32imc-unknown-none-elf",
        cpu: None,
        binary: "virt",
        reported: "virt-rv32imc",
        blob_address: Some(0x8100_0000),
        icount_shift: 0,
        long_stream: false,
    },
    Board {
        name: "armv6m",
        // No emulated Cortex-M0+ has enough RAM for the reference, so its code runs on a Cortex-M4.
        title: "Armv6-M code (MPS2 AN386)",
        emulator: "qemu-system-arm",
        machine: "mps2-an386",
        arguments: &[],
        target: "thumbv6m-none-eabi",
        cpu: None,
        binary: "mps2",
        reported: "mps2-an386-armv6m",
        blob_address: Some(0x2100_0000),
        icount_shift: 6,
        long_stream: false,
    },
    Board {
        name: "m0",
        title: "Cortex-M0, 16 KB RAM (micro:bit)",
        emulator: "qemu-system-arm",
        machine: "microbit",
        arguments: &[],
        target: "thumbv6m-none-eabi",
        cpu: None,
        binary: "microbit",
        reported: "microbit",
        blob_address: None,
        icount_shift: 6,
        long_stream: false,
    },
];

/// A name by which no board can be chosen.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum BoardError {
    /// No board has it.
    #[error("there is no board `{0}`: there are {list}", list = names())]
    Unknown(String),
    /// It is the machine of these boards.
    #[error("`{machine}` is the machine of several boards: give one of {list}", list = listed(.boards))]
    Several {
        /// The name.
        machine: String,
        /// The boards.
        boards: Vec<&'static Board>,
    },
}

/// The short names of all boards.
pub fn names() -> String {
    listed(&BOARDS.each_ref())
}

/// Finds a board by its short name, the name that its firmware reports, or QEMU's machine if only one board has it.
///
/// # Errors
/// An unknown name, and a machine of several boards; the message lists the boards.
pub fn find(name: &str) -> Result<&'static Board, BoardError> {
    if let Some(board) = BOARDS.iter().find(|b| b.name == name || b.reported == name) {
        return Ok(board);
    }
    let of_machine: Vec<&'static Board> = BOARDS.iter().filter(|b| b.machine == name).collect();
    match of_machine[..] {
        [board] => Ok(board),
        [] => Err(BoardError::Unknown(name.to_owned())),
        _ => Err(BoardError::Several { machine: name.to_owned(), boards: of_machine }),
    }
}

fn listed(boards: &[&Board]) -> String {
    boards.iter().map(|b| b.name).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boards_are_found_by_name_machine_and_report() {
        for board in &BOARDS {
            assert_eq!(find(board.name).unwrap(), board);
            assert_eq!(find(board.reported).unwrap(), board);
        }
        assert_eq!(find("mps2-an386").unwrap().name, "m4f");
        let boards = ["rv32imafc", "rv32imac", "rv32imc"].map(|name| find(name).unwrap()).to_vec();
        assert_eq!(find("virt"), Err(BoardError::Several { machine: "virt".into(), boards }));
        assert_eq!(find("m5"), Err(BoardError::Unknown("m5".into())));
    }
}
