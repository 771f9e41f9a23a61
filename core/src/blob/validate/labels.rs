//! Labels that may occur once: pairs of a style and an action, or of a style and all actions.

use crate::blob::layout::{MAX_ACTIONS, MAX_STYLES};

/// The pairs seen so far: a bit a style for each action and, behind the actions, for all of them.
pub(super) struct Labels([u32; MAX_ACTIONS + 1]);

const _: () = assert!(MAX_STYLES == u32::BITS as usize);

impl Labels {
    #[inline]
    pub fn new() -> Self {
        Self([0; MAX_ACTIONS + 1])
    }

    /// Adds a pair. False where it is there already, or can't be in any database.
    #[inline(never)]
    pub fn insert(&mut self, style: u16, action: Option<u16>) -> bool {
        let bit = 1_u32.checked_shl(u32::from(style));
        match (bit, self.0.get_mut(action.map_or(MAX_ACTIONS, usize::from))) {
            (Some(bit), Some(styles)) => {
                let is_new = *styles & bit == 0;
                *styles |= bit;
                is_new
            }
            _ => false,
        }
    }

    /// True if every one of the first `styles` styles has occurred with all actions, but perhaps one.
    #[inline]
    pub fn cover(&self, styles: usize, but: Option<u16>) -> bool {
        let [.., seen] = self.0;
        (0..styles as u32).all(|s| but.map(u32::from) == Some(s) || seen.checked_shr(s).unwrap_or(0) & 1 == 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_is_taken_once_and_only_if_a_database_can_have_it() {
        let mut labels = Labels::new();
        for (style, action, fits) in [
            (0, Some(0), true),
            (31, Some(255), true),
            (0, None, true),
            (0, Some(0), false),
            (31, Some(255), false),
            (0, None, false),
            (32, Some(0), false),
            (0, Some(257), false),
        ] {
            assert_eq!(labels.insert(style, action), fits, "{style} {action:?}");
        }
        assert!(labels.cover(1, None) && !labels.cover(2, None) && labels.cover(2, Some(1)));
    }
}
