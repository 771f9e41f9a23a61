//! The boards' own interrupts. No image enables one; one that came all the same would end in the default handler. Without
//! this the runtime lays out a vector for each that a Cortex-M can have, which takes a kilobyte.

/// Interrupts of the board with the most of those that are built alike.
const INTERRUPTS: usize = if cfg!(an505) { 96 } else { 32 };

unsafe extern "C" {
    fn DefaultHandler();
}

/// The part of the vector table behind the exceptions.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [unsafe extern "C" fn(); INTERRUPTS] = [DefaultHandler; INTERRUPTS];
