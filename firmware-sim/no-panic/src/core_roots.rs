//! gestus-core cannot panic: every public function of `Database` and `Stylizer`, with arguments that the compiler does not
//! know.

use gestus_core::{Config, Database, Digest, Effort, Pose, Report, Stylizer, blob::Mark, config::parameters};

/// Calls every function and combines the results into one number, so that no call is optimised away.
#[inline(never)]
pub fn reach(blob: &[u8], numbers: &[u32; 32], floats: &[f32; 256]) -> u32 {
    let mark = Mark::from_bits(u64::from(numbers[28]) << 32 | u64::from(numbers[29]));
    let Ok(database) = Database::open_marked(blob, mark) else { return 1 };
    let opened = u32::from(Database::open(blob).is_ok());
    let mut sum =
        opened ^ database.mark().to_bits() as u32 ^ profile::<22, 40, 28>(database, numbers, floats);
    sum ^= profile::<12, 12, 6>(database, numbers, floats);
    sum ^= profile::<64, 64, 256>(database, numbers, floats);
    if let Ok(manifest) = database.manifest() {
        sum ^= u32::from(manifest.styles.find(manifest.unit).unwrap_or(0));
        sum ^= manifest.joints.get(numbers[30] as usize).map_or(0, str::len) as u32;
    }
    sum ^ reads(&database, numbers[31] as usize) ^ sections(&database, numbers[31] as usize, floats)
}

#[inline(never)]
fn profile<const J: usize, const K: usize, const C: usize>(
    database: Database<'_>,
    numbers: &[u32; 32],
    floats: &[f32; 256],
) -> u32 {
    let Ok(mut stylizer) = Stylizer::<J, K, C>::new(database, config(numbers, floats)) else { return 2 };
    let short = |i: usize| numbers[i] as u16;
    let option = |i: usize| (numbers[i] > 65_535).then_some(numbers[i] as u16);
    let mut sum = 0;
    sum ^= u32::from(stylizer.set_style(&[(short(8), floats[8]), (short(9), floats[9])]).is_ok());
    sum ^= u32::from(stylizer.set_action(option(10)).is_ok());
    sum ^= u32::from(stylizer.set_input_style(option(11)).is_ok());
    sum ^= u32::from(stylizer.set_labels(option(10), option(11)).is_ok());
    sum ^= u32::from(stylizer.set_mask(short(12), numbers[13] == 1).is_ok());
    sum ^= u32::from(stylizer.set_strength(short(14), floats[14]).is_ok());
    let own = [(short(4), floats[5]), (short(6), floats[7]), (short(8), floats[9]), (short(5), floats[6])];
    let own = own.get(..numbers[19] as usize).unwrap_or(&own);
    sum ^= u32::from(stylizer.set_group_style(short(9), own).is_ok());
    sum ^= stylizer.style_of(numbers[7] as usize, numbers[8] as usize).to_bits();
    sum ^= stylizer.strength_now(numbers[9] as usize).to_bits();
    sum ^= u32::from(stylizer.set_visits(short(20)).is_ok());
    sum ^= u32::from(stylizer.set_config(config(numbers, floats).k(short(21))).is_ok());
    if numbers[22] == 1 {
        sum ^= u32::from(stylizer.restore(config(numbers, floats)).is_ok());
    }
    if numbers[15] == 1 {
        stylizer.reset();
    }
    sum ^= stylizer.style().len() as u32;
    sum ^= u32::from(stylizer.searches(numbers[16] as usize));
    sum ^= stylizer.strength(numbers[17] as usize).to_bits();
    sum ^= u32::from(stylizer.labels().0.unwrap_or(0));
    sum ^= u32::from(stylizer.set_floor([floats[15], floats[16]]).is_ok());
    let effort = Effort { flow: floats[17], weight: floats[18], time: floats[19] };
    sum ^= stylizer.set_effort(effort).map_or(3, |reached| u32::from(reached.is_clamped()));
    sum ^= u32::from(stylizer.config().classes) ^ stylizer.database().identity();

    let mut digest = Digest::new();
    let (mut input, mut output) = (Pose::<J>::IDENTITY, Pose::<J>::IDENTITY);
    for frame in 0..numbers[18] {
        let mut next = floats.iter().cycle().skip((frame & 255) as usize).copied();
        for value in input.position.iter_mut().chain(input.rotations.as_flattened_mut()) {
            *value = next.next().unwrap_or(0.0);
        }
        let report = stepped(&mut stylizer, frame, numbers, &input, &mut output);
        digest.add(&output, numbers[19] as usize, report.step_s);
        sum ^= stylizer.worst_step().distances ^ database.worst_step(stylizer.config()).bytes_read;
        sum ^= stylizer.last_output().map_or(0, |pose| pose.position[0].to_bits());
        sum ^= report.visits ^ report.bytes_read ^ u32::from(report.degraded.bits());
        sum ^= report.classes.iter().map(|s| u32::from(s.class) ^ s.proportion.to_bits()).sum::<u32>();
        sum ^= report.distance2.to_bits() ^ report.predicted_step_s.to_bits();
        sum ^= u32::from(report.contacts[0]) ^ u32::from(report.contacts[1]);
    }
    sum ^ digest.value()
}

