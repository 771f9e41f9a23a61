//! Requests that change a setting of the stylizer.

use super::{Board, Pairs, Request, server::Handler};
use crate::{ConfigError, blob::layout::MAX_GROUPS, config::parameters};

impl<B: Board<J>, const J: usize, const K: usize, const C: usize, const N: usize>
    Handler<'_, '_, B, J, K, C, N>
{
    /// Applies a request that changes a setting; ignores any other.
    #[inline(never)]
    pub(super) fn set(&mut self, request: &Request<'_>) -> Result<(), ConfigError> {
        match *request {
            Request::Style(ref weights) => self.stylizer.set_style(weights),
            Request::Labels { action, input_style } => self.labels(action, input_style),
            Request::Mask { group, searched } => self.stylizer.set_mask(group, searched),
            Request::Strength(ref strengths) => self.strengths(strengths),
            Request::GroupStyle { group, ref weights } => self.stylizer.set_group_style(group, weights),
            Request::Configure(ref parameters) => self.configure(parameters),
            Request::Reset => {
                self.stylizer.reset();
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Sets both labels or none. They change together, since no class may have one new and one old label.
    #[inline(never)]
    fn labels(&mut self, action: Option<u16>, input_style: Option<u16>) -> Result<(), ConfigError> {
        let before = self.stylizer.labels();
        self.put_labels(action, input_style).inspect_err(|_| {
            // The labels before were accepted.
            let _ = self.put_labels(before.0, before.1);
        })
    }

    fn put_labels(&mut self, action: Option<u16>, input_style: Option<u16>) -> Result<(), ConfigError> {
        self.stylizer.set_input_style(None)?;
        self.stylizer.set_action(action)?;
        self.stylizer.set_input_style(input_style)
    }

    /// Sets all strengths or none.
    #[inline(never)]
    fn strengths(&mut self, strengths: &Pairs) -> Result<(), ConfigError> {
        let before: [f32; MAX_GROUPS] = core::array::from_fn(|group| self.stylizer.strength(group));
        for &(group, strength) in strengths {
            if let Err(error) = self.stylizer.set_strength(group, strength) {
                for (group, strength) in (0..).zip(before) {
                    // Fails for numbers without a group.
                    let _ = self.stylizer.set_strength(group, strength);
                }
                return Err(error);
            }
        }
        Ok(())
    }

    #[inline(never)]
    fn configure(&mut self, parameters: &Pairs) -> Result<(), ConfigError> {
        let mut config = *self.stylizer.config();
        for &(number, value) in parameters {
            config = parameters::set(config, number, value)?;
        }
        self.stylizer.set_config(config)
    }
}
