//! A board on this machine: the core's server around a stylizer, as a function of bytes.

use gestus_core::{
    Config, ConfigError, Database, Stylizer,
    blob::layout::MAX_JOINTS,
    link::{Server, buffer_length},
};

/// Takes a byte of the line, gives what is to be sent back.
pub type BoardFn<'a> = dyn FnMut(u8) -> Option<Vec<u8>> + 'a;

/// Calls `run` with a board that serves the database and starts with that configuration. It has the reference
/// board's capacities, 22 joints, 40 neighbors and 28 classes, or the format's where those are too small.
///
/// # Errors
/// [`ConfigError`] where the database is larger than any board, or lacks what the configuration's method needs.
pub fn with_board<R>(
    database: Database<'_>,
    config: Config,
    run: impl FnOnce(&mut BoardFn<'_>) -> R,
) -> Result<R, ConfigError> {
    let counts = database.counts();
    if counts.joints <= 22 && counts.classes <= 28 && config.neighborhood().0 <= 40 {
        board::<22, 40, 28, { buffer_length(22) }, R>(database, config, run)
    } else {
        board::<MAX_JOINTS, 64, 256, { buffer_length(MAX_JOINTS) }, R>(database, config, run)
    }
}

fn board<const J: usize, const K: usize, const C: usize, const N: usize, R>(
    database: Database<'_>,
    config: Config,
    run: impl FnOnce(&mut BoardFn<'_>) -> R,
) -> Result<R, ConfigError> {
    let mut stylizer = Box::new(Stylizer::<J, K, C>::new(database, config)?);
    let mut server = Server::<_, J, K, C, N>::new(&mut stylizer, ());
    Ok(run(&mut |byte| server.receive(byte).map(<[u8]>::to_vec)))
}