/// A step, or a tick with a pose of any number or without one.
fn stepped<const J: usize, const K: usize, const C: usize>(
    stylizer: &mut Stylizer<'_, J, K, C>,
    frame: u32,
    numbers: &[u32; 32],
    input: &Pose<J>,
    output: &mut Pose<J>,
) -> Report {
    match numbers[23].wrapping_add(frame) & 3 {
        0 if numbers[25] == 1 => {
            let mut reports = [Report::default()];
            let (one, outputs) = (core::slice::from_mut(stylizer), core::slice::from_mut(output));
            gestus_core::step_many(one, core::slice::from_ref(input), outputs, &mut reports);
            let [report] = reports;
            report
        }
        0 => stylizer.step(input, output),
        1 => stylizer.step_observed(input, output, &mut ()),
        2 => stylizer.tick(None, output),
        _ => stylizer.tick(Some((input, numbers[24].rotate_left(frame))), output),
    }
}

/// Every parameter of the table, with an arbitrary value.
fn config(numbers: &[u32; 32], floats: &[f32; 256]) -> Config {
    let mut config = Config::new();
    for number in 0..parameters::NAMES.len() as u16 {
        let at = usize::from(number);
        let value = if numbers[1] >> at & 1 == 1 { numbers[at] as f32 } else { floats[at] };
        config = parameters::set(config, number, value).unwrap_or(config);
    }
    config
}

/// Reads a database with indices out of range.
#[inline(never)]
fn reads(database: &Database<'_>, index: usize) -> u32 {
    let joint = database.joint(index);
    let class = database.class(index);
    let mut sum = joint.group ^ joint.parent.unwrap_or(0) ^ class.rows ^ class.first_cycle;
    sum ^= database.clip(index).1 ^ database.feature(index).len();
    sum ^= database.entries(index).map(usize::from).sum::<usize>();
    sum ^= database.edges(index).map(usize::from).iter().sum::<usize>();
    sum ^= database.feature_group(index) ^ usize::from(database.flags(index)) ^ database.timing(index).dof;
    sum ^= database.sections().iter().map(|(_, bytes)| bytes.len()).sum::<usize>();
    let mut dofs = [0.0; 196];
    database.decode(index, &mut dofs);
    database.decode(index, dofs.split_at_mut(index % 196).1);
    sum ^= dofs.iter().fold(0, |sum, d| sum ^ d.to_bits()) as usize;
    sum ^= database.cycle_of(index, index).unwrap_or(0) ^ usize::from(database.paired(index));
    sum ^= database.counterparts(index, index, index).map(|c| c.now.row ^ c.before.row).sum::<usize>();
    let (model, table) = (database.linear_model(index), database.table(index));
    sum ^= database.linear_model_of(index as u16, Some(index as u16)).unwrap_or(0);
    sum ^= model.units().count() ^ model.dof(index)[0].to_bits() as usize ^ model.foot(index).1.count();
    sum ^= table.root(index)[0].to_bits() as usize ^ table.joint(index).1.to_bits() as usize;
    sum ^= database.linear_model(index).units().count() ^ database.table(index).bytes();
    sum ^= database.optional_sections().map(|(_, bytes)| bytes.len()).sum::<usize>();
    sum ^= database.group_of_dof(index) ^ database.toes()[0].unwrap_or(0);
    let floats =
        [database.step(index), database.scale(index), database.feature_scale(index), database.rate_hz()];
    floats.iter().fold(sum as u32, |sum, f| sum ^ f.to_bits())
}

