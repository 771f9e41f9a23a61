//! A board on this machine: the core's link server with a stylizer, as a function from bytes to replies.

use gestus_core::{
    Config, ConfigError, Database, Stylizer,
    link::{Driver, Server, buffer_length, robot_buffer_length},
    robot::{Robot, layout::MAX_HINGES},
};
use gestus_database::with_capacities;

/// Takes a byte from the line and returns the bytes to send back, if it completes a request.
pub type BoardFn<'a> = dyn FnMut(u8) -> Option<Vec<u8>> + 'a;

/// Calls `run` with a board that serves the database, starts with that configuration, and may drive a robot. Its capacities
/// are those of the reference board or, if those are too small, the format's limits; of hinges it takes all that a robot can
/// have.
///
/// # Errors
/// [`ConfigError`] if the database exceeds every capacity, or lacks what the configuration's method needs, or the robot
/// was made for another database.
pub fn with_board<R>(
    database: Database<'_>,
    config: Config,
    robot: Option<Robot<'_>>,
    run: impl FnOnce(&mut BoardFn<'_>) -> R,
) -> Result<R, ConfigError> {
    with_capacities!(database.counts(), config.k, J, K, C =>
        board::<J, K, C, { buffer_length(J) }, R>(database, config, robot, run))
}

fn board<const J: usize, const K: usize, const C: usize, const N: usize, R>(
    database: Database<'_>,
    config: Config,
    robot: Option<Robot<'_>>,
    run: impl FnOnce(&mut BoardFn<'_>) -> R,
) -> Result<R, ConfigError> {
    let mut stylizer = Box::new(Stylizer::<J, K, C>::new(database, config)?);
    if let Some(robot) = robot {
        const { assert!(N >= robot_buffer_length(MAX_HINGES), "replies of the largest robot fit") };
        let driver = Driver::<(), MAX_HINGES>::new((), robot, &database)?;
        let mut server = Server::<_, J, K, C, N>::new(&mut stylizer, driver);
        return Ok(run(&mut |byte| server.receive(byte).map(<[u8]>::to_vec)));
    }
    let mut server = Server::<_, J, K, C, N>::new(&mut stylizer, ());
    Ok(run(&mut |byte| server.receive(byte).map(<[u8]>::to_vec)))
}
