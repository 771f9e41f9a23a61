//! The C interface cannot panic: every function, with arguments that the compiler does not know.

use gestus::{config::*, contents::*, crowd::*, database::*, pose::*, settings::*, status::*, stylizer::*};

use crate::Outside;

/// Calls every function and combines the results into one number, so that no call is optimised away.
///
/// # Safety
/// Never called.
#[inline(never)]
pub unsafe fn reach(outside: &Outside) -> u32 {
    let Outside { bytes, length, numbers: n, floats, pointers } = outside;
    let [memory, place, text, from, turns, out, out_turns, report] = *pointers;
    let mut sum = gestus_error_message(n[0]).addr() ^ gestus_version().addr();
    sum ^= gestus_blob_version() as usize ^ gestus_database_size() ^ gestus_database_alignment();
    sum ^= gestus_stylizer_size(n[1]) ^ gestus_stylizer_alignment(n[2]);
    // SAFETY: linked, never run.
    let answers = unsafe {
        [
            gestus_config_default(n[3], place.cast()),
            gestus_database_open(memory, *length, *bytes, n[4] as usize, report.cast(), place.cast()),
            gestus_database_open_marked(
                memory,
                *length,
                *bytes,
                n[4] as usize,
                u64::from(n[19]) << 32 | u64::from(n[20]),
                report.cast(),
                place.cast(),
            ),
            gestus_database_mark(memory.cast(), place.cast()),
            gestus_database_close(memory.cast()),
            gestus_database_counts(memory.cast(), place.cast()),
            gestus_database_name(memory.cast(), n[5], n[6], text.cast(), *length, place.cast()),
            gestus_database_find(memory.cast(), n[7], text.cast(), place.cast()),
            gestus_database_joint(memory.cast(), n[8], place.cast()),
            gestus_database_class(memory.cast(), n[9], place.cast()),
            gestus_stylizer_init(memory, *length, n[10], from.cast(), turns.cast(), place.cast()),
            gestus_stylizer_close(memory.cast()),
            gestus_stylizer_set_style(memory.cast(), from.cast(), turns.cast(), *length),
            gestus_stylizer_set_group_style(memory.cast(), n[13], from.cast(), turns.cast(), *length),
            gestus_stylizer_set_style_name(memory.cast(), text.cast()),
            gestus_stylizer_set_action(memory.cast(), n[11] as i32),
            gestus_stylizer_set_input_style(memory.cast(), n[12] as i32),
            gestus_stylizer_set_labels(memory.cast(), n[11] as i32, n[12] as i32),
            gestus_stylizer_set_mask(memory.cast(), n[13], n[14]),
            gestus_stylizer_set_strength(memory.cast(), n[15], floats[0]),
            gestus_stylizer_set_effort(memory.cast(), floats[2], floats[3], floats[4]),
            gestus_stylizer_set_visits(memory.cast(), n[16]),
            gestus_stylizer_set_parameter(memory.cast(), n[17], floats[5]),
            gestus_stylizer_parameter(memory.cast(), n[18], place.cast()),
            gestus_stylizer_reset(memory.cast()),
            gestus_stylizer_step(
                memory.cast(),
                from.cast(),
                turns.cast(),
                *length,
                out.cast(),
                out_turns.cast(),
                report.cast(),
            ),
            gestus_step_many(memory.cast(), place.cast()),
            gestus_digest(place.cast(), from.cast(), turns.cast(), *length, floats[1]),
        ]
    };
    answers.iter().fold(sum as u32, |sum, &answer| sum.wrapping_mul(31) ^ answer as u32)
}
