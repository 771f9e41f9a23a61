//! Replays a recording through the core without a host: the digest of every output pose and time step.
//!
//! The recording (`firmware-sim/src/recording.rs`) follows the database in the flash window. Prints
//! `digest VALUE FRAMES`, for `gestus-sim board --long-stream`.
#![no_std]
#![no_main]

use gestus_core::{Config, ConfigError, Database, Digest, Fit, Pose, Stylizer};
use gestus_firmware::{exit, flash};

const JOINTS: usize = 22;
/// Bytes of a recording's header, and of the settings of a frame.
const HEADER: usize = 24;
const SETTINGS: usize = 16;

/// Reads a recording's numbers in order.
struct Reader(&'static [u8]);

impl Reader {
    fn bytes<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (bytes, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*bytes)
    }

    fn number(&mut self) -> Option<f32> {
        Some(f32::from_le_bytes(self.bytes()?))
    }
}

/// Applies a frame's settings. Both labels are cleared before new ones are set, since a database need not have every
/// action in every style.
fn set(stylizer: &mut Stylizer<'_, JOINTS, 40, 28>, settings: [u8; SETTINGS]) -> Result<(), ConfigError> {
    let [a, b, c, d, e, f, g, h, weights @ ..] = settings;
    let label = |bytes| u16::try_from(i16::from_le_bytes(bytes)).ok();
    let [w, x, y, z, tail @ ..] = weights;
    let styles = [
        (u16::from_le_bytes([e, f]), f32::from_le_bytes([w, x, y, z])),
        (u16::from_le_bytes([g, h]), f32::from_le_bytes(tail)),
    ];
    stylizer.set_style(&styles)?;
    stylizer.set_labels(label([a, b]), label([c, d]))
}

/// Digest and number of frames; `None` if there is no recording for the database's skeleton, or it is truncated.
fn replay() -> Option<(u32, u32)> {
    let database = Database::open(flash::blob()).ok()?;
    let mut stylizer = Fit::new(database, Config::new()).ok()?.stylizer();
    let joints = database.counts().joints;
    let mut reader = Reader(flash::after_blob());
    let [header, recorded] = [reader.bytes::<8>()?, reader.bytes::<8>()?];
    let _ = reader.bytes::<{ HEADER - 16 }>()?;
    let (frames, of_joints) = recorded.split_first_chunk::<4>()?;
    let frames = u32::from_le_bytes(*frames);
    if header != *b"GSTREAM1" || u32::from_le_bytes(of_joints.try_into().ok()?) as usize != joints {
        return None;
    }
    let (mut digest, mut before, mut output) = (Digest::new(), None, Pose::<JOINTS>::IDENTITY);
    for _ in 0..frames {
        let settings = reader.bytes::<SETTINGS>()?;
        if before.replace(settings) != Some(settings) {
            set(&mut stylizer, settings).ok()?;
        }
        let mut input = Pose::<JOINTS>::IDENTITY;
        for value in &mut input.position {
            *value = reader.number()?;
        }
        for value in input.rotations.iter_mut().take(joints).flatten() {
            *value = reader.number()?;
        }
        let report = stylizer.step(&input, &mut output);
        digest.add(&output, joints, report.step_s);
    }
    Some((digest.value(), frames))
}

#[cfg_attr(target_arch = "arm", cortex_m_rt::entry)]
#[cfg_attr(target_arch = "riscv32", riscv_rt::entry)]
fn main() -> ! {
    let Some((digest, frames)) = replay() else { semihosting::process::exit(exit::DATABASE) };
    semihosting::println!("digest {digest} {frames}");
    semihosting::process::exit(0)
}
