//! `Database::open` on damaged bytes: it returns an error or opens, and never panics. Any blob that opens can be stepped.

use std::sync::OnceLock;

use gestus_core::{
    BlobError, Config, Database, Effort, Method, Pose, Stylizer,
    blob::{Mark, layout::section},
};
use gestus_database::{
    blob::assemble::{assemble, with_section},
    effort::{Source, dial::Dial},
    stream::to_pose,
};
use gestus_tests::{motion, patch};
use proptest::prelude::*;

/// Steps through a blob that opens: no panic, and valid output poses.
fn open_and_step(blob: &[u8]) -> Result<(), BlobError> {
    let database = Database::open(blob)?;
    let _ = database.manifest();
    for method in Method::ALL {
        step_by(database, Config::new().method(method).halflife_s(0.5));
    }
    Ok(())
}

fn step_by(database: Database<'_>, config: Config) {
    let counts = *database.counts();
    // A database that fits no stylizer is refused there, which other tests check.
    let Ok(mut stylizer) = Stylizer::<22, 40, 28>::new(database, config) else { return };
    for style in 0..counts.styles {
        let _ = stylizer.set_style(&[(style as u16, 1.0), (0, 0.5)]);
    }
    if let Ok(reached) = stylizer.set_effort(Effort::new([9.0, -0.4, f32::NAN])) {
        assert!(reached.effort.factors().iter().all(|f| f.is_finite()), "{reached:?}");
        assert!((stylizer.style().iter().sum::<f32>() - 1.0).abs() < 1e-3, "{:?}", stylizer.style());
    }
    let mut output = Pose::IDENTITY;
    for (t, frame) in motion::unseen(0, 0, 12).frames.iter().enumerate() {
        if t == 4 {
            let _ = stylizer.set_mask(0, false);
        }
        if t == 8 {
            let _ = stylizer.set_style(&[(0, 1.0)]);
        }
        let report = stylizer.step(&to_pose(frame), &mut output);
        assert!(output.is_valid(counts.joints), "frame {t}: {output:?}");
        assert!(report.step_s.is_finite(), "frame {t}: {report:?}");
    }
}

#[test]
fn the_whole_blob_opens() {
    assert_eq!(open_and_step(motion::tiny()), Ok(()));
}

/// Every byte is covered by a checksum, or has to be zero.
#[test]
fn any_flipped_byte_is_refused() {
    let mut blob = motion::tiny().to_vec();
    // Every byte of header and table, but only every 13th of the rest, to save time.
    let places = (0..400).chain((400..blob.len()).step_by(13));
    for at in places {
        for bits in [1u8, 0x80, 0xff] {
            blob[at] ^= bits;
            assert!(Database::open(&blob).is_err(), "byte {at}, bits {bits:02x}");
            blob[at] ^= bits;
            if at > 400 {
                break;
            }
        }
    }
}

#[test]
fn any_other_length_is_refused() {
    let blob = motion::tiny();
    for length in (0..blob.len()).step_by(61).chain(blob.len() - 40..blob.len()) {
        assert!(Database::open(&blob[..length]).is_err(), "{length} bytes");
    }
    for more in [1, 2, 15, 16, 1000] {
        let longer = [blob, &vec![0; more]].concat();
        let (need, have) = (blob.len() as u32, longer.len() as u32);
        assert_eq!(Database::open(&longer).err(), Some(BlobError::Truncated { need, have }));
    }
}

#[test]
fn all_frames_have_edges_or_none_has() {
    let database = Database::open(motion::tiny()).unwrap();
    let with = |edges: fn(&[u8]) -> &[u8]| {
        let required = database.sections().into_iter();
        let sections = required
            .chain(database.optional_sections())
            .map(|(id, bytes)| (id, if id == section::GRAPH { edges(bytes) } else { bytes }.to_vec()));
        assemble(database.counts(), f64::from(database.rate_hz()), &sections.collect::<Vec<_>>())
    };
    assert_eq!(open_and_step(&with(|edges| edges)), Ok(()));
    assert_eq!(open_and_step(&with(|_| &[])), Ok(()));
    let half = with(|edges| &edges[..edges.len() / 2]);
    assert!(matches!(Database::open(&half), Err(BlobError::Length { section: section::GRAPH, .. })));
}

/// The blob with an effort dial.
fn dialled() -> &'static [u8] {
    static BLOB: OnceLock<Vec<u8>> = OnceLock::new();
    BLOB.get_or_init(|| {
        let efforts = vec![Some([0.0, 0.0, 0.0]), Some([1.0, 2.0, -1.0])];
        let dial = Dial::new(Source::Estimated, efforts, 0);
        with_section(motion::tiny(), section::EFFORT, &dial.section()).unwrap()
    })
}

#[test]
fn a_blob_with_a_dial_opens_and_a_stream_obeys_it() {
    assert_eq!(open_and_step(dialled()), Ok(()));
    let database = Database::open(dialled()).unwrap();
    let dial = database.dial().unwrap();
    let mut stylizer = Box::new(Stylizer::<22, 40, 28>::new(database, Config::new()).unwrap());
    for (weight, share) in [(0.0, 0.0), (1.0, 0.5), (2.0, 1.0)] {
        let reached = stylizer
            .set_effort(Effort { weight, ..Effort::new([0.5 * weight, 0.0, -0.5 * weight]) })
            .unwrap();
        assert!(!reached.is_clamped() && (reached.effort.weight - weight).abs() < 0.15, "{reached:?}");
        assert!((stylizer.style()[1] - share).abs() < 0.1, "{weight}: {:?}", stylizer.style());
    }
    let far = stylizer.set_effort(Effort::new([-3.0, 3.0, 3.0])).unwrap();
    assert!(far.is_clamped());
    assert_eq!(dial.range().map(|r| r.1), [1.0, 2.0, 0.0]);
    let without = Database::open(motion::tiny()).unwrap();
    let mut stylizer = Box::new(Stylizer::<22, 40, 28>::new(without, Config::new()).unwrap());
    assert_eq!(stylizer.set_effort(Effort::default()), Err(gestus_core::ConfigError::NoDial));
    assert_eq!(stylizer.style(), [1.0, 0.0]);
}

