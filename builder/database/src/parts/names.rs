//! Names of parts, and of the emulated boards that stand for some.

use thiserror::Error;

use super::table::{PARTS, Part};

/// The emulated boards of `gestus-sim board`, each with the part that is usual with its core.
pub const EMULATED: [(&str, &str); 8] = [
    ("m4f", "stm32f405"),
    ("m7", "stm32h743"),
    ("m33", "rp2350"),
    ("rv32imafc", "ch32v307"),
    ("rv32imac", "esp32-c3"),
    ("rv32imc", "esp32-c3"),
    ("armv6m", "rp2040"),
    // The micro:bit, which QEMU emulates, has this part.
    ("m0", "nrf51822"),
];

/// A name that neither a part nor an emulated board has.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "{name}: there is no such part: there are {} (`gestus-sim run --board list` prints the table), and the emulated boards, which \
     stand for a part: {}",
    PARTS.map(|part| part.name).join(", "),
    EMULATED.map(|(board, part)| format!("{board} for {part}")).join(", ")
)]
pub struct UnknownPart {
    /// The name.
    pub name: String,
}

/// Finds a part by its name or that of an emulated board, ignoring case and separators: `STM32F405` or `stm32-f405`.
///
/// # Errors
/// An unknown name; the message lists the parts.
pub fn find(name: &str) -> Result<&'static Part, UnknownPart> {
    find_with_name(name).map(|(_, part)| part)
}

/// The same, with the name that was found, as the table spells it: the part's, or that of the emulated board.
///
/// # Errors
/// As [`find`].
pub fn find_with_name(name: &str) -> Result<(&'static str, &'static Part), UnknownPart> {
    let wanted = plain(name);
    let emulated = EMULATED.iter().find(|(board, _)| *board == wanted);
    let of_part = emulated.map_or(wanted, |(_, part)| plain(part));
    let part = PARTS.iter().find(|part| plain(part.name) == of_part);
    let part = part.ok_or_else(|| UnknownPart { name: name.to_owned() })?;
    Ok((emulated.map_or(part.name, |(board, _)| board), part))
}

fn plain(name: &str) -> String {
    name.trim().to_ascii_lowercase().replace(['-', '_', ' '], "")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_and_unknown_ones_are_answered_with_the_list() {
        for part in &PARTS {
            assert_eq!(find_with_name(&part.name.to_uppercase()), Ok((part.name, part)));
        }
        assert_eq!(find("ESP32C3").map(|part| part.name), Ok("esp32-c3"));
        for (board, part) in EMULATED {
            let found = find_with_name(&board.to_uppercase());
            assert_eq!(found.map(|(asked, part)| (asked, part.name)), Ok((board, part)));
        }
        let error = find("z80").expect_err("it is not");
        assert_eq!(error.name, "z80");
        let said = error.to_string();
        assert!(said.contains("rp2040") && said.contains("playdate") && said.contains("m4f"), "{said}");
        assert!(find("").is_err());
    }
}
