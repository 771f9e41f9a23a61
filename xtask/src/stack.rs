//! A bound of the stack of a Cortex-M image, without running it: the largest sum of frames along any path of calls.
//!
//! Frames come from the section `.stack_sizes` (rustc's `-Zemit-stack-sizes`: what a function's prologue takes,
//! pushed registers included); calls from the machine code: `BL`, and branches into another function, which are tail
//! calls. Calls through registers can't be followed: they are counted and named, and the core has none. A cycle of
//! calls has no bound and is an error.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use anyhow::{Context, Result, bail};
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};

/// A path of calls.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bound {
    /// Bytes of all frames along it.
    pub bytes: u64,
    /// The functions and their frames, outermost first.
    pub path: Vec<(String, u64)>,
    /// Functions reachable from the root that call through a register.
    pub indirect: BTreeSet<String>,
}

/// A function of the image.
#[derive(Debug, Default)]
struct Function {
    name: String,
    end: u64,
    frame: u64,
    calls: BTreeSet<u64>,
    indirect: bool,
}

/// The deepest path from the function `root`.
///
/// # Errors
/// A file that is no image of a Cortex-M with `.stack_sizes`, an unknown root, and recursion.
pub fn bound(image: &Path, root: &str) -> Result<Bound> {
    let bytes = fs::read(image).with_context(|| format!("{} can't be read", image.display()))?;
    let file = object::File::parse(&*bytes).with_context(|| image.display().to_string())?;
    let functions = functions(&file).with_context(|| image.display().to_string())?;
    let start = functions.iter().find(|(_, f)| f.name == root).map(|(address, _)| *address);
    let start = start.with_context(|| format!("{}: no function `{root}`", image.display()))?;
    let mut known = BTreeMap::new();
    deepest(&functions, start, &mut Vec::new(), &mut known)?;
    let mut path = Vec::new();
    let mut at = Some(start);
    while let Some(address) = at {
        path.push((functions[&address].name.clone(), functions[&address].frame));
        at = known[&address].1;
    }
    let indirect =
        known.keys().filter(|a| functions[a].indirect).map(|a| functions[a].name.clone()).collect();
    Ok(Bound { bytes: known[&start].0, path, indirect })
}

/// Depth below a function and the call that is deepest, for every function that it reaches.
fn deepest(
    functions: &BTreeMap<u64, Function>,
    at: u64,
    above: &mut Vec<u64>,
    known: &mut BTreeMap<u64, (u64, Option<u64>)>,
) -> Result<u64> {
    if let Some((bytes, _)) = known.get(&at) {
        return Ok(*bytes);
    }
    if above.contains(&at) {
        bail!("`{}` calls itself: its stack has no bound", functions[&at].name);
    }
    above.push(at);
    let (mut most, mut next) = (0, None);
    for &call in &functions[&at].calls {
        let bytes = deepest(functions, call, above, known)?;
        if bytes > most || next.is_none() {
            (most, next) = (bytes, Some(call));
        }
    }
    above.pop();
    let bytes = functions[&at].frame + most;
    known.insert(at, (bytes, next));
    Ok(bytes)
}

fn functions(file: &object::File<'_>) -> Result<BTreeMap<u64, Function>> {
    let mut functions = BTreeMap::new();
    for symbol in file.symbols().filter(|s| s.kind() == SymbolKind::Text && s.size() > 0) {
        // The lowest bit says Thumb.
        let address = symbol.address() & !1;
        let name = symbol.name().unwrap_or_default().to_owned();
        let function = Function { name, end: address + symbol.size(), ..Function::default() };
        // Identical functions are folded into one; the root keeps its name.
        if function.name == "main" || !functions.contains_key(&address) {
            functions.insert(address, function);
        }
    }
    let sizes = file
        .section_by_name(".stack_sizes")
        .context("it has no section .stack_sizes: it was not built for a bound")?;
    for (address, frame) in stack_sizes(sizes.data()?) {
        if let Some(function) = functions.get_mut(&(address & !1)) {
            function.frame = function.frame.max(frame);
        }
    }
    let starts: Vec<u64> = functions.keys().copied().collect();
    for section in file.sections().filter(|s| s.kind() == object::SectionKind::Text) {
        let (base, data) = (section.address(), section.data()?);
        for &start in starts.iter().filter(|&&s| s >= base && s < base + data.len() as u64) {
            let end = functions[&start].end;
            let code = data.get((start - base) as usize..(end - base) as usize).unwrap_or(&[]);
            let (targets, indirect) = calls(code, start);
            // A branch within the function is no call.
            let calls = targets
                .into_iter()
                .filter(|t| !(start..end).contains(t))
                .filter_map(|t| starts.binary_search(&t).ok().map(|i| starts[i]))
                .collect();
            let function = functions.get_mut(&start).context("a function of the list")?;
            (function.calls, function.indirect) = (calls, indirect);
        }
    }
    Ok(functions)
}

/// Entries of `.stack_sizes`: an address of 4 bytes, a size as ULEB128.
fn stack_sizes(mut data: &[u8]) -> Vec<(u64, u64)> {
    let mut sizes = Vec::new();
    while let Some((address, rest)) = data.split_first_chunk::<4>() {
        let length = rest.iter().position(|b| b & 0x80 == 0).map_or(rest.len(), |i| i + 1);
        let size = rest[..length].iter().rev().fold(0, |size, byte| size << 7 | u64::from(byte & 0x7f));
        sizes.push((u64::from(u32::from_le_bytes(*address)), size));
        data = &rest[length..];
    }
    sizes
}

