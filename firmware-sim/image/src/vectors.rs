//! The interrupt vectors of the boards. No image enables an interrupt, so all are the default handler. Without this
//! module the runtime reserves a vector for every interrupt that a Cortex-M can have, which takes a kilobyte.

/// Number of interrupts of the board; the largest of the boards that share this value.
const INTERRUPTS: usize = if cfg!(an505) { 96 } else { 32 };

unsafe extern "C" {
    fn DefaultHandler();
}

/// The part of the vector table after the exceptions.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [unsafe extern "C" fn(); INTERRUPTS] = [DefaultHandler; INTERRUPTS];
