//! The link cannot panic, whatever bytes arrive.

use gestus_core::{
    Config, Database, Stylizer,
    link::{Board, Driver, Server, buffer_length},
    robot::Robot,
};

/// Serves a stylizer over a line with arbitrary bytes.
#[inline(never)]
pub fn reach(line: &[u8], numbers: &[u32; 32]) -> u32 {
    let (blob, line) = line.split_at_checked(numbers[0] as usize).unwrap_or((line, &[]));
    let Ok(database) = Database::open(blob) else { return 1 };
    let Ok(mut stylizer) = Stylizer::<22, 40, 28>::new(database, Config::new()) else { return 2 };
    // The robot's tables are arbitrary bytes too; any that open are driven.
    if let Some(driver) = Robot::open(line).ok().and_then(|r| Driver::<_, 32>::new((), r, &database).ok()) {
        let mut server = Server::<_, 22, 40, 28, { buffer_length(22) }>::new(&mut stylizer, driver);
        return fed(&mut server, line);
    }
    let mut server = Server::<_, 22, 40, 28, { buffer_length(22) }>::new(&mut stylizer, ());
    fed(&mut server, line)
}

fn fed<B: Board<22>>(server: &mut Server<'_, '_, B, 22, 40, 28, { buffer_length(22) }>, line: &[u8]) -> u32 {
    let mut sum = 0u32;
    for &byte in line {
        if let Some(reply) = server.receive(byte) {
            sum = reply.iter().fold(sum, |sum, &b| sum.rotate_left(5) ^ u32::from(b));
        }
    }
    sum ^ server.counts().frames
}