/// Where Thumb code branches to, and whether it calls through a register. Constants between the instructions may look
/// like branches; those that meet the start of no function fall out, the rest makes the bound larger, never smaller.
fn calls(code: &[u8], start: u64) -> (BTreeSet<u64>, bool) {
    let (mut targets, mut indirect) = (BTreeSet::new(), false);
    let halves: Vec<u32> =
        code.as_chunks::<2>().0.iter().map(|h| u32::from(u16::from_le_bytes(*h))).collect();
    let mut i = 0;
    while i < halves.len() {
        let (here, first) = (start + 2 * i as u64, halves[i]);
        let wide = first >> 11 >= 0b11101;
        let offset = if !wide {
            match first {
                // BLX register; BX register but the return address is a tail call.
                f if f & 0xff87 == 0x4780 || (f & 0xff87 == 0x4700 && f != 0x4770) => {
                    indirect = true;
                    None
                }
                f if f >> 11 == 0b11100 => Some(sign_extend(f & 0x7ff, 11) * 2),
                f if f >> 12 == 0b1101 && f >> 8 & 15 < 14 => Some(sign_extend(f & 0xff, 8) * 2),
                _ => None,
            }
        } else {
            halves.get(i + 1).and_then(|&second| wide_branch(first, second))
        };
        if let Some(offset) = offset {
            targets.insert(here.wrapping_add(4).wrapping_add_signed(offset));
        }
        i += if wide { 2 } else { 1 };
    }
    (targets, indirect)
}

/// Offset of `BL`, `B.W` and conditional `B.W` (Armv7-M reference manual, A7.7.12 and A7.7.18).
fn wide_branch(first: u32, second: u32) -> Option<i64> {
    if first >> 11 != 0b11110 || second >> 15 != 1 {
        return None;
    }
    let (s, j1, j2) = (first >> 10 & 1, second >> 13 & 1, second >> 11 & 1);
    let low = second & 0x7ff;
    if second & 0x1000 != 0 {
        // BL (bit 14 set) or B.W.
        let (i1, i2) = (1 ^ j1 ^ s, 1 ^ j2 ^ s);
        let value = s << 24 | i1 << 23 | i2 << 22 | (first & 0x3ff) << 12 | low << 1;
        return Some(sign_extend(value, 25));
    }
    let conditional = second & 0x4000 == 0 && first >> 6 & 15 < 14;
    let value = s << 20 | j2 << 19 | j1 << 18 | (first & 0x3f) << 12 | low << 1;
    conditional.then(|| sign_extend(value, 21))
}

fn sign_extend(value: u32, bits: u32) -> i64 {
    i64::from((value << (32 - bits)) as i32 >> (32 - bits))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn code(halves: &[u16]) -> Vec<u8> {
        halves.iter().flat_map(|h| h.to_le_bytes()).collect()
    }

    #[test]
    fn branches_are_decoded() {
        // As `arm-none-eabi-objdump` shows them: at 0x1000 `bl 0x1100`, at 0x1004 `b.w 0x0f00`, at 0x1008 `b.n 0x1020`.
        let (targets, indirect) = calls(&code(&[0xf000, 0xf87e, 0xf7ff, 0xbf7c, 0xe00a]), 0x1000);
        assert_eq!(targets.into_iter().collect::<Vec<_>>(), [0x0f00, 0x1020, 0x1100]);
        assert!(!indirect);
        // `blx r3`; `bx lr` is a return.
        assert!(calls(&code(&[0x4798]), 0).1);
        assert!(!calls(&code(&[0x4770]), 0).1);
        // `bne.w` 0x200 ahead.
        let (targets, _) = calls(&code(&[0xf040, 0x80fe]), 0);
        assert_eq!(targets.into_iter().collect::<Vec<_>>(), [0x200]);
    }

    #[test]
    fn the_deepest_path_is_found_and_recursion_is_none() {
        let function = |name: &str, frame, calls: &[u64]| Function {
            name: name.into(),
            frame,
            calls: calls.iter().copied().collect(),
            ..Function::default()
        };
        let mut functions = BTreeMap::from([
            (0, function("main", 8, &[10, 20])),
            (10, function("shallow", 100, &[])),
            (20, function("deep", 40, &[30])),
            (30, function("deeper", 80, &[])),
        ]);
        let mut known = BTreeMap::new();
        assert_eq!(deepest(&functions, 0, &mut Vec::new(), &mut known).unwrap(), 128);
        assert_eq!((known[&0].1, known[&20].1), (Some(20), Some(30)));
        functions.insert(30, function("deeper", 80, &[20]));
        let error = deepest(&functions, 0, &mut Vec::new(), &mut BTreeMap::new()).unwrap_err();
        // The line names the function.
        assert_eq!(error.to_string(), "`deep` calls itself: its stack has no bound");
    }

    #[test]
    fn sizes_are_read() {
        let data = [0x01, 0x10, 0, 0, 0x08, 0x21, 0x10, 0, 0, 0xf0, 0x07];
        assert_eq!(stack_sizes(&data), [(0x1001, 8), (0x1021, 0x3f0)]);
    }
}
