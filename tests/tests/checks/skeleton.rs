//! Manifest, skeleton, legs, dofs and the query.

use super::*;

#[test]
fn the_manifest() {
    let refused = |name: &str, blob: &[u8]| refuses(name, blob, BlobError::Manifest);
    refused("empty", &with_section(blob(), section::MANIFEST, Vec::clear));
    refused("cut", &with_section(blob(), section::MANIFEST, |b| b.truncate(20)));
    refused("no text", &patched(blob(), section::MANIFEST, 3, &[0xff]));
    // One name less than there are: a line break becomes a space.
    for name in ["Spine", "heavy", "left-arm"] {
        let at = bytes(section::MANIFEST).windows(name.len()).position(|w| w == name.as_bytes()).unwrap();
        assert_eq!(bytes(section::MANIFEST)[at - 1], b'\n', "{name} is not the first of its list");
        refused(name, &patched(blob(), section::MANIFEST, at - 1, b" "));
    }
    // One more.
    for name in ["walk-normal-0", "walk"] {
        let at = bytes(section::MANIFEST).windows(name.len()).position(|w| w == name.as_bytes()).unwrap();
        refused(name, &patched(blob(), section::MANIFEST, at + 2, b"\n"));
    }
}

#[test]
fn the_skeleton() {
    let record = |j: usize, at: usize| j * joint::LENGTH + at;
    let bad = |name: &str, j: usize, at: usize, written: &[u8]| {
        refuses_value(name, section::SKELETON, record(j, at), written, j);
    };
    bad("the root has a parent", 0, joint::PARENT, &[0]);
    bad("its own parent", 3, joint::PARENT, &[3]);
    bad("a later parent", 3, joint::PARENT, &[4]);
    bad("a second root", 3, joint::PARENT, &[joint::ROOT]);
    for v in [101.0, -101.0].into_iter().chain(NOT_FINITE) {
        bad("offset", 5, joint::OFFSET.start + 4, &float(v));
    }
    for v in [0.5, -2.0].into_iter().chain(NOT_FINITE) {
        bad("mean", 6, joint::MEAN.start + 12, &float(v));
    }
    for at in joint::RESERVED {
        let changed = patched(blob(), section::SKELETON, record(2, at), &[1]);
        refuses("reserved", &changed, BlobError::Reserved { section: section::SKELETON });
    }
    // A group beyond the last, with the features of its joints in it, so that lengths still agree.
    let c = *database().counts();
    let mut group = blob().to_vec();
    let (skeleton, groups) = (patch::section(blob(), section::SKELETON), feature_groups());
    for j in (0..c.joints).filter(|&j| database().joint_group(j) == 2) {
        group[skeleton.start + record(j, joint::GROUP)] = 7;
    }
    for f in (0..c.features).filter(|&f| database().feature_group(f) == 2) {
        group[groups.start + f] = 7;
    }
    patch::repair(&mut group);
    let first = (0..c.joints).find(|&j| database().joint_group(j) == 2).unwrap();
    refuses("group", &group, value(section::SKELETON, first));

    let trailer = c.joints * joint::LENGTH;
    let in_trailer = |name: &str, at: usize, written: &[u8]| {
        refuses_value(name, section::SKELETON, trailer + at, written, c.joints);
    };
    for v in [0.0, 2.0].into_iter().chain(NOT_FINITE) {
        in_trailer("hips line", joint::HIPS_LINE.start, &float(v));
    }
    in_trailer("left toes", joint::TOES.start, &[c.joints as u8]);
    in_trailer("right toes", joint::TOES.start + 1, &[254]);
    let no_toes =
        patched(blob(), section::SKELETON, trailer + joint::TOES.start, &[joint::ROOT, joint::ROOT]);
    assert_eq!(Database::open(&no_toes).unwrap().toes(), [None, None]);
    for at in joint::TOES.end..joint::TRAILER {
        let changed = patched(blob(), section::SKELETON, trailer + at, &[1]);
        refuses("reserved", &changed, BlobError::Reserved { section: section::SKELETON });
    }
}

#[test]
fn legs_are_chains_at_heights_of_a_body() {
    let legs = database().legs().unwrap();
    let bad = |name: &str, side: usize, at: usize, written: &[u8]| {
        refuses_value(name, section::FEET, side * foot::LENGTH + at, written, side);
    };
    bad("the root as a hip", 0, foot::HIP, &[0]);
    bad("no such hip", 1, foot::HIP, &[database().counts().joints as u8]);
    bad("a knee of the other leg", 0, foot::KNEE, &[legs[1].knee as u8]);
    bad("no such ankle", 1, foot::ANKLE, &[254]);
    bad("toes on the knee", 0, foot::TOE, &[legs[0].knee as u8]);
    for v in [10.5, -10.5].into_iter().chain(NOT_FINITE) {
        bad("height", 1, foot::TOE_HEIGHT.start, &float(v));
        bad("height", 0, foot::ANKLE_HEIGHT.start, &float(v));
    }
    let rolled = patched(blob(), section::FEET, foot::LENGTH + foot::ANKLE_ROLL.start, &[0xe8, 0x03]);
    assert_eq!(Database::open(&rolled).unwrap().legs().unwrap()[1].rolls[0], 1000.0 * foot::ROLL_STEP_M);
    let no_toes = patched(blob(), section::FEET, foot::TOE, &[foot::NO_TOE]);
    assert_eq!(Database::open(&no_toes).unwrap().legs().unwrap()[0].toe, None);
    let short = patch::with_section(blob(), section::FEET, |bytes| bytes.truncate(foot::LENGTH));
    let (need, have) = (2 * foot::LENGTH as u32, foot::LENGTH as u32);
    refuses("one leg", &short, BlobError::Length { section: section::FEET, need, have });
}