/// What the sections hold, and whether they are there, with indices out of range.
#[inline(never)]
fn sections(database: &Database<'_>, index: usize, floats: &[f32; 256]) -> u32 {
    let id = index as u16;
    let mut sum =
        database.counts().joints ^ database.outputs() ^ database.tables() ^ database.linear_models();
    sum ^= database.optional(id).map_or(0, <[u8]>::len) ^ database.feature_groups().len();
    sum ^=
        database.query_section().len() ^ database.joint_group(index) ^ usize::from(database.is_gait(index));
    sum ^= database.groups().fold(0, |sum, group| sum ^ group);
    sum ^= database.features_by_group().iter().fold(0, |sum, count| sum ^ count);
    sum ^= usize::from(database.linear_from().unwrap_or(id) ^ database.statistic_from().unwrap_or(id));
    sum ^= usize::from(database.has_graph() ^ database.has_phase() ^ database.has_dof_ranges());
    sum ^= usize::from(database.labels(index)[0]) ^ database.classes().fold(0, |sum, class| sum ^ class.rows);
    sum ^= database.table_of(id, Some(id)).map_or(0, |table| table.bytes());
    sum ^= database.legs().map_or(0, |[left, right]| left.ankle ^ right.toe.unwrap_or(0));
    let mut bits =
        database.identity() ^ database.skeleton_fingerprint() ^ database.feature_norm2(index).unwrap_or(0);
    let mut add = |values: &[f32]| bits = values.iter().fold(bits, |bits, value| bits ^ value.to_bits());
    add(&[
        database.fall(index),
        database.length_unit(),
        database.component_step(index),
        database.phase_step(),
    ]);
    add(&database.slope_steps());
    add(&database.hips_line());
    database.means().for_each(|mean| add(&mean));
    database.dof_ranges().for_each(|range| add(&range));
    database.phase_dofs().for_each(|dof| add(&[dof.centre, dof.step, dof.inverse]));
    if let Some(limits) = database.trust_limits(index) {
        add(&[limits.far, limits.turning]);
        add(&limits.speeds);
    }
    let mut sums = [0.0; 40];
    database.whitening().add_products(&mut sums, floats);
    add(&sums);
    for tables in [database.phase_tables(index), database.all_phase_tables()(index)] {
        add(&[tables.gain, tables.far]);
        add(&tables.contact(index));
        sum ^= tables.knots().fold(0, |sum, (knot, _)| sum ^ knot.len()) ^ tables.knot(index).0.len();
        sum ^= tables.row(index, index, index).len() ^ tables.spread().len();
    }
    if let Some(dial) = database.dial() {
        let effort = Effort { flow: floats[20], weight: floats[21], time: floats[22] };
        add(&dial.rest().factors());
        add(&dial.of_style(index).factors());
        add(&dial.range().map(|(low, _)| low));
        sum ^= dial.nodes()[0] ^ usize::from(dial.reached(floats, effort).is_clamped());
        add(&dial.weights(effort).0);
    }
    bits ^ sum as u32
}
