//! Retargeting maps and robots cannot panic: opening any bytes, and converting any pose.

use gestus_core::{
    Config, Database, Pose, Stylizer,
    retarget::Map,
    robot::{Drive, Follower, Robot},
};

/// Opens a map and a robot, and converts poses with them.
#[inline(never)]
pub fn reach(bytes: &[u8], numbers: &[u32; 32], floats: &[f32; 256]) -> u32 {
    let mut pose = Pose::<22>::IDENTITY;
    for (value, &float) in pose.position.iter_mut().chain(pose.rotations.as_flattened_mut()).zip(floats) {
        *value = float;
    }
    let mut wide = Pose::<31>::IDENTITY;
    for (value, &float) in wide.rotations.as_flattened_mut().iter_mut().zip(floats) {
        *value = float;
    }
    let mut sum = 0u32;
    if let Ok(map) = Map::open(bytes) {
        if let Ok(database) = Database::open(bytes) {
            sum ^= u32::from(map.fits(&database, numbers[0] as usize).is_ok());
        }
        let (mut here, mut back) = (Pose::<22>::IDENTITY, Pose::<31>::IDENTITY);
        map.to_target(&wide, &mut here);
        map.to_source(&here, &wide, &mut back);
        sum ^= back.position[0].to_bits() ^ map.scale().to_bits() ^ (map.sources() + map.targets()) as u32;
    }
    if let Ok(robot) = Robot::open(bytes) {
        if let Ok(database) = Database::open(bytes) {
            sum ^= u32::from(robot.fits(&database, numbers[1] as usize).is_ok());
        }
        sum ^= robot.groups() as u32;
        if let Ok(mut drive) = Drive::<24>::new(robot, floats) {
            for _ in 0..numbers[2] {
                let driven = drive.step(&pose);
                sum ^= driven.missing_m.to_bits() ^ u32::from(driven.at_limit) ^ driven.lag.to_bits();
                sum ^= u32::from(driven.held);
                sum ^= u32::from(drive.pulse(numbers[3] as usize));
                sum ^= drive.motions().iter().map(|m| m.position.to_bits()).sum::<u32>();
                sum ^= drive.targets().iter().map(|t| t.to_bits()).sum::<u32>();
            }
            sum ^= drive.robot().limb(numbers[7] as usize).map_or(0, |l| l.scale.to_bits());
        }
    }
    sum ^ follow(bytes, &pose, numbers, floats)
}

/// Style and servos in one call, with and without a map.
#[inline(never)]
fn follow(bytes: &[u8], pose: &Pose<22>, numbers: &[u32; 32], floats: &[f32; 256]) -> u32 {
    let (Ok(robot), Ok(database), Ok(map)) = (Robot::open(bytes), Database::open(bytes), Map::open(bytes))
    else {
        return 3;
    };
    let Ok(mut stylizer) = Stylizer::<22, 40, 28>::new(database, Config::new()) else { return 4 };
    let Ok(drive) = Drive::<24>::new(robot, floats) else { return 5 };
    let mut follower = Follower::new(drive);
    let (mut between, mut output, mut sum) = (Pose::<22>::IDENTITY, Pose::<22>::IDENTITY, 0u32);
    for _ in 0..numbers[4] {
        let step = follower.step_robot(&mut stylizer, pose, &mut output, |drive, driven| {
            sum ^= u32::from(drive.pulse(numbers[5] as usize)) ^ driven.lag.to_bits();
        });
        sum ^= u32::from(step.ticks) ^ step.report.step_s.to_bits();
        let step =
            follower.step_robot_mapped(&mut stylizer, (&map, pose), &mut between, &mut output, |_, _| {});
        sum ^= u32::from(step.ticks) ^ u32::from(follower.drive().pulse(numbers[6] as usize));
    }
    sum
}