/// Offsets to test more often than their share of the file: header, table, and the small sections.
fn place() -> impl Strategy<Value = usize> {
    let blob = motion::tiny();
    let small: Vec<std::ops::Range<usize>> =
        [2u16, 3, 5, 6, 7, 8, 9, 10, 14, 15, 32, 33].map(|id| patch::section(blob, id)).into();
    prop_oneof![
        2 => 0..304usize,
        4 => prop::sample::select(small).prop_flat_map(|r| r),
        2 => 0..blob.len(),
    ]
}

/// Bytes at the limits of a number's range, or any byte.
fn value() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        any::<u8>().prop_map(|b| vec![b]),
        prop::sample::select(vec![0u16, 1, 2, 255, 256, 0x7fff, 0xfffe, 0xffff])
            .prop_map(|v| v.to_le_bytes().to_vec()),
        prop::sample::select(vec![0u32, 1, 0x7fff_ffff, 0xffff_ffff, 0x8000_0000, 1 << 22])
            .prop_map(|v| v.to_le_bytes().to_vec()),
        prop::sample::select(vec![
            0.0f32,
            -1.0,
            1e-9,
            1e3,
            1e6,
            1e9,
            1e30,
            f32::NAN,
            f32::INFINITY,
            -0.0,
            0.02
        ])
        .prop_map(|v| v.to_le_bytes().to_vec()),
        prop::collection::vec(any::<u8>(), 1..20),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(600) })]

    #[test]
    fn changed_bytes_with_repaired_checksums_never_panic(
        changes in prop::collection::vec((place(), value()), 1..4),
    ) {
        let mut blob = motion::tiny().to_vec();
        for (at, value) in changes {
            let at = at.min(blob.len() - value.len());
            blob[at..at + value.len()].copy_from_slice(&value);
        }
        patch::repair(&mut blob);
        let _ = open_and_step(&blob);
    }

    #[test]
    fn one_number_changed_by_a_little_never_panics(at in place(), by in 1u8..4, up in any::<bool>()) {
        let mut blob = motion::tiny().to_vec();
        blob[at] = if up { blob[at].wrapping_add(by) } else { blob[at].wrapping_sub(by) };
        patch::repair(&mut blob);
        let _ = open_and_step(&blob);
    }

    #[test]
    fn a_changed_dial_never_panics(changes in prop::collection::vec((0..2000usize, value()), 1..4)) {
        let mut blob = dialled().to_vec();
        let section = patch::section(&blob, section::EFFORT);
        for (at, value) in changes {
            // Half of them in the numbers before the table.
            let at = section.start + if at % 2 == 0 { at / 2 % 70 } else { at % section.len() };
            let at = at.min(blob.len() - value.len());
            blob[at..at + value.len()].copy_from_slice(&value);
        }
        patch::repair(&mut blob);
        let _ = open_and_step(&blob);
    }

    #[test]
    fn a_cut_and_its_total_repaired_never_panics(length in 64..motion::tiny().len()) {
        let mut blob = motion::tiny()[..length].to_vec();
        blob[12..16].copy_from_slice(&(length as u32).to_le_bytes());
        patch::repair(&mut blob);
        prop_assert!(Database::open(&blob).is_err());
    }

    #[test]
    fn random_bytes_behind_a_true_header_never_panic(
        head in 16..64usize,
        rest in prop::collection::vec(any::<u8>(), 0..2000),
    ) {
        let mut blob = motion::tiny()[..head].to_vec();
        blob.extend(rest);
        let total = blob.len() as u32;
        blob[12..16].copy_from_slice(&total.to_le_bytes());
        patch::repair(&mut blob);
        prop_assert!(open_and_step(&blob).is_err());
    }

    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..500)) {
        prop_assert!(Database::open(&bytes).is_err());
    }
}

/// A blob with its mark opens without its sections being read; without it, as ever.
#[test]
fn a_blob_with_its_mark_is_not_checked_again() {
    let blob = motion::tiny();
    let database = Database::open(blob).unwrap();
    let mark = Mark::from_bits(database.mark().to_bits());
    let marked = Database::open_marked(blob, mark).unwrap();
    assert_eq!(marked.counts(), database.counts());
    // A bit of the rows: the checksum of their section finds it, but for the mark.
    let mut damaged = blob.to_vec();
    damaged[patch::section(blob, section::ROWS).start + 100] ^= 1;
    assert!(matches!(Database::open(&damaged), Err(BlobError::Checksum { section: section::ROWS })));
    assert!(Database::open_marked(&damaged, mark).is_ok(), "the caller says that it was checked");
    let others = [0, u64::MAX, mark.to_bits() ^ 1, mark.to_bits() ^ 1 << 32];
    let others = others.into_iter().chain([Database::open(motion::small()).unwrap().mark().to_bits()]);
    for other in others {
        let opened = Database::open_marked(&damaged, Mark::from_bits(other));
        assert!(matches!(opened, Err(BlobError::Checksum { section: section::ROWS })), "{other:x}");
        assert!(Database::open_marked(blob, Mark::from_bits(other)).is_ok(), "{other:x}");
    }
    // The table is checked always: it says where the sections are.
    let mut moved = blob.to_vec();
    moved[patch::entry_of(blob, section::ROWS) + 8] ^= 8;
    assert!(Database::open_marked(&moved, mark).is_err());
}