/// Where the groups of the features are in the blob.
fn feature_groups() -> Range<usize> {
    let c = *database().counts();
    let start = patch::section(blob(), section::QUERY).start + query::groups(c.window, c.joints, c.features);
    start..start + c.features
}

#[test]
fn dofs_and_their_scales() {
    for (d, range) in [(0, dof_record::STEP), (11, dof_record::STEP), (66, dof_record::SCALE)] {
        for v in [0.0, -1e-3, 1e-10, 1e7].into_iter().chain(NOT_FINITE) {
            refuses_value("dof", section::DOFS, d * dof_record::LENGTH + range.start, &float(v), d);
        }
    }
    refuses_value("large step", section::DOFS, dof_record::STEP.start, &float(1e4), 0);
}

#[test]
fn the_ranges_of_dofs() {
    let dofs = database().counts().dofs;
    let at = |d: usize, range: Range<usize>| dofs * dof_record::LENGTH + d * dof_range::LENGTH + range.start;
    for (d, range) in [(0, dof_range::LEAST), (9, dof_range::LEAST), (dofs - 1, dof_range::GREATEST)] {
        let beyond = if range == dof_range::LEAST { 900.0 } else { -900.0 };
        for v in [beyond, 1e4, -1e4].into_iter().chain(NOT_FINITE) {
            refuses_value("range", section::DOFS, at(d, range.clone()), &float(v), dofs + d);
        }
    }
    let short =
        patch::with_section(blob(), section::DOFS, |bytes| bytes.truncate(bytes.len() - dof_range::LENGTH));
    let need = (dofs * (dof_record::LENGTH + dof_range::LENGTH)) as u32;
    let have = need - dof_range::LENGTH as u32;
    refuses("a dof without its range", &short, BlobError::Length { section: section::DOFS, need, have });
}

#[test]
fn the_query() {
    let c = *database().counts();
    let id = section::QUERY;
    let weights = query::weights(c.window, c.joints, c.features);
    for v in [0.0, -1.0, 1e7, 0.001].into_iter().chain(NOT_FINITE) {
        refuses_value("unit", id, query::UNIT, &float(v), 0);
    }
    let components = query::components(c.window, c.joints, c.features);
    for v in [16_385i16, -16_385, i16::MAX, i16::MIN] {
        refuses_value("component", id, components + 40, &v.to_le_bytes(), components / 2 + 20);
    }
    refuses_value("no weight at all", id, weights, &vec![0; c.joints], 0);
    for v in [0.0, -1.0, 1e7].into_iter().chain(NOT_FINITE) {
        refuses_value("scale", id, query::SCALES + 4 * 3, &float(v), 3);
        refuses_value("step", id, query::steps(c.features) + 4 * 3, &float(v), 3);
    }
    // A feature of a group that has no joint needs no coordinates.
    let last = c.features - 1;
    let joints =
        (0..c.joints).filter(|&j| database().joint_group(j) == database().feature_group(last)).count();
    let nowhere = with_section(blob(), id, |b| {
        b.truncate(b.len() - 6 * c.window * joints);
        b[query::groups(c.window, c.joints, c.features) + last] = c.groups as u8;
    });
    refuses("group", &nowhere, value(id, last));
    // Without the last feature there is one byte of padding behind the groups.
    let mut fewer = blob().to_vec();
    for (id, change) in [(section::QUERY, true), (section::FEATURES, false)] {
        fewer = rebuilt(&fewer, id, |b| {
            if change {
                b.truncate(b.len() - 6 * c.window * joints);
                b[query::groups(c.window, c.joints, c.features) + last] = 1;
                // The step first, which lies behind the scale.
                for at in [query::steps(c.features) + 4 * last, query::SCALES + 4 * last] {
                    b.drain(at..at + 4);
                }
            } else {
                let kept: Vec<u8> = b.chunks(c.features).flat_map(|f| f[..last].iter().copied()).collect();
                *b = kept;
            }
        });
    }
    fewer[header::FEATURES].copy_from_slice(&(last as u16).to_le_bytes());
    patch::repair(&mut fewer);
    refuses("padding of the groups", &fewer, BlobError::Reserved { section: id });
}
