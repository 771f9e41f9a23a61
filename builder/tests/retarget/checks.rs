//! What the core checks in a map, and what it makes of bytes that are no map and of poses that are none.

use gestus_core::{
    BlobError, Pose,
    blob::{crc::crc32c, layout::section},
    retarget::{
        Map,
        layout::{self, header, joint, limb, record},
    },
};

use crate::{
    common::{database, walk},
    foreign::Foreign,
};

/// A map with bytes changed and the checksum made right again.
fn patched(at: usize, bytes: &[u8]) -> Vec<u8> {
    let mut map = Foreign::new().mixamo().map().bytes().to_vec();
    map[at..at + bytes.len()].copy_from_slice(bytes);
    repaired(map)
}

fn repaired(mut map: Vec<u8>) -> Vec<u8> {
    map[header::CRC].fill(0);
    let crc = crc32c(&[&map]);
    map[header::CRC].copy_from_slice(&crc.to_le_bytes());
    map
}

#[test]
fn every_check_of_a_map_is_made() {
    const S: u16 = section::RETARGET;
    let whole = Foreign::new().mixamo().map().bytes().to_vec();
    assert!(Map::open(&whole).is_ok());
    let joints = header::LENGTH;
    let n = 21;
    let records = joints + 2 * n * joint::LENGTH;
    let limbs = records + 2 * n * record::LENGTH;
    let value = |record: usize| BlobError::Value { section: S, record: record as u32 };
    let nan = f32::NAN.to_le_bytes();
    let two = 2.0f32.to_le_bytes();
    let cases: Vec<(&str, Vec<u8>, BlobError)> = vec![
        ("magic", patched(0, b"X"), BlobError::Magic),
        ("version", patched(header::VERSION.start, &[9, 0]), BlobError::Version { need: 1, have: 9 }),
        (
            "length",
            repaired(whole[..whole.len() - 8].to_vec()),
            BlobError::Truncated { need: whole.len() as u32, have: whole.len() as u32 - 8 },
        ),
        (
            "counts",
            patched(header::LIMBS.start, &[1, 0]),
            BlobError::Length { section: S, need: whole.len() as u32 - 24, have: whole.len() as u32 },
        ),
        ("too many limbs", patched(header::LIMBS.start, &[9, 0]), value(0)),
        ("no joints", patched(header::SOURCES.start, &[0, 0]), value(0)),
        ("reserved", patched(header::RESERVED.start, &[1]), BlobError::Reserved { section: S }),
        ("scale", patched(header::SCALE.start, &nan), value(0)),
        ("world", patched(header::WORLD.start, &two), value(0)),
        ("hips", patched(header::SOURCE_HIPS.start, &nan), value(0)),
        ("ankle", patched(header::TARGET_ANKLE.start, &nan), value(0)),
        ("parent", patched(joints + joint::LENGTH + joint::PARENT, &[7]), value(2)),
        ("root", patched(joints + joint::PARENT, &[0]), value(1)),
        ("segment", patched(joints + joint::SEGMENT, &[9]), value(1)),
        ("joint reserved", patched(joints + joint::RESERVED.start, &[1]), BlobError::Reserved { section: S }),
        ("offset", patched(joints + n * joint::LENGTH + joint::OFFSET.start, &nan), value(n + 1)),
        ("kind", patched(records + record::KIND, &[2]), value(2 * n + 1)),
        ("root stays", patched(records + record::KIND, &[0]), value(2 * n + 1)),
        ("from", patched(records + record::FROM.start, &[21]), value(2 * n + 1)),
        ("weight", patched(records + record::WEIGHT.start, &two), value(2 * n + 1)),
        ("turn", patched(records + record::TURNS.start, &two), value(2 * n + 1)),
        ("record reserved", patched(records + record::RESERVED, &[1]), BlobError::Reserved { section: S }),
        ("limb", patched(limbs, &[20, 3, 4]), value(4 * n + 1)),
        ("limb kind", patched(limbs + limb::KIND, &[7]), value(4 * n + 1)),
        ("limb reserved", patched(limbs + limb::RESERVED.start, &[1]), BlobError::Reserved { section: S }),
    ];
    for (name, bytes, error) in cases {
        assert_eq!(Map::open(&bytes).err(), Some(error), "{name}");
    }
    let mut damaged = whole.clone();
    damaged[200] ^= 1;
    assert_eq!(Map::open(&damaged).err(), Some(BlobError::Checksum { section: S }));
    assert!(matches!(Map::open(&whole[..50]).err(), Some(BlobError::Truncated { .. })));
    assert_eq!(whole.len(), layout::total(n, n, 4));
}

#[test]
fn any_bytes_are_refused_or_harmless() {
    let whole = Foreign::new().mixamo().map().bytes().to_vec();
    let mut state = 7u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as usize
    };
    let input = gestus_database::stream::to_pose::<24>(&walk().frames[3]);
    for _ in 0..3000 {
        let mut bytes = whole.clone();
        for _ in 0..1 + next() % 3 {
            let at = next() % bytes.len();
            bytes[at] = next() as u8;
        }
        let bytes = repaired(bytes);
        if let Ok(map) = Map::open(&bytes) {
            // Too small a pose is no reason to break either.
            let (mut pose, mut small, mut back) =
                (Pose::<22>::IDENTITY, Pose::<5>::IDENTITY, Pose::<24>::IDENTITY);
            map.to_target(&input, &mut pose);
            map.to_target(&input, &mut small);
            map.to_source(&pose, &input, &mut back);
            assert!(pose.rotations.iter().all(|q| q.iter().all(|v| v.is_finite())));
        }
    }
}

#[test]
fn a_pose_that_is_none_does_no_harm() {
    let foreign = Foreign::new().mixamo();
    let map = foreign.map();
    let map = Map::open(map.bytes()).unwrap();
    let mut input = Pose::<24>::IDENTITY;
    input.position = [f32::NAN, f32::INFINITY, 1.0];
    input.rotations[5] = [f32::NAN; 4];
    let (mut pose, mut back) = (Pose::<22>::IDENTITY, Pose::<24>::IDENTITY);
    map.to_target(&input, &mut pose);
    map.to_source(&pose, &input, &mut back);
    // The stylizer sees that this is no pose, and holds.
    assert!(!pose.is_valid(21));
    // So it does where one rotation alone is none, whatever body part it is of.
    for joint in 0..map.sources() {
        for none in [[f32::NAN; 4], [0.0; 4]] {
            let mut input = Pose::<24>::IDENTITY;
            input.rotations[joint] = none;
            let (mut pose, mut back) = (Pose::<22>::IDENTITY, Pose::<24>::IDENTITY);
            map.to_target(&input, &mut pose);
            assert!(!pose.is_valid(21), "joint {joint}");
            // And the answer's joints without a counterpart stay where they were.
            back.rotations.fill([0.0, 0.6, 0.0, 0.8]);
            let before = back;
            map.to_source(&Pose::<22>::IDENTITY, &input, &mut back);
            assert!(back.is_valid(map.sources()));
            let mut wanted = before;
            map.to_source(&Pose::<22>::IDENTITY, &before, &mut wanted);
            assert_eq!(back, wanted, "joint {joint}");
        }
    }
    assert!(map.fits(&database(), 24).is_ok());
    assert!(map.fits(&database(), 20).is_err());
}
