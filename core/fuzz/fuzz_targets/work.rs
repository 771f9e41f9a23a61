//! Blobs and streams that take as much work as can be: no step takes more than [`Database::worst_step`] says, and `open`
//! takes time in proportion to the bytes.
//!
//! A fuzzer keeps what reaches new code. Here it also keeps what costs more than all before: how near the work came to
//! its bound is written to counters that libFuzzer reads as if they were branches.
#![no_main]

use std::{
    sync::atomic::{AtomicU8, Ordering},
    time::{Duration, Instant},
};

use gestus_core::{Config, Database, Method, Observer, Pose, Stage, Stylizer, search::found::Found};
use gestus_core_fuzz::{JOINTS, pose, sealed};
use libfuzzer_sys::fuzz_target;

/// Levels of cost that are told apart: sixteenths of the bound, or powers of two.
const LEVELS: usize = 17;
/// Distances, examples, bytes read, time of `open`.
const KINDS: usize = 4;

// `used`: nothing here reads it.
// SAFETY: libFuzzer reads this section as an array of bytes, which atomic bytes are.
#[used]
#[unsafe(link_section = "__libfuzzer_extra_counters")]
static COSTS: [[AtomicU8; LEVELS]; KINDS] = [const { [const { AtomicU8::new(0) }; LEVELS] }; KINDS];

/// Marks a cost as reached, and all below it.
fn reached(kind: usize, level: usize) {
    for slot in COSTS[kind].iter().take(level + 1) {
        slot.store(1, Ordering::Relaxed);
    }
}

/// Sixteenths of the bound; it has to hold.
fn compare(kind: usize, counted: u32, most: u32) {
    assert!(counted <= most, "kind {kind}: {counted} counted, {most} at most");
    reached(kind, (16 * u64::from(counted) / u64::from(most.max(1))) as usize);
}

#[derive(Default)]
struct Counted {
    distances: u32,
    decoded: u32,
}

impl Observer<JOINTS> for Counted {
    fn stage(&mut self, stage: Stage) {
        self.decoded += u32::from(stage == Stage::Decode);
    }
    fn searched(&mut self, _class: usize, found: &Found<'_>) {
        self.distances += found.stats.visits;
    }
}

fuzz_target!(|bytes: &[u8]| {
    let (blob, rest) = sealed(bytes);
    let Some(database) = opened(&blob) else { return };
    let mut rest = rest.iter().copied().cycle();
    let mut byte = || rest.next().unwrap_or(0x3c);
    let config = Config::new()
        .method(Method::ALL[usize::from(byte()) % Method::ALL.len()])
        .visits(64 + 3 * u16::from(byte() & 127))
        .k(1 + u16::from(byte() & 31))
        .classes(1 + (byte() & 7));
    let Ok(mut stylizer) = Stylizer::<JOINTS, 40, 64>::new(database, config) else { return };
    let most = database.worst_step(&config);
    let mut output = Pose::IDENTITY;
    for step in 0..8 {
        // Refused settings leave those before them.
        let styles = [(u16::from(byte()), 1.0), (u16::from(byte()), 1.0)];
        let _ = stylizer.set_style(&styles);
        let _ = stylizer.set_group_style(u16::from(byte() & 7), &styles[1..]);
        let _ = stylizer.set_action((byte() & 3 == 0).then(|| u16::from(byte() & 3)));
        let mut counted = Counted::default();
        let report = stylizer.step_observed(&pose(step, &mut byte), &mut output, &mut counted);
        let now = stylizer.worst_step();
        assert!(now.distances <= most.distances && now.bytes_read <= most.bytes_read, "{now:?}: {most:?}");
        compare(0, report.visits.max(counted.distances), now.distances);
        compare(1, counted.decoded, now.examples * now.mixes);
        compare(2, report.bytes_read, now.bytes_read);
    }
});

/// Opens a blob; a time that is out of all proportion to its length is a fault. A plain blob takes some microseconds a
/// kilobyte, and this one may take 200 times as long, three times in a row.
fn opened(blob: &[u8]) -> Option<Database<'_>> {
    let most = Duration::from_millis(20 + blob.len() as u64 / 1024);
    let time = || {
        let start = Instant::now();
        let opened = Database::open(blob);
        (opened, start.elapsed())
    };
    let (database, took) = time();
    assert!(took < most || (0..2).any(|_| time().1 < most), "{} bytes took {took:?} to open", blob.len());
    let nanoseconds = took.as_nanos() as u64 / (blob.len() as u64).max(1);
    reached(3, (nanoseconds.max(1).ilog2() as usize).min(LEVELS - 1));
    database.ok()
}
